/* `events info --picture`: the whole of it. */
#include "sheftool/events_plot.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "core/png_io.h"
#include "sheftool/picture.h"

#define MARGIN_PX 20
#define HEAD_PX   64 /* title and one line below it */
#define MAP_W_PX  640
#define MAP_H_PX  480
#define SIDE_PX   340 /* texts beside the map */
#define TICKS_PX  14  /* below the map */
#define RATE_H_PX 272
#define LINE_PX   14 /* from text line to text line */
#define MAP_X_PX  (MARGIN_PX + SHEF_PLOT_AXIS_PX)
#define SIDE_X_PX (MAP_X_PX + MAP_W_PX + 2 * MARGIN_PX)
#define WIDTH_PX  (SIDE_X_PX + SIDE_PX)
#define SHOWN_HOT 8

const struct shef_rgb8 shef_plot_paper = { 36, 38, 42 };
const struct shef_rgb8 shef_plot_black = { 0, 0, 0 };
const struct shef_rgb8 shef_plot_ink = { 235, 235, 235 };
const struct shef_rgb8 shef_plot_faint = { 160, 163, 168 };
const struct shef_rgb8 shef_plot_grid = { 150, 150, 150 };
const struct shef_rgb8 shef_plot_on = { 86, 156, 255 };
const struct shef_rgb8 shef_plot_off = { 255, 140, 50 };
const struct shef_rgb8 shef_plot_trigger = { 110, 220, 120 };
const struct shef_rgb8 shef_plot_gap = { 235, 60, 60 };
const struct shef_rgb8 shef_plot_ring = { 255, 80, 200 };

void shef_plot_put(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour)
{
    if (x >= 0 && x < picture.width_px && y >= 0 && y < picture.height_px)
        shef_row_rgb8(picture, y)[x] = colour;
}

void shef_plot_fill(struct shef_image_rgb8 picture, struct shef_plot_area area,
                    struct shef_rgb8 colour)
{
    for (int32_t y = area.y; y < area.y + area.h; y++)
        for (int32_t x = area.x; x < area.x + area.w; x++)
            shef_plot_put(picture, x, y, colour);
}

void shef_plot_tint(struct shef_image_rgb8 picture, struct shef_plot_area area,
                    struct shef_rgb8 colour)
{
    for (int32_t y = area.y; y < area.y + area.h; y++)
        for (int32_t x = area.x; x < area.x + area.w && x < picture.width_px; x++) {
            const struct shef_rgb8 below = shef_row_rgb8(picture, y)[x];

            shef_plot_put(picture, x, y,
                          (struct shef_rgb8){ (uint8_t)((3 * below.red + colour.red) / 4),
                                              (uint8_t)((3 * below.green + colour.green) / 4),
                                              (uint8_t)((3 * below.blue + colour.blue) / 4) });
        }
}

void shef_plot_print(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour,
                     const char *text)
{
    shef_picture_draw_text(picture, x, y, 1, colour, text);
}

/* One text line of the side panel. */
SHEF_PRINTF(4, 5)
static void side_line(struct shef_image_rgb8 picture, int32_t *y, struct shef_rgb8 colour,
                      const char *fmt, ...)
{
    char text[SIDE_PX / SHEF_PLOT_LETTER_PX + 1];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    shef_plot_print(picture, SIDE_X_PX, *y, colour, text);
    *y += LINE_PX;
}

static void swatch(struct shef_image_rgb8 picture, int32_t *y, struct shef_rgb8 colour,
                   const char *text)
{
    shef_plot_fill(picture, (struct shef_plot_area){ SIDE_X_PX, *y - 1, 10, 10 }, colour);
    shef_plot_print(picture, SIDE_X_PX + 16, *y, shef_plot_ink, text);
    *y += LINE_PX + 2;
}

static void list_rate(struct shef_image_rgb8 picture, int32_t *y, const char *name,
                      double mev_per_s, const char *over)
{
    const struct shef_rate_unit unit = shef_rate_unit_of(mev_per_s);

    side_line(picture, y, shef_plot_ink, "%-10s %.3f %s%s", name, mev_per_s * unit.per_mev_s,
              unit.name, over);
}

static void list_violations(struct shef_image_rgb8 picture, int32_t *y,
                            const struct shef_evt_stats *stats)
{
    int n_lines = 0;

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        if (stats->n_violations[i] > 0)
            side_line(picture, y, shef_plot_off, "%-10s %" PRIu64 " x %s",
                      n_lines++ == 0 ? "violations" : "", stats->n_violations[i],
                      shef_evt_violation_name(i));
    if (n_lines == 0)
        side_line(picture, y, shef_plot_ink, "violations none");
}

static void list_hot_pixels(struct shef_image_rgb8 picture, int32_t *y,
                            const struct shef_events_report *report)
{
    side_line(picture, y, shef_plot_ink, "hot pixels %u above %.0f events/s", report->n_hot,
              report->hot_limit_per_s);
    for (uint32_t i = 0; i < report->n_hot && i < SHOWN_HOT; i++)
        side_line(picture, y, shef_plot_faint, "           (%u, %u)  %.0f events/s",
                  report->hot[i].x_px, report->hot[i].y_px, report->hot[i].per_s);
    if (report->n_hot > SHOWN_HOT)
        side_line(picture, y, shef_plot_faint, "           and %u more", report->n_hot - SHOWN_HOT);
}

