/* `events info --picture`: where events came from, and their rate over time. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/png_io.h"
#include "sheftool/events_report.h"
#include "sheftool/picture.h"

#define MARGIN_PX   20
#define HEAD_PX     64 /* title and one line below it */
#define MAP_W_PX    640
#define MAP_H_PX    480
#define MIN_MAP_PX  330 /* the texts beside it need so much */
#define SIDE_PX     340 /* texts beside the map */
#define RATE_H_PX   220
#define AXIS_PX     64 /* left of the curve, for the scale */
#define FOOT_PX     46 /* below it */
#define LINE_PX     14 /* from text line to text line */
#define WIDTH_PX    (3 * MARGIN_PX + MAP_W_PX + SIDE_PX)
#define LETTER_PX   6
#define RING_PX     6
#define MAX_RINGS   64
#define FULL_SHARE  0.995 /* of the pixels with events are darker than full brightness */
#define LOG_CLASSES 512   /* of counts, for that share */

static const struct shef_rgb8 paper = { 36, 38, 42 };
static const struct shef_rgb8 black = { 0, 0, 0 };
static const struct shef_rgb8 ink = { 235, 235, 235 };
static const struct shef_rgb8 faint = { 160, 163, 168 };
static const struct shef_rgb8 grid = { 150, 150, 150 };
static const struct shef_rgb8 on_colour = { 86, 156, 255 };
static const struct shef_rgb8 off_colour = { 255, 140, 50 };
static const struct shef_rgb8 trigger_colour = { 110, 220, 120 };
static const struct shef_rgb8 gap_colour = { 235, 60, 60 };
static const struct shef_rgb8 ring_colour = { 255, 80, 200 };

/* A rectangle inside the picture. */
struct area {
    int32_t x, y, w, h;
};

static void put(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour)
{
    if (x >= 0 && x < picture.width_px && y >= 0 && y < picture.height_px)
        shef_row_rgb8(picture, y)[x] = colour;
}

static void fill(struct shef_image_rgb8 picture, struct area area, struct shef_rgb8 colour)
{
    for (int32_t y = area.y; y < area.y + area.h; y++)
        for (int32_t x = area.x; x < area.x + area.w; x++)
            put(picture, x, y, colour);
}

/* Draws over what is there, so that both can be seen. */
static void tint(struct shef_image_rgb8 picture, struct area area, struct shef_rgb8 colour)
{
    for (int32_t y = area.y; y < area.y + area.h; y++)
        for (int32_t x = area.x; x < area.x + area.w; x++) {
            const struct shef_rgb8 below = shef_row_rgb8(picture, y)[x];

            put(picture, x, y,
                (struct shef_rgb8){ (uint8_t)((3 * below.red + colour.red) / 4),
                                    (uint8_t)((3 * below.green + colour.green) / 4),
                                    (uint8_t)((3 * below.blue + colour.blue) / 4) });
        }
}

static void print(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour,
                  const char *text)
{
    shef_picture_draw_text(picture, x, y, 1, colour, text);
}

/* How the sensor is scaled to fit its panel: several sensor pixels a drawn one, or the reverse. */
struct scale {
    uint32_t width_px; /* of the sensor */
    uint32_t height_px;
    int32_t shrink; /* one of the two is 1 */
    int32_t zoom;
    int32_t x, y; /* of the drawn sensor */
    int32_t w, h;
    int32_t panel_h; /* of the room it has */
};

static struct scale fit_sensor(const struct shef_events_report *report)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const struct shef_survey *survey = report->survey;
    struct scale scale = {
        .width_px = info->size_known ? info->width_px : survey->used_width_px,
        .height_px = info->size_known ? info->height_px : survey->used_height_px,
        .shrink = 1,
        .zoom = 1,
    };

    scale.width_px = scale.width_px ? scale.width_px : 1;
    scale.height_px = scale.height_px ? scale.height_px : 1;

    const int32_t sensor_w = (int32_t)scale.width_px;
    const int32_t sensor_h = (int32_t)scale.height_px;

    while (sensor_w > MAP_W_PX * scale.shrink || sensor_h > MAP_H_PX * scale.shrink)
        scale.shrink++;
    while (scale.shrink == 1 && sensor_w * (scale.zoom + 1) <= MAP_W_PX &&
           sensor_h * (scale.zoom + 1) <= MAP_H_PX)
        scale.zoom++;
    scale.w = (sensor_w * scale.zoom + scale.shrink - 1) / scale.shrink;
    scale.h = (sensor_h * scale.zoom + scale.shrink - 1) / scale.shrink;
    scale.x = MARGIN_PX + (MAP_W_PX - scale.w) / 2;
    scale.panel_h = scale.h > MIN_MAP_PX ? scale.h : MIN_MAP_PX;
    scale.y = HEAD_PX + (scale.panel_h - scale.h) / 2;
    return scale;
}

