/* One picture of the comparison: a sample of every scene by every method, and its errors. */
#include <math.h>
#include <stdio.h>

#include "core/png_io.h"
#include "sheftool/comparison.h"
#include "sheftool/contact_sheet.h"
#include "sheftool/picture.h"

#define CELL_PX       213 /* a third of the authors' 640 px */
#define N_INPUT_COLS  2   /* edges and truth stand before the methods */
#define SCALE_HEIGHT  12
#define LETTER_HEIGHT 12

struct sheet_job {
    struct shef_comparison *comparison;
    struct shef_contact_sheet sheet;
    int32_t shrink;
    struct shef_edge_map frame;
    struct shef_edge_map event;
    struct shef_image_f32 truth;
};

/* Colour scales and their meaning, below the edges of each scene. */
static void draw_legend(const struct sheet_job *job, int32_t row)
{
    static const struct shef_rgb8 ink = { 220, 220, 220 };
    const int32_t width_px = job->sheet.cell_width_px - 20;
    struct shef_image_rgb8 picture = job->sheet.picture;
    char text[64];
    int32_t x;
    int32_t y;

    shef_contact_sheet_corner(&job->sheet, 0, row, &x, &y);
    x += 10;
    y += 12;
    shef_picture_draw_text(picture, x, y, 1, ink, "disparity");
    shef_picture_draw_scale(picture, x, y + LETTER_HEIGHT, width_px, SCALE_HEIGHT);
    snprintf(text, sizeof text, "0 px far%*s%d px near", width_px / 6 - 19, "",
             job->comparison->max_disparity_px);
    shef_picture_draw_text(picture, x, y + LETTER_HEIGHT + SCALE_HEIGHT + 3, 1, ink, text);
    y += 56;
    shef_picture_draw_text(picture, x, y, 1, ink, "error");
    for (int32_t i = 0; i < width_px; i++)
        for (int32_t line = 0; line < SCALE_HEIGHT; line++)
            shef_row_rgb8(picture, y + LETTER_HEIGHT + line)[x + i] =
                shef_colour_of_error(20.0f * (2.0f * (float)i / (float)width_px - 1.0f));
    snprintf(text, sizeof text, "-20 px far%*s+20 px near", width_px / 6 - 21, "");
    shef_picture_draw_text(picture, x, y + LETTER_HEIGHT + SCALE_HEIGHT + 3, 1, ink, text);
    shef_picture_draw_text(picture, x, y + 48, 1, ink, "full colour at 5 px: bad");
    shef_picture_draw_text(picture, x, y + 60, 1, ink, "black: no estimate");
}

/* Truth where the frame has edges. */
static void keep_edges(struct sheet_job *job)
{
    int8_t edges[SHEF_IMAGE_MAX_SIDE_PX];

    for (int32_t y = 0; y < job->truth.height_px; y++) {
        shef_edge_map_row(&job->frame, y, edges);
        for (int32_t x = 0; x < job->truth.width_px; x++)
            if (!edges[x])
                shef_row_f32(job->truth, y)[x] = 0;
    }
}

static void draw_map(const struct sheet_job *job, int32_t column, int32_t row,
                     struct shef_image_f32 disparity, struct shef_image_f32 truth)
{
    const struct shef_map_drawing drawing = { disparity, truth,
                                              (float)job->comparison->max_disparity_px };
    int32_t x;
    int32_t y;

    shef_contact_sheet_corner(&job->sheet, column, row, &x, &y);
    shef_picture_draw_map(job->sheet.picture, x, y, &drawing, job->shrink);
}

static void draw_inputs(struct sheet_job *job, int32_t scene)
{
    const struct shef_dataset *dataset = job->comparison->dataset;
    const struct shef_image_f32 no_truth = { 0 };
    char text[128];
    int32_t x;
    int32_t y;

    snprintf(text, sizeof text, "%s, pair %lld", dataset->scenes.at[scene].name,
             (long long)dataset->pairs.at[job->comparison->sample_index[scene]].number);
    shef_contact_sheet_label(&job->sheet, 0, 2 * scene, text, "frame orange, event blue");
    shef_contact_sheet_corner(&job->sheet, 0, 2 * scene, &x, &y);
    shef_picture_draw_edges(job->sheet.picture, x, y, &job->frame, &job->event, job->shrink);
    draw_legend(job, 2 * scene + 1);
    shef_contact_sheet_label(&job->sheet, 1, 2 * scene, "truth", "every pixel");
    draw_map(job, 1, 2 * scene, job->truth, no_truth);
}

