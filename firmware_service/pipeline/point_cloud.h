/* Points in space from a depth image: for PLY files and for messages.
 *
 * Points lie in the rectified left camera's axes (x right, y down, z forward), in metres, with the
 * grey of the rectified picture as their colour. Filling neither allocates nor locks.
 * Thread: any, one cloud each. */
#ifndef SHEF_PIPELINE_POINT_CLOUD_H
#define SHEF_PIPELINE_POINT_CLOUD_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_point {
    float x_m, y_m, z_m;
    struct shef_rgb8 colour;
    uint8_t confidence; /* 255 = 1 */
};
_Static_assert(sizeof(struct shef_point) == 16, "no padding");

struct shef_cloud_view {
    struct shef_image_f32 depth_m;    /* along z; 0 = none */
    struct shef_image_f32 confidence; /* 0..1; data NULL: all 1 */
    struct shef_image_u8 picture;     /* of the same size */
    double f_px;
    double cx_px, cy_px;
    float least_confidence; /* points of less are left out */
    float furthest_m;       /* and those further away; 0: none is */
    int32_t step_px;        /* every so many pixels and rows, 1 or more */
};

/* Fills points row by row. Returns how many: at most capacity; with points NULL it only counts. */
int32_t shef_point_cloud_fill(const struct shef_cloud_view *view, struct shef_point *points,
                              int32_t capacity);

/* Writes a binary little-endian PLY: x y z (float), red green blue (uchar), confidence (uchar).
 * Allocates. See shef_file_replace() for what a failure leaves behind. */
SHEF_MUST_CHECK enum shef_err shef_point_cloud_write(const char *path,
                                                     const struct shef_point *points,
                                                     int32_t n_points, struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
