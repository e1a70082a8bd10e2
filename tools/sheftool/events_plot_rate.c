/* The rate over time, with triggers and gaps. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sheftool/events_plot.h"

#define AXIS_PX SHEF_PLOT_AXIS_PX
#define HEAD_PX 24 /* above it */
#define FOOT_PX 52 /* below it */

double shef_plot_tick_step(double range, int n_max)
{
    const double rough = range / n_max;
    const double base = pow(10, floor(log10(rough)));
    const double factors[] = { 1, 2, 5, 10 };

    for (int i = 0; i < 4; i++)
        if (factors[i] * base >= rough * (1 - 1e-9))
            return factors[i] * base;
    return 10 * base;
}

/* Decimals that a tick of this step needs. */
static int tick_decimals(double step)
{
    const int decimals = -(int)floor(log10(step) + 1e-9);

    return decimals > 0 ? decimals : 0;
}

struct curve {
    struct shef_plot_area area;
    struct shef_rate_unit unit;
    double top; /* in that unit */
    double end_s;
};

static int32_t x_of(const struct curve *curve, double t_s)
{
    return curve->area.x + (int32_t)lrint(t_s / curve->end_s * (curve->area.w - 1));
}

static void draw_axes(struct shef_image_rgb8 picture, const struct curve *curve)
{
    const struct shef_plot_area area = curve->area;
    const double y_step = shef_plot_tick_step(curve->top, 5);
    const double x_step = shef_plot_tick_step(curve->end_s, 10);
    char text[64];

    for (int i = 0; i * y_step <= curve->top * (1 + 1e-9); i++) {
        const int32_t y =
            area.y + area.h - 1 - (int32_t)lrint(i * y_step / curve->top * (area.h - 1));

        shef_plot_tint(picture, (struct shef_plot_area){ area.x, y, area.w, 1 }, shef_plot_grid);
        snprintf(text, sizeof text, "%.*f", tick_decimals(y_step), i * y_step);
        shef_plot_print(picture, area.x - 6 - SHEF_PLOT_LETTER_PX * (int32_t)strlen(text), y - 3,
                        shef_plot_faint, text);
    }
    for (int i = 0; i * x_step <= curve->end_s * (1 + 1e-9); i++) {
        const int32_t x = x_of(curve, i * x_step);

        shef_plot_tint(picture, (struct shef_plot_area){ x, area.y, 1, area.h }, shef_plot_grid);
        shef_plot_fill(picture, (struct shef_plot_area){ x, area.y + area.h, 1, 4 },
                       shef_plot_faint);
        snprintf(text, sizeof text, "%.*f", tick_decimals(x_step), i * x_step);
        shef_plot_print(picture, x - SHEF_PLOT_LETTER_PX * (int32_t)strlen(text) / 2,
                        area.y + area.h + 18, shef_plot_faint, text);
    }
    shef_plot_print(picture, area.x - AXIS_PX + 2, area.y - 16, shef_plot_ink, curve->unit.name);
    shef_plot_print(picture, area.x + area.w - 31 * SHEF_PLOT_LETTER_PX, area.y + area.h + 32,
                    shef_plot_ink, "seconds since the first event");
}

/* The mean rates in the bins that one column of the curve covers. */
static void column_rates(const struct shef_survey *survey, const struct curve *curve,
                         int32_t column, double *out_on, double *out_off)
{
    const double bin_s = (double)survey->bin_us / 1e6;
    const double columns_a_bin = bin_s / curve->end_s * curve->area.w;
    const uint32_t n_bins = shef_survey_rated_bins(survey);
    uint32_t first = (uint32_t)(column / columns_a_bin);
    uint32_t end = (uint32_t)ceil((column + 1) / columns_a_bin);

    double length_us = 0; /* events a us are Mev/s */

    *out_on = 0;
    *out_off = 0;
    end = end > first ? end : first + 1;
    if (end > n_bins) {
        end = n_bins;
        first = first < n_bins ? first : n_bins - 1;
    }
    for (uint32_t i = first; i < end; i++) {
        *out_on += (double)survey->bins[i].n_on;
        *out_off += (double)survey->bins[i].n_off;
        length_us += shef_survey_bin_us(survey, i);
    }
    if (length_us > 0) {
        *out_on *= curve->unit.per_mev_s / length_us;
        *out_off *= curve->unit.per_mev_s / length_us;
    }
}

static double highest_rate(const struct shef_survey *survey, const struct curve *curve)
{
    double top = 0;

    for (int32_t column = 0; column < curve->area.w; column++) {
        double on;
        double off;

        column_rates(survey, curve, column, &on, &off);
        top = fmax(top, on + off);
    }
    return top;
}

static void draw_marks(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                       const struct curve *curve)
{
    const struct shef_survey *survey = report->survey;
    const struct shef_plot_area area = curve->area;
    struct shef_events_gap gap;

    for (uint32_t i = 0; i < survey->n_marks; i++)
        shef_plot_fill(picture,
                       (struct shef_plot_area){
                           x_of(curve, (double)(survey->marks[i].t_us - survey->first_us) / 1e6),
                           area.y + area.h + 5, 1, 8 },
                       shef_plot_trigger);
    for (uint32_t i = 0; shef_events_report_gap(report, i, &gap); i++) {
        const int32_t from = x_of(curve, (double)(gap.from_us - survey->first_us) / 1e6);
        const int32_t to = x_of(curve, (double)(gap.to_us - survey->first_us) / 1e6);

        shef_plot_fill(picture,
                       (struct shef_plot_area){ from, area.y, to > from + 2 ? to - from : 2, 6 },
                       shef_plot_gap);
        shef_plot_tint(
            picture,
            (struct shef_plot_area){ from, area.y + 6, to > from + 2 ? to - from : 2, area.h - 6 },
            shef_plot_gap);
    }
}

void shef_plot_rate_draw(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                         struct shef_plot_area area)
{
    const struct shef_survey *survey = report->survey;
    struct curve curve = {
        .area = { area.x + AXIS_PX, area.y + HEAD_PX, area.w - AXIS_PX,
                  area.h - HEAD_PX - FOOT_PX },
        .unit = { "Mev/s", 1 },
        /* Without a duration there is nothing to scale to. */
        .end_s = shef_survey_duration_s(survey) > 0 ? shef_survey_duration_s(survey) : 1,
    };

    curve.unit = shef_rate_unit_of(highest_rate(survey, &curve));
    curve.top = fmax(1.05 * highest_rate(survey, &curve), 1);
    shef_plot_fill(picture, curve.area, shef_plot_black);
    for (int32_t column = 0; column < curve.area.w; column++) {
        const double unit = (curve.area.h - 1) / curve.top;
        double on;
        double off;

        column_rates(survey, &curve, column, &on, &off);

        const int32_t on_px = (int32_t)lrint(on * unit);
        const int32_t all_px = (int32_t)lrint((on + off) * unit);
        const int32_t bottom = curve.area.y + curve.area.h;

        shef_plot_fill(picture,
                       (struct shef_plot_area){ curve.area.x + column, bottom - on_px, 1, on_px },
                       shef_plot_on);
        shef_plot_fill(
            picture,
            (struct shef_plot_area){ curve.area.x + column, bottom - all_px, 1, all_px - on_px },
            shef_plot_off);
    }
    draw_axes(picture, &curve);
    draw_marks(picture, report, &curve);
}
