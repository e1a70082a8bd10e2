/* Where events came from, as a map of the sensor. */
#include <math.h>
#include <stdio.h>

#include "sheftool/events_plot.h"

#define RING_PX     6
#define MAX_RINGS   64
#define FULL_SHARE  0.995 /* of the pixels with events are darker than full brightness */
#define LOG_CLASSES 512   /* of counts, for that share */

struct shef_plot_map shef_plot_map_fit(const struct shef_events_report *report,
                                       struct shef_plot_area panel, int32_t min_h)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const struct shef_survey *survey = report->survey;
    struct shef_plot_map scale = {
        .width_px = info->size_known ? info->width_px : survey->used_width_px,
        .height_px = info->size_known ? info->height_px : survey->used_height_px,
        .shrink = 1,
        .zoom = 1,
    };

    scale.width_px = scale.width_px ? scale.width_px : 1;
    scale.height_px = scale.height_px ? scale.height_px : 1;

    const int32_t sensor_w = (int32_t)scale.width_px;
    const int32_t sensor_h = (int32_t)scale.height_px;

    while (sensor_w > panel.w * scale.shrink || sensor_h > panel.h * scale.shrink)
        scale.shrink++;
    while (scale.shrink == 1 && sensor_w * (scale.zoom + 1) <= panel.w &&
           sensor_h * (scale.zoom + 1) <= panel.h)
        scale.zoom++;
    scale.w = (sensor_w * scale.zoom + scale.shrink - 1) / scale.shrink;
    scale.h = (sensor_h * scale.zoom + scale.shrink - 1) / scale.shrink;
    scale.x = panel.x + (panel.w - scale.w) / 2;
    scale.panel_h = scale.h > min_h ? scale.h : min_h;
    scale.y = panel.y + (scale.panel_h - scale.h) / 2;
    return scale;
}

/* Events of the sensor pixels behind one drawn pixel. */
static void sum_block(const struct shef_survey *survey, const struct shef_plot_map *scale,
                      int32_t column, int32_t row, double *out_on, double *out_off)
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

double shef_plot_map_full_count(const struct shef_survey *survey, const struct shef_plot_map *scale)
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
            return fmax(expm1((i + 1.0) / (LOG_CLASSES - 1) * top), 1);
    }
    return expm1(top);
}

static uint8_t shade(double on_share, uint8_t on, uint8_t off, double brightness)
{
    /* Equal numbers of both are as bright as either alone. */
    const double mixed = on_share * on + (1 - on_share) * off;

    return (uint8_t)lrint(fmin(255, mixed * brightness));
}

static void draw_counts(struct shef_image_rgb8 picture, const struct shef_survey *survey,
                        const struct shef_plot_map *scale)
{
    const double full = log1p(shef_plot_map_full_count(survey, scale));

    shef_plot_fill(picture, (struct shef_plot_area){ scale->x, scale->y, scale->w, scale->h },
                   shef_plot_black);
    for (int32_t row = 0; row < scale->h; row++)
        for (int32_t column = 0; column < scale->w; column++) {
            double on;
            double off;

            sum_block(survey, scale, column, row, &on, &off);
            if (!(on + off > 0))
                continue;

            const double brightness = 0.15 + 0.85 * fmin(1, log1p(on + off) / full);
            const double on_share = on / (on + off);

            shef_plot_put(picture, scale->x + column, scale->y + row,
                          (struct shef_rgb8){
                              shade(on_share, shef_plot_on.red, shef_plot_off.red, brightness),
                              shade(on_share, shef_plot_on.green, shef_plot_off.green, brightness),
                              shade(on_share, shef_plot_on.blue, shef_plot_off.blue, brightness) });
        }
}

/* The middle of the drawn pixel that shows a sensor pixel. */
static int32_t drawn(const struct shef_plot_map *scale, int32_t sensor_px)
{
    return sensor_px * scale->zoom / scale->shrink + scale->zoom / 2;
}

static void draw_rings(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                       const struct shef_plot_map *scale)
{
    for (uint32_t i = 0; i < report->n_hot && i < MAX_RINGS; i++) {
        const int32_t x = scale->x + drawn(scale, (int32_t)report->hot[i].x_px);
        const int32_t y = scale->y + drawn(scale, (int32_t)report->hot[i].y_px);
        const double radius = fmax(RING_PX, 1.1 * scale->zoom);
        const int n_steps = (int)(8 * radius);

        for (int step = 0; step < n_steps; step++) {
            const double angle = step * 2 * M_PI / n_steps;

            shef_plot_put(picture, x + (int32_t)lrint(radius * cos(angle)),
                          y + (int32_t)lrint(radius * sin(angle)), shef_plot_ring);
        }
    }
}

static void draw_axes(struct shef_image_rgb8 picture, const struct shef_plot_map *scale)
{
    const int32_t bottom = scale->y + scale->h;
    const int32_t step =
        (int32_t)fmax(1, shef_plot_tick_step(fmax(scale->width_px, scale->height_px), 8));
    char text[16];

    for (int32_t column = 0; column < (int32_t)scale->width_px; column += step) {
        const int32_t x = scale->x + drawn(scale, column);
        const int32_t n = snprintf(text, sizeof text, "%d", column);

        shef_plot_fill(picture, (struct shef_plot_area){ x, bottom, 1, 4 }, shef_plot_faint);
        shef_plot_print(picture, x - SHEF_PLOT_LETTER_PX * n / 2, bottom + 7, shef_plot_faint,
                        text);
    }
    for (int32_t row = 0; row < (int32_t)scale->height_px; row += step) {
        const int32_t y = scale->y + drawn(scale, row);
        const int32_t n = snprintf(text, sizeof text, "%d", row);

        shef_plot_fill(picture, (struct shef_plot_area){ scale->x - 4, y, 4, 1 }, shef_plot_faint);
        shef_plot_print(picture, scale->x - 6 - SHEF_PLOT_LETTER_PX * n, y - 3, shef_plot_faint,
                        text);
    }
    shef_plot_print(picture, scale->x + scale->w + 4, bottom + 7, shef_plot_ink, "px");
}

void shef_plot_map_draw(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                        const struct shef_plot_map *map)
{
    draw_counts(picture, report->survey, map);
    draw_axes(picture, map);
    draw_rings(picture, report, map);
}
