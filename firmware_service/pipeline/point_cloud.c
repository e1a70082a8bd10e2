#include "pipeline/point_cloud.h"

#include <assert.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"

static bool is_wanted(const struct shef_cloud_view *view, const float *confidence, float depth_m,
                      int32_t x)
{
    if (!(depth_m > 0) || (view->furthest_m > 0 && depth_m > view->furthest_m))
        return false;
    return !confidence || confidence[x] >= view->least_confidence;
}

int32_t shef_point_cloud_fill(const struct shef_cloud_view *view, struct shef_point *points,
                              int32_t capacity)
{
    const float per_px = (float)(1 / view->f_px);
    int32_t n = 0;

    assert(view->step_px >= 1);
    for (int32_t y = 0; y < view->depth_m.height_px; y += view->step_px) {
        const float *depth_m = shef_row_f32(view->depth_m, y);
        const float *confidence = view->confidence.data ? shef_row_f32(view->confidence, y) : NULL;
        const uint8_t *grey = shef_row_u8(view->picture, y);
        const float ray_y = ((float)y - (float)view->cy_px) * per_px;

        for (int32_t x = 0; x < view->depth_m.width_px; x += view->step_px) {
            if (!is_wanted(view, confidence, depth_m[x], x))
                continue;
            if (points && n == capacity)
                return n;
            if (points)
                points[n] = (struct shef_point){
                    .x_m = ((float)x - (float)view->cx_px) * per_px * depth_m[x],
                    .y_m = ray_y * depth_m[x],
                    .z_m = depth_m[x],
                    .colour = { grey[x], grey[x], grey[x] },
                    .confidence = confidence ? (uint8_t)(confidence[x] * 255 + 0.5f) : 255,
                };
            n++;
        }
    }
    return n;
}

enum shef_err shef_point_cloud_write(const char *path, const struct shef_point *points,
                                     int32_t n_points, struct shef_error *err)
{
    char head[512];
    const int n_head = snprintf(head, sizeof head,
                                "ply\n"
                                "format binary_little_endian 1.0\n"
                                "comment metres, axes x right, y down, z forward\n"
                                "element vertex %d\n"
                                "property float x\n"
                                "property float y\n"
                                "property float z\n"
                                "property uchar red\n"
                                "property uchar green\n"
                                "property uchar blue\n"
                                "property uchar confidence\n"
                                "end_header\n",
                                n_points);
    const size_t n_bytes = (size_t)n_head + (size_t)n_points * sizeof *points;
    uint8_t *bytes = malloc(n_bytes);

    if (!bytes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': no memory for %d points", path,
                         n_points);
    memcpy(bytes, head, (size_t)n_head);
    if (n_points > 0)
        memcpy(bytes + n_head, points, (size_t)n_points * sizeof *points);

    const enum shef_err code = shef_file_replace(path, bytes, n_bytes, err);

    free(bytes);
    return code;
}