/* Events of the sensor pixels behind one drawn pixel. */
static void sum_block(const struct shef_survey *survey, const struct scale *scale, int32_t column,
                      int32_t row, double *out_on, double *out_off)
{
    *out_on = 0;
    *out_off = 0;
    for (int32_t dy = 0; dy < scale->shrink; dy++)
        for (int32_t dx = 0; dx < scale->shrink; dx++) {
            const uint32_t x = (uint32_t)(column * scale->shrink / scale->zoom + dx);
            const uint32_t y = (uint32_t)(row * scale->shrink / scale->zoom + dy);
            const size_t pixel = (size_t)y * survey->width_px + x;

            if (x >= survey->used_width_px || y >= survey->used_height_px)
                continue;
            *out_on += survey->on[pixel];
            *out_off += survey->off[pixel];
        }
}

/* The logarithm of a count at which a pixel is as bright as it gets: all but a few, the hot ones,
 * lie below. */
static double full_brightness(const struct shef_survey *survey, const struct scale *scale)
{
    const double top = log1p((double)(survey->n_on + survey->n_off) + 1);
    uint64_t classes[LOG_CLASSES] = { 0 };
    uint64_t n = 0;
    uint64_t n_below = 0;

    for (int32_t row = 0; row < scale->h; row++)
        for (int32_t column = 0; column < scale->w; column++) {
            double on;
            double off;

            sum_block(survey, scale, column, row, &on, &off);
            if (on + off > 0) {
                classes[(int)(log1p(on + off) / top * (LOG_CLASSES - 1))]++;
                n++;
            }
        }
    for (int i = 0; i < LOG_CLASSES; i++) {
        n_below += classes[i];
        if ((double)n_below >= FULL_SHARE * (double)n)
            return fmax((i + 1.0) / (LOG_CLASSES - 1) * top, log1p(1));
    }
    return top;
}

static uint8_t shade(double on_share, uint8_t on, uint8_t off, double brightness)
{
    /* Equal numbers of both are as bright as either alone. */
    const double mixed = on_share * on + (1 - on_share) * off;

    return (uint8_t)lrint(fmin(255, mixed * brightness));
}

static void draw_map(struct shef_image_rgb8 picture, const struct shef_survey *survey,
                     const struct scale *scale)
{
    const double full = full_brightness(survey, scale);

    fill(picture, (struct area){ scale->x, scale->y, scale->w, scale->h }, black);
    for (int32_t row = 0; row < scale->h; row++)
        for (int32_t column = 0; column < scale->w; column++) {
            double on;
            double off;

            sum_block(survey, scale, column, row, &on, &off);
            if (!(on + off > 0))
                continue;

            const double brightness = 0.15 + 0.85 * fmin(1, log1p(on + off) / full);
            const double on_share = on / (on + off);

            put(picture, scale->x + column, scale->y + row,
                (struct shef_rgb8){ shade(on_share, on_colour.red, off_colour.red, brightness),
                                    shade(on_share, on_colour.green, off_colour.green, brightness),
                                    shade(on_share, on_colour.blue, off_colour.blue, brightness) });
        }
}

static void draw_rings(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                       const struct scale *scale)
{
    for (uint32_t i = 0; i < report->n_hot && i < MAX_RINGS; i++) {
        const int32_t x =
            scale->x + (int32_t)report->hot[i].x_px * scale->zoom / scale->shrink + scale->zoom / 2;
        const int32_t y =
            scale->y + (int32_t)report->hot[i].y_px * scale->zoom / scale->shrink + scale->zoom / 2;

        for (int step = 0; step < 48; step++) {
            const double angle = step * 2 * M_PI / 48;

            put(picture, x + (int32_t)lrint(RING_PX * cos(angle)),
                y + (int32_t)lrint(RING_PX * sin(angle)), ring_colour);
        }
    }
}

/* The round step (1, 2 or 5 times a power of ten) that gives at most n_max ticks. */
static double tick_step(double range, int n_max)
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
    struct area area;
    double top_mev_s;
    double end_s;
};

static int32_t x_of(const struct curve *curve, double t_s)
{
    return curve->area.x + (int32_t)lrint(t_s / curve->end_s * (curve->area.w - 1));
}

