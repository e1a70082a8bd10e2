/* One frame on one sheet. */
#include <stdio.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/png_io.h"
#include "sheftool/contact_sheet.h"
#include "sheftool/picture.h"
#include "sheftool/run_files.h"

/* Error pictures take full colour at 5 px of f 1301 px: 2.1 px of f 555 px. */
#define ERROR_F_PX 1301.0

/* The colour scale beside a label: its bar in the second line, its numbers in the first. */
#define SCALE_X_PX     200
#define SCALE_MARKS    4
#define MARK_PX        100
#define SECOND_LINE_PX 10 /* above the cell */
#define FIRST_LINE_PX  20
#define SCALE_PX       7

struct sheet {
    struct shef_contact_sheet sheet;
    const struct shef_run_frame *frame;
    const struct shef_depth_geometry *geometry;
    const struct shef_run_scorer *scorer;
};

static void draw_picture(const struct sheet *sheet, int32_t column, int32_t row)
{
    const struct shef_image_u8 picture = shef_depth_chain_picture(sheet->frame->chain);
    int32_t x0;
    int32_t y0;

    shef_contact_sheet_corner(&sheet->sheet, column, row, &x0, &y0);
    for (int32_t y = 0; y < picture.height_px; y++) {
        const uint8_t *grey = shef_row_u8(picture, y);
        struct shef_rgb8 *out = shef_row_rgb8(sheet->sheet.picture, y0 + y) + x0;

        for (int32_t x = 0; x < picture.width_px; x++)
            out[x] = (struct shef_rgb8){ grey[x], grey[x], grey[x] };
    }
}

/* Signed maps: blue where brightness rises, orange where it falls. */
static void draw_map(const struct sheet *sheet, const struct shef_edge_map *map, int32_t column,
                     int32_t row)
{
    static const struct shef_rgb8 rising = { 86, 156, 255 };
    static const struct shef_rgb8 falling = { 255, 140, 50 };
    static const struct shef_rgb8 either = { 240, 240, 240 };
    const int unit = map->kind == SHEF_EDGE_GRADED ? 1 : 127;
    int8_t values[SHEF_PROFILE_MAX_SIDE_PX];
    int32_t x0;
    int32_t y0;

    shef_contact_sheet_corner(&sheet->sheet, column, row, &x0, &y0);
    for (int32_t y = 0; y < map->height_px; y++) {
        struct shef_rgb8 *out = shef_row_rgb8(sheet->sheet.picture, y0 + y) + x0;

        shef_edge_map_row(map, y, values);
        for (int32_t x = 0; x < map->width_px; x++) {
            const int size = abs(values[x]) * unit;
            const struct shef_rgb8 colour = map->kind == SHEF_EDGE_UNSIGNED ? either
                                            : values[x] > 0                 ? rising
                                                                            : falling;

            out[x] = (struct shef_rgb8){ (uint8_t)(colour.red * size / 127),
                                         (uint8_t)(colour.green * size / 127),
                                         (uint8_t)(colour.blue * size / 127) };
        }
    }
}

/* The disparity drawn in the scale's last colour; a quarter of the range is for wild errors. */
static double top_of_scale_px(const struct sheet *sheet)
{
    return 0.75 * sheet->geometry->max_disparity_px;
}

/* Which colour is which disparity and depth. */
static void draw_scale(const struct sheet *sheet, int32_t column, int32_t row)
{
    static const struct shef_rgb8 ink = { 235, 235, 235 };
    const double f_b_px_m = sheet->geometry->f_px * sheet->geometry->baseline_m;
    int32_t x;
    int32_t y;

    shef_contact_sheet_corner(&sheet->sheet, column, row, &x, &y);
    x += SCALE_X_PX;
    shef_picture_draw_scale(sheet->sheet.picture, x, y - SECOND_LINE_PX, SCALE_MARKS * MARK_PX,
                            SCALE_PX);
    for (int i = 1; i <= SCALE_MARKS; i++) {
        const double px = top_of_scale_px(sheet) * i / SCALE_MARKS;
        char text[32];
        const int n = snprintf(text, sizeof text, "%.0f px %.2f m", px, f_b_px_m / px);

        /* Ends where its colour is. */
        shef_picture_draw_text(sheet->sheet.picture, x + i * MARK_PX - 6 * n, y - FIRST_LINE_PX, 1,
                               ink, text);
    }
}

