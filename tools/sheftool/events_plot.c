/* `events info --picture`: the whole of it. */
#include "sheftool/events_plot.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "core/png_io.h"
#include "sheftool/picture.h"

#define MARGIN_PX  20
#define HEAD_PX    64 /* title and one line below it */
#define MAP_W_PX   640
#define MAP_H_PX   480
#define MIN_MAP_PX 330 /* the texts beside it need so much */
#define SIDE_PX    340 /* texts beside the map */
#define RATE_H_PX  266
#define LINE_PX    14 /* from text line to text line */
#define WIDTH_PX   (3 * MARGIN_PX + MAP_W_PX + SIDE_PX)

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
    shef_plot_print(picture, 2 * MARGIN_PX + MAP_W_PX, *y, colour, text);
    *y += LINE_PX;
}

static void swatch(struct shef_image_rgb8 picture, int32_t *y, struct shef_rgb8 colour,
                   const char *text)
{
    const int32_t x = 2 * MARGIN_PX + MAP_W_PX;

    shef_plot_fill(picture, (struct shef_plot_area){ x, *y - 1, 10, 10 }, colour);
    shef_plot_print(picture, x + 16, *y, shef_plot_ink, text);
    *y += LINE_PX + 2;
}

static void draw_side(struct shef_image_rgb8 picture, const struct shef_events_report *report)
{
    const struct shef_survey *survey = report->survey;
    const uint64_t n_events = survey->n_on + survey->n_off;
    const uint32_t n_gaps = shef_events_count_gaps(report);
    int32_t y = HEAD_PX;
    uint64_t n_violations = 0;

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        n_violations += report->stats.n_violations[i];
    side_line(picture, &y, shef_plot_ink, "duration   %.6f s", shef_survey_duration_s(survey));
    side_line(picture, &y, shef_plot_ink, "events     %" PRIu64, n_events);
    side_line(picture, &y, shef_plot_ink, "mean rate  %.3f Mev/s",
              shef_survey_mean_mev_per_s(survey));
    side_line(picture, &y, shef_plot_ink, "peak rate  %.3f Mev/s (1 ms)",
              shef_survey_peak_mev_per_s(survey));
    side_line(picture, &y, shef_plot_ink, "triggers   %" PRIu64, survey->n_triggers);
    side_line(picture, &y, n_gaps ? shef_plot_gap : shef_plot_ink, "lost data  %u gaps known",
              n_gaps);
    side_line(picture, &y, n_violations ? shef_plot_off : shef_plot_ink, "violations %" PRIu64,
              n_violations);
    side_line(picture, &y, shef_plot_ink, "hot pixels %u above %.0f events/s", report->n_hot,
              report->hot_limit_per_s);
    for (uint32_t i = 0; i < report->n_hot && i < 8; i++)
        side_line(picture, &y, shef_plot_faint, "           (%u, %u)  %.0f events/s",
                  report->hot[i].x_px, report->hot[i].y_px, report->hot[i].per_s);
    y += LINE_PX;
    swatch(picture, &y, shef_plot_on, "ON: brightness rose");
    swatch(picture, &y, shef_plot_off, "OFF: brightness fell");
    swatch(picture, &y, shef_plot_ring, "ring: a hot pixel");
    swatch(picture, &y, shef_plot_trigger, "rising edge on a trigger input");
    swatch(picture, &y, shef_plot_gap, "data are missing here");
    y += 4;
    side_line(picture, &y, shef_plot_faint, "The map shows all events of each pixel, by the");
    side_line(picture, &y, shef_plot_faint, "logarithm of their number.");
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
    const struct shef_plot_map map = shef_plot_map_fit(
        report, (struct shef_plot_area){ MARGIN_PX, HEAD_PX, MAP_W_PX, MAP_H_PX }, MIN_MAP_PX);
    const int32_t height_px = HEAD_PX + map.panel_h + MARGIN_PX + RATE_H_PX;
    struct shef_image_rgb8 picture;
    enum shef_err code = shef_image_create_rgb8(&picture, WIDTH_PX, height_px, err);

    if (code != SHEF_OK)
        return code;
    shef_plot_fill(picture, (struct shef_plot_area){ 0, 0, WIDTH_PX, height_px }, shef_plot_paper);
    draw_head(picture, report, &map);
    shef_plot_map_draw(picture, report, &map);
    draw_side(picture, report);
    shef_plot_rate_draw(picture, report,
                        (struct shef_plot_area){ MARGIN_PX, HEAD_PX + map.panel_h + MARGIN_PX,
                                                 WIDTH_PX - 2 * MARGIN_PX, RATE_H_PX });
    code = shef_png_write_rgb8(path, picture, err);
    shef_image_destroy_rgb8(&picture);
    return code;
}