static void draw_axes(struct shef_image_rgb8 picture, const struct curve *curve)
{
    const struct area area = curve->area;
    const double y_step = tick_step(curve->top_mev_s, 5);
    const double x_step = tick_step(curve->end_s, 10);
    char text[64];

    for (int i = 0; i * y_step <= curve->top_mev_s * (1 + 1e-9); i++) {
        const int32_t y =
            area.y + area.h - 1 - (int32_t)lrint(i * y_step / curve->top_mev_s * (area.h - 1));

        tint(picture, (struct area){ area.x, y, area.w, 1 }, grid);
        snprintf(text, sizeof text, "%.*f", tick_decimals(y_step), i * y_step);
        print(picture, area.x - 6 - LETTER_PX * (int32_t)strlen(text), y - 3, faint, text);
    }
    for (int i = 0; i * x_step <= curve->end_s * (1 + 1e-9); i++) {
        const int32_t x = x_of(curve, i * x_step);

        tint(picture, (struct area){ x, area.y, 1, area.h }, grid);
        fill(picture, (struct area){ x, area.y + area.h, 1, 4 }, faint);
        snprintf(text, sizeof text, "%.*f", tick_decimals(x_step), i * x_step);
        print(picture, x - LETTER_PX * (int32_t)strlen(text) / 2, area.y + area.h + 18, faint,
              text);
    }
    print(picture, area.x - AXIS_PX + 2, area.y - 16, ink, "Mev/s");
    print(picture, area.x + area.w - 31 * LETTER_PX, area.y + area.h + 32, ink,
          "seconds since the first event");
}

/* The bins that one column of the curve covers, as rates; stacked: on below off. */
static void column_rates(const struct shef_survey *survey, const struct curve *curve,
                         int32_t column, double *out_on, double *out_off)
{
    const double bin_s = (double)survey->bin_us / 1e6;
    const double columns_a_bin = bin_s / curve->end_s * curve->area.w;
    const uint32_t first = (uint32_t)(column / columns_a_bin);
    uint32_t end = (uint32_t)ceil((column + 1) / columns_a_bin);

    double length_us = 0;

    *out_on = 0;
    *out_off = 0;
    end = end > first ? end : first + 1;
    end = end < survey->n_bins ? end : survey->n_bins;
    for (uint32_t i = first; i < end; i++) {
        *out_on += (double)survey->bins[i].n_on;
        *out_off += (double)survey->bins[i].n_off;
        length_us += shef_survey_bin_us(survey, i);
    }
    if (end > first) {
        *out_on /= length_us;
        *out_off /= length_us;
    }
}

static double highest_rate(const struct shef_survey *survey, struct curve *curve)
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
    const struct shef_recorded_events *recorded = shef_events_source_recorded(report->source);
    const struct shef_recorded_gap *gap;
    const struct area area = curve->area;

    for (uint32_t i = 0; i < survey->n_marks; i++)
        fill(picture,
             (struct area){ x_of(curve, (double)(survey->marks_us[i] - survey->first_us) / 1e6),
                            area.y + area.h + 5, 1, 8 },
             trigger_colour);
    for (uint32_t i = 0; i < survey->n_losses; i++)
        fill(picture,
             (struct area){
                 x_of(curve, (double)(survey->losses[i].from_us - survey->first_us) / 1e6), area.y,
                 2, area.h },
             gap_colour);
    for (uint32_t i = 0; recorded && (gap = shef_recorded_events_gap(recorded, i)); i++)
        fill(picture,
             (struct area){ x_of(curve, (double)(gap->from_us - survey->first_us) / 1e6), area.y, 2,
                            area.h },
             gap_colour);
}

static void draw_rate(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                      struct area area)
{
    const struct shef_survey *survey = report->survey;
    struct curve curve = {
        .area = { area.x + AXIS_PX, area.y + 24, area.w - AXIS_PX, area.h - 24 - FOOT_PX },
        .end_s = fmax(shef_survey_duration_s(survey), 1e-6),
    };

    curve.top_mev_s = fmax(1.05 * highest_rate(survey, &curve), 1e-6);
    fill(picture, curve.area, black);
    for (int32_t column = 0; column < curve.area.w; column++) {
        const double unit = (curve.area.h - 1) / curve.top_mev_s;
        double on;
        double off;

        column_rates(survey, &curve, column, &on, &off);

        const int32_t on_px = (int32_t)lrint(on * unit);
        const int32_t all_px = (int32_t)lrint((on + off) * unit);
        const int32_t bottom = curve.area.y + curve.area.h;

        fill(picture, (struct area){ curve.area.x + column, bottom - on_px, 1, on_px }, on_colour);
        fill(picture, (struct area){ curve.area.x + column, bottom - all_px, 1, all_px - on_px },
             off_colour);
    }
    draw_axes(picture, &curve);
    draw_marks(picture, report, &curve);
}