static void draw_disparity(const struct sheet *sheet, struct shef_image_f32 disparity,
                           int32_t column, int32_t row)
{
    const struct shef_map_drawing drawing = {
        .disparity = disparity,
        .top_px = (float)top_of_scale_px(sheet),
    };
    int32_t x;
    int32_t y;

    shef_contact_sheet_corner(&sheet->sheet, column, row, &x, &y);
    shef_picture_draw_map(sheet->sheet.picture, x, y, &drawing, 1);
    draw_scale(sheet, column, row);
}

static void draw_errors(const struct sheet *sheet, int32_t column, int32_t row)
{
    const struct shef_image_f32 truth = shef_run_scorer_truth(sheet->scorer);
    const struct shef_image_f32 estimate = shef_run_scorer_estimate(sheet->scorer);
    const float scale = (float)(ERROR_F_PX / sheet->geometry->f_px);
    int32_t x0;
    int32_t y0;

    shef_contact_sheet_corner(&sheet->sheet, column, row, &x0, &y0);
    for (int32_t y = 0; y < truth.height_px; y++) {
        const float *right = shef_row_f32(truth, y);
        const float *found = shef_row_f32(estimate, y);
        struct shef_rgb8 *out = shef_row_rgb8(sheet->sheet.picture, y0 + y) + x0;

        for (int32_t x = 0; x < truth.width_px; x++)
            if (right[x] > 0 && found[x] > 0)
                out[x] = shef_colour_of_error(scale * (found[x] - right[x]));
    }
}

static void draw_all(const struct sheet *sheet)
{
    const struct shef_depth_report *report = sheet->frame->report;
    const struct shef_edge_pair pair = shef_depth_chain_pair(sheet->frame->chain, 0);
    const bool has_dense = !(report->flags & SHEF_DEPTH_NO_CONFIDENCE);
    const char *edge_colours =
        pair.left->kind == SHEF_EDGE_UNSIGNED
            ? "as matched"
            : "as matched: blue where brightness rises, orange where it falls";
    char text[96];

    snprintf(text, sizeof text, "%lld points", (long long)report->n_depths);
    shef_contact_sheet_label(&sheet->sheet, 0, 0, "frame", "rectified");
    draw_picture(sheet, 0, 0);
    shef_contact_sheet_label(&sheet->sheet, 1, 0, "frame's edges", edge_colours);
    draw_map(sheet, pair.left, 1, 0);
    shef_contact_sheet_label(&sheet->sheet, 2, 0, "events' edges", edge_colours);
    draw_map(sheet, pair.right, 2, 0);
    shef_contact_sheet_label(&sheet->sheet, 0, 1, "disparity at frame edges", text);
    draw_disparity(sheet, sheet->frame->output->disparity, 0, 1);
    if (sheet->scorer) {
        shef_contact_sheet_label(&sheet->sheet, 1, 1, "true disparity", "");
        draw_disparity(sheet, shef_run_scorer_everywhere(sheet->scorer), 1, 1);
        shef_contact_sheet_label(&sheet->sheet, 2, 1,
                                 "error: white none, blue too far, red too near",
                                 "full colour at 2.1 px of f 555 px");
        draw_errors(sheet, 2, 1);
    } else if (has_dense) {
        shef_contact_sheet_label(&sheet->sheet, 1, 1, "disparity everywhere", "");
        draw_disparity(sheet, sheet->frame->output->dense_disparity, 1, 1);
    }
}

enum shef_err shef_run_sheet_write(const struct shef_run_frame *frame,
                                   const struct shef_depth_geometry *geometry,
                                   const struct shef_run_scorer *scorer, const char *path,
                                   struct shef_error *err)
{
    struct sheet sheet = { .frame = frame, .geometry = geometry, .scorer = scorer };
    char title[96];

    snprintf(title, sizeof title, "frame %llu, mode %s",
             (unsigned long long)frame->frame->info.number,
             shef_depth_mode_name(frame->report->mode));

    enum shef_err code = shef_contact_sheet_create(&sheet.sheet, 3, 2, geometry->width_px,
                                                   geometry->height_px, title, err);

    if (code != SHEF_OK)
        return code;
    draw_all(&sheet);
    code = shef_png_write_rgb8(path, sheet.sheet.picture, err);
    shef_contact_sheet_destroy(&sheet.sheet);
    return code;
}