/* Writes the texts beside the map. Returns where they end. */
static int32_t draw_side(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                         const struct shef_plot_map *map)
{
    const struct shef_survey *survey = report->survey;
    const uint32_t n_gaps = shef_events_count_gaps(report);
    int32_t y = HEAD_PX;
    uint64_t n_missing = 0;

    side_line(picture, &y, shef_plot_ink, "duration   %.6f s", shef_survey_duration_s(survey));
    side_line(picture, &y, shef_plot_ink, "events     %" PRIu64, survey->n_on + survey->n_off);
    list_rate(picture, &y, "mean rate", shef_survey_mean_mev_per_s(survey), "");
    list_rate(picture, &y, "peak rate", shef_survey_peak_mev_per_s(survey), " in 1 ms");
    side_line(picture, &y, shef_plot_ink, "triggers   %" PRIu64, survey->n_triggers);
    for (int i = 0; i < SHEF_SURVEY_CHANNELS; i++)
        n_missing += shef_survey_missing_edges(survey, i);
    if (n_missing > 0)
        side_line(picture, &y, shef_plot_off, "           %" PRIu64 " seem%s to be missing",
                  n_missing, n_missing == 1 ? "s" : "");
    if (n_gaps > 0)
        side_line(picture, &y, shef_plot_gap, "lost data  %u gap%s", n_gaps,
                  n_gaps == 1 ? "" : "s");
    else
        side_line(picture, &y, shef_plot_ink, "lost data  none known");
    list_violations(picture, &y, &report->stats);
    list_hot_pixels(picture, &y, report);
    y += LINE_PX;
    swatch(picture, &y, shef_plot_on, "ON: brightness rose");
    swatch(picture, &y, shef_plot_off, "OFF: brightness fell; in the curve on top of ON");
    swatch(picture, &y, shef_plot_ring, "ring: a hot pixel");
    swatch(picture, &y, shef_plot_trigger, "rising edge on a trigger input");
    swatch(picture, &y, shef_plot_gap, "data are missing here");
    y += 4;
    side_line(picture, &y, shef_plot_faint, "The map shows all events of each pixel, by the");
    side_line(picture, &y, shef_plot_faint, "logarithm of their number; brightest from %.0f on.",
              shef_plot_map_full_count(survey, map));
    if (map->shrink > 1)
        side_line(picture, &y, shef_plot_faint, "One drawn pixel is %d x %d of the sensor's.",
                  map->shrink, map->shrink);
    return y;
}

static void draw_head(struct shef_image_rgb8 picture, const struct shef_events_report *report,
                      const struct shef_plot_map *map)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const char *slash = strrchr(report->path, '/');
    char kind[128];
    char camera[400];
    char text[700];

    snprintf(text, sizeof text, "%.80s", slash && slash[1] ? slash + 1 : report->path);
    shef_picture_draw_text(picture, MARGIN_PX, 14, 2, shef_plot_ink, text);
    shef_events_describe_kind(info, kind, sizeof kind);
    shef_events_describe_camera(&info->camera, camera, sizeof camera);
    snprintf(text, sizeof text, "%s, %u x %u px%s; camera: %s", kind, map->width_px, map->height_px,
             info->size_known ? "" : " (by its events)", camera);
    text[(WIDTH_PX - 2 * MARGIN_PX) / SHEF_PLOT_LETTER_PX] = '\0';
    shef_plot_print(picture, MARGIN_PX, 40, shef_plot_faint, text);
}

enum shef_err shef_events_report_draw(const struct shef_events_report *report, const char *path,
                                      struct shef_error *err)
{
    const struct shef_plot_area panel = { MAP_X_PX, HEAD_PX, MAP_W_PX, MAP_H_PX };
    struct shef_plot_map map = shef_plot_map_fit(report, panel, 1);
    /* Written into no picture, the texts tell how much room they need. */
    const int32_t side_h =
        draw_side((struct shef_image_rgb8){ .data = NULL }, report, &map) - HEAD_PX;

    map = shef_plot_map_fit(report, panel, side_h);

    const int32_t rate_y = HEAD_PX + map.panel_h + TICKS_PX + MARGIN_PX;
    const int32_t height_px = rate_y + RATE_H_PX;
    struct shef_image_rgb8 picture;
    enum shef_err code = shef_image_create_rgb8(&picture, WIDTH_PX, height_px, err);

    if (code != SHEF_OK)
        return code;
    shef_plot_fill(picture, (struct shef_plot_area){ 0, 0, WIDTH_PX, height_px }, shef_plot_paper);
    draw_head(picture, report, &map);
    shef_plot_map_draw(picture, report, &map);
    draw_side(picture, report, &map);
    shef_plot_rate_draw(
        picture, report,
        (struct shef_plot_area){ MARGIN_PX, rate_y, WIDTH_PX - 2 * MARGIN_PX, RATE_H_PX });
    code = shef_png_write_rgb8(path, picture, err);
    shef_image_destroy_rgb8(&picture);
    return code;
}