/* One text line of the side panel. */
SHEF_PRINTF(4, 5)
static void side_line(struct shef_image_rgb8 picture, int32_t *y, struct shef_rgb8 colour,
                      const char *fmt, ...)
{
    char text[SIDE_PX / LETTER_PX + 1];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    print(picture, 2 * MARGIN_PX + MAP_W_PX, *y, colour, text);
    *y += LINE_PX;
}

static void swatch(struct shef_image_rgb8 picture, int32_t *y, struct shef_rgb8 colour,
                   const char *text)
{
    const int32_t x = 2 * MARGIN_PX + MAP_W_PX;

    fill(picture, (struct area){ x, *y - 1, 10, 10 }, colour);
    print(picture, x + 16, *y, ink, text);
    *y += LINE_PX + 2;
}

static void draw_side(struct shef_image_rgb8 picture, const struct shef_events_report *report)
{
    const struct shef_survey *survey = report->survey;
    const uint64_t n_events = survey->n_on + survey->n_off;
    const uint64_t n_gaps = shef_events_count_gaps(report);
    int32_t y = HEAD_PX;
    uint64_t n_violations = 0;

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        n_violations += report->stats.n_violations[i];
    side_line(picture, &y, ink, "duration   %.6f s", shef_survey_duration_s(survey));
    side_line(picture, &y, ink, "events     %" PRIu64, n_events);
    side_line(picture, &y, ink, "mean rate  %.3f Mev/s", shef_survey_mean_mev_per_s(survey));
    side_line(picture, &y, ink, "peak rate  %.3f Mev/s (1 ms)", shef_survey_peak_mev_per_s(survey));
    side_line(picture, &y, ink, "triggers   %" PRIu64, survey->n_triggers);
    side_line(picture, &y, n_gaps ? gap_colour : ink, "lost data  %" PRIu64 " gaps known", n_gaps);
    side_line(picture, &y, n_violations ? off_colour : ink, "violations %" PRIu64, n_violations);
    side_line(picture, &y, ink, "hot pixels %u above %.0f events/s", report->n_hot,
              report->hot_limit_per_s);
    for (uint32_t i = 0; i < report->n_hot && i < 8; i++)
        side_line(picture, &y, faint, "           (%u, %u)  %.0f events/s", report->hot[i].x_px,
                  report->hot[i].y_px, report->hot[i].per_s);
    y += LINE_PX;
    swatch(picture, &y, on_colour, "ON: brightness rose");
    swatch(picture, &y, off_colour, "OFF: brightness fell");
    swatch(picture, &y, ring_colour, "ring: a hot pixel");
    swatch(picture, &y, trigger_colour, "rising edge on a trigger input");
    swatch(picture, &y, gap_colour, "data are missing here");
    y += 4;
    side_line(picture, &y, faint, "The map shows all events of each pixel, by the");
    side_line(picture, &y, faint, "logarithm of their number.");
}

static void draw_head(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                      const struct scale *scale)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const char *slash = strrchr(report->path, '/');
    char kind[128];
    char camera[400];
    char text[700];

    snprintf(text, sizeof text, "%.80s", slash && slash[1] ? slash + 1 : report->path);
    shef_picture_draw_text(picture, MARGIN_PX, 14, 2, ink, text);
    shef_events_describe_kind(info, kind, sizeof kind);
    shef_events_describe_camera(&info->camera, camera, sizeof camera);
    snprintf(text, sizeof text, "%s, %u x %u px%s; camera: %s", kind, scale->width_px,
             scale->height_px, info->size_known ? "" : " (by its events)", camera);
    text[(WIDTH_PX - 2 * MARGIN_PX) / LETTER_PX] = '\0';
    print(picture, MARGIN_PX, 40, faint, text);
}

enum shef_err shef_events_report_draw(const struct shef_events_report *report, const char *path,
                                      struct shef_error *err)
{
    const struct scale scale = fit_sensor(report);
    const int32_t height_px = HEAD_PX + scale.panel_h + MARGIN_PX + RATE_H_PX + FOOT_PX;
    struct shef_image_rgb8 picture;
    enum shef_err code = shef_image_create_rgb8(&picture, WIDTH_PX, height_px, err);

    if (code != SHEF_OK)
        return code;
    fill(picture, (struct area){ 0, 0, WIDTH_PX, height_px }, paper);
    draw_head(picture, report, &scale);
    draw_map(picture, report->survey, &scale);
    draw_rings(picture, report, &scale);
    draw_side(picture, report);
    draw_rate(picture, report,
              (struct area){ MARGIN_PX, HEAD_PX + scale.panel_h + MARGIN_PX,
                             WIDTH_PX - 2 * MARGIN_PX, RATE_H_PX + FOOT_PX });
    code = shef_png_write_rgb8(path, picture, err);
    shef_image_destroy_rgb8(&picture);
    return code;
}
