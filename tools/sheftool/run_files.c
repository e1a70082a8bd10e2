#include "sheftool/run_files.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "sheftool/cloud_picture.h"

#define CLOUD_LEAST_CONFIDENCE 0.5f
#define CLOUD_FURTHEST_M       12.0f

enum shef_err shef_run_files_prepare(struct shef_run_files *files, struct shef_error *err)
{
    static const char *const names[] = { "disparity", "depth", "sigma", "pictures", "cloud" };
    const struct shef_depth_geometry *geometry = &files->geometry;
    enum shef_err code = SHEF_OK;

    for (int i = 0; i < 5 && code == SHEF_OK; i++)
        if (i < 3 || (i == 3 && files->pictures) || (i == 4 && files->cloud))
            code = shef_output_folder_add_folder(files->folder, names[i], err);
    if (code == SHEF_OK)
        code = shef_image_create_u16(&files->millimetres, geometry->width_px, geometry->height_px,
                                     err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(&files->metres, geometry->width_px, geometry->height_px, err);
    if (code == SHEF_OK && files->cloud) {
        files->points = shef_memory_create((size_t)geometry->width_px * (size_t)geometry->height_px,
                                           sizeof *files->points);
        if (!files->points)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "run: no memory for point clouds");
    }
    return code;
}

void shef_run_files_free(struct shef_run_files *files)
{
    shef_image_destroy_u16(&files->millimetres);
    shef_image_destroy_f32(&files->metres);
    free(files->points);
    files->points = NULL;
}

static enum shef_err write_map(struct shef_run_files *files, const char *name, uint64_t number,
                               const char *ending, struct shef_image_f32 map,
                               struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    const enum shef_err code =
        shef_output_folder_add(files->folder, path, err, "%s/%" PRIu64 "%s", name, number, ending);

    return code == SHEF_OK ? shef_pfm_write(path, map, err) : code;
}

/* Metres as a 16-bit picture in mm; 0 = none, 65535 = that or more. */
static enum shef_err write_millimetres(struct shef_run_files *files, const char *name,
                                       uint64_t number, struct shef_image_f32 metres,
                                       struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    const enum shef_err code =
        shef_output_folder_add(files->folder, path, err, "%s/%" PRIu64 ".png", name, number);

    for (int32_t y = 0; y < metres.height_px; y++) {
        const float *row = shef_row_f32(metres, y);
        uint16_t *out = shef_row_u16(files->millimetres, y);

        for (int32_t x = 0; x < metres.width_px; x++)
            out[x] = (uint16_t)lrintf(fminf(row[x] * 1000, UINT16_MAX));
    }
    return code == SHEF_OK ? shef_png_write_u16(path, files->millimetres, err) : code;
}

/* Depth everywhere, from the dense disparities. */
static void fill_dense_depth(struct shef_run_files *files, const struct shef_depth_output *output)
{
    const float fb = (float)(files->geometry.f_px * files->geometry.baseline_m);

    for (int32_t y = 0; y < files->metres.height_px; y++) {
        const float *disparity = shef_row_f32(output->dense_disparity, y);
        float *out = shef_row_f32(files->metres, y);

        for (int32_t x = 0; x < files->metres.width_px; x++)
            out[x] = disparity[x] > 0 ? fb / disparity[x] : 0;
    }
}

static enum shef_err write_cloud_picture(const char *path, const struct shef_point *points,
                                         int32_t n_points, struct shef_error *err)
{
    struct shef_image_rgb8 picture;
    enum shef_err code = shef_cloud_picture_create(&picture, points, n_points, err);

    if (code == SHEF_OK) {
        code = shef_png_write_rgb8(path, picture, err);
        shef_image_destroy_rgb8(&picture);
    }
    return code;
}

static enum shef_err write_cloud(struct shef_run_files *files, const struct shef_run_frame *frame,
                                 bool is_dense, struct shef_error *err)
{
    const struct shef_cloud_view view = {
        .depth_m = is_dense ? files->metres : frame->output->depth_m,
        .confidence = is_dense ? frame->output->dense_confidence : frame->output->confidence,
        .picture = shef_depth_chain_picture(frame->chain),
        .f_px = files->geometry.f_px,
        .cx_px = files->geometry.cx_px,
        .cy_px = files->geometry.cy_px,
        .least_confidence = CLOUD_LEAST_CONFIDENCE,
        .furthest_m = CLOUD_FURTHEST_M,
        .step_px = 1,
    };
    const int32_t n = shef_point_cloud_fill(&view, files->points,
                                            files->geometry.width_px * files->geometry.height_px);
    char path[SHEF_PATH_BYTES];
    enum shef_err code = shef_output_folder_add(files->folder, path, err, "cloud/%" PRIu64 ".ply",
                                                frame->frame->info.number);

    if (code == SHEF_OK)
        code = shef_point_cloud_write(path, files->points, n, err);
    if (code == SHEF_OK)
        code = shef_output_folder_add(files->folder, path, err, "cloud/%" PRIu64 ".png",
                                      frame->frame->info.number);
    return code == SHEF_OK ? write_cloud_picture(path, files->points, n, err) : code;
}

enum shef_err shef_run_files_write(struct shef_run_files *files, const struct shef_run_frame *frame,
                                   struct shef_error *err)
{
    const uint64_t number = frame->frame->info.number;
    const struct shef_depth_output *output = frame->output;
    /* The paper's modes estimate at edges only. */
    const bool has_dense = !(frame->report->flags & SHEF_DEPTH_NO_CONFIDENCE);
    const bool is_dense = files->dense && has_dense;
    enum shef_err code = write_map(files, "disparity", number, ".pfm",
                                   is_dense ? output->dense_disparity : output->disparity, err);

    if (has_dense)
        fill_dense_depth(files, output);
    if (code == SHEF_OK)
        code = write_map(files, "disparity", number, ".conf.pfm",
                         is_dense ? output->dense_confidence : output->confidence, err);
    if (code == SHEF_OK)
        code = write_millimetres(files, "depth", number, is_dense ? files->metres : output->depth_m,
                                 err);
    if (code == SHEF_OK)
        code = write_millimetres(files, "sigma", number, output->sigma_m, err);
    if (code == SHEF_OK && files->cloud)
        code = write_cloud(files, frame, has_dense, err);
    if (code == SHEF_OK && files->pictures) {
        char path[SHEF_PATH_BYTES];

        code = shef_output_folder_add(files->folder, path, err, "pictures/%" PRIu64 ".png", number);
        if (code == SHEF_OK)
            code = shef_run_sheet_write(frame, &files->geometry,
                                        files->has_truth ? files->scorer : NULL, path, err);
    }
    return code;
}
