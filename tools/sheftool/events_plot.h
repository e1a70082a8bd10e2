/* The pieces of `events info --picture`: where events came from, and their rate over time.
 * Thread: main. */
#ifndef SHEFTOOL_EVENTS_PLOT_H
#define SHEFTOOL_EVENTS_PLOT_H

#include <stdint.h>

#include "core/image.h"
#include "sheftool/events_report.h"

#define SHEF_PLOT_LETTER_PX 6
#define SHEF_PLOT_AXIS_PX   64 /* left of map and curve, for the numbers */

extern const struct shef_rgb8 shef_plot_paper;
extern const struct shef_rgb8 shef_plot_black;
extern const struct shef_rgb8 shef_plot_ink;
extern const struct shef_rgb8 shef_plot_faint;
extern const struct shef_rgb8 shef_plot_grid;
extern const struct shef_rgb8 shef_plot_on;
extern const struct shef_rgb8 shef_plot_off;
extern const struct shef_rgb8 shef_plot_trigger;
extern const struct shef_rgb8 shef_plot_gap;
extern const struct shef_rgb8 shef_plot_ring;

/* A rectangle of the picture. */
struct shef_plot_area {
    int32_t x, y, w, h;
};

/* What lies outside the picture is cut off. */
void shef_plot_put(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour);
void shef_plot_fill(struct shef_image_rgb8 picture, struct shef_plot_area area,
                    struct shef_rgb8 colour);

/* Draws over what is there, so that both can be seen. */
void shef_plot_tint(struct shef_image_rgb8 picture, struct shef_plot_area area,
                    struct shef_rgb8 colour);

void shef_plot_print(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour,
                     const char *text);

/* The round step (1, 2 or 5 times a power of ten) that gives at most n_max ticks. */
double shef_plot_tick_step(double range, int n_max);

/* How the sensor is scaled to fit its panel: several sensor pixels a drawn one, or the reverse. */
struct shef_plot_map {
    uint32_t width_px; /* of the sensor */
    uint32_t height_px;
    int32_t shrink; /* one of the two is 1 */
    int32_t zoom;
    int32_t x, y; /* of the drawn sensor */
    int32_t w, h;
    int32_t panel_h; /* of the room it has */
};

/* Fits the sensor into a panel.
 *   panel  its h is the most there can be
 *   min_h  and the least */
struct shef_plot_map shef_plot_map_fit(const struct shef_events_report *report,
                                       struct shef_plot_area panel, int32_t min_h);

/* At how many events a drawn pixel is as bright as it gets: all but a few, the hot ones, lie
 * below. */
double shef_plot_map_full_count(const struct shef_survey *survey, const struct shef_plot_map *map);

/* Draws how often each pixel fired, with axes in sensor pixels, and rings around hot ones. */
void shef_plot_map_draw(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                        const struct shef_plot_map *map);

/* Draws the rate over time with its axes, triggers and gaps. */
void shef_plot_rate_draw(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                         struct shef_plot_area area);

#endif