static void draw_method(struct sheet_job *job, int32_t scene, int32_t column,
                        const struct shef_row *row)
{
    const struct shef_figures figures = shef_tally_figures(&row->evaluation.tallies[scene]);
    const struct shef_image_f32 no_truth = { 0 };
    char text[128];

    snprintf(text, sizeof text,
             isfinite(figures.rmse_px) ? "scene: RMSE %.2f px" : "scene: no truth",
             figures.rmse_px);
    shef_contact_sheet_label(&job->sheet, column, 2 * scene, row->plan->name, text);
    draw_map(job, column, 2 * scene, row->samples[scene], no_truth);
    snprintf(text, sizeof text, isfinite(figures.rmse_px) ? "bad-p %.1f %%" : "no truth",
             100 * figures.bad[SHEF_N_BAD - 1]);
    shef_contact_sheet_label(&job->sheet, column, 2 * scene + 1, "error", text);
    draw_map(job, column, 2 * scene + 1, row->samples[scene], job->truth);
}

static enum shef_err draw_scene(struct sheet_job *job, int32_t scene, struct shef_error *err)
{
    struct shef_comparison *comparison = job->comparison;
    const size_t index = comparison->sample_index[scene];
    const struct shef_image_f32 no_truth = { 0 };
    int32_t column = N_INPUT_COLS;
    enum shef_err code =
        shef_dataset_load_edges(comparison->dataset, index, &job->frame, &job->event, err);

    if (code == SHEF_OK)
        code = shef_dataset_load_truth(comparison->dataset, index, &job->truth, err);
    if (code != SHEF_OK)
        return code;
    draw_inputs(job, scene);
    for (int i = 0; i < SHEF_N_ROWS; i++)
        if (comparison->rows[i].present)
            draw_method(job, scene, column++, &comparison->rows[i]);
    keep_edges(job);
    shef_contact_sheet_label(&job->sheet, 1, 2 * scene + 1, "truth", "at frame edges");
    draw_map(job, 1, 2 * scene + 1, job->truth, no_truth);
    shef_image_destroy_f32(&job->truth);
    return SHEF_OK;
}

static enum shef_err create_job(struct sheet_job *job, struct shef_error *err)
{
    const struct shef_dataset *dataset = job->comparison->dataset;
    const int32_t w = dataset->width_px;
    const int32_t h = dataset->height_px;
    int32_t n_columns = N_INPUT_COLS;
    char title[160];
    enum shef_err code = shef_edge_map_create(&job->frame, SHEF_EDGE_UNSIGNED, w, h, err);

    job->shrink = (w + CELL_PX - 1) / CELL_PX > 1 ? w / CELL_PX : 1;
    for (int i = 0; i < SHEF_N_ROWS; i++)
        n_columns += job->comparison->rows[i].present;
    snprintf(title, sizeof title,
             "Disparity on edges of one frame camera and one event camera: "
             "%zu pairs, one sample of each scene",
             dataset->pairs.n);
    if (code == SHEF_OK)
        code = shef_edge_map_create(&job->event, SHEF_EDGE_UNSIGNED, w, h, err);
    if (code == SHEF_OK)
        code = shef_contact_sheet_create(&job->sheet, n_columns, 2 * dataset->scenes.n,
                                         (w + job->shrink - 1) / job->shrink,
                                         (h + job->shrink - 1) / job->shrink, title, err);
    return code;
}

enum shef_err shef_comparison_draw(struct shef_comparison *comparison, const char *path,
                                   struct shef_error *err)
{
    struct sheet_job job = { .comparison = comparison };
    enum shef_err code = create_job(&job, err);

    for (int32_t scene = 0; code == SHEF_OK && scene < comparison->dataset->scenes.n; scene++)
        code = draw_scene(&job, scene, err);
    if (code == SHEF_OK)
        code = shef_png_write_rgb8(path, job.sheet.picture, err);
    shef_contact_sheet_destroy(&job.sheet);
    shef_edge_map_destroy(&job.frame);
    shef_edge_map_destroy(&job.event);
    return code;
}
