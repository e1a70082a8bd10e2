/* From a raw frame to a rectified picture that is smaller, in one pass by a fixed-point table.
 *
 * A frame camera has more pixels than a profile needs: 2.34 of its own along each side for one of
 * `wide`. Plain bilinear fetching would skip pixels and make edges that are not there. So 2 x 2
 * pixels are averaged to a cell, and the cells are mixed bilinearly. Where a profile is nearly as
 * fine as the sensor (`paper`), a cell is one pixel.
 *
 * The result is within one grey level of the 2 x 2 mean and a bilinear fetch done in floating
 * point. Cells are made row by row, just ahead of the rows that read them, so they stay in the
 * cache. run() does not allocate, lock or log.
 *
 * Thread: one at a time. */
#ifndef SHEF_PIPELINE_FRAME_RECTIFY_H
#define SHEF_PIPELINE_FRAME_RECTIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "calib/rectification.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_frame_pixels {
    SHEF_FRAME_MONO8,
    SHEF_FRAME_BAYER8, /* any order: the mean of each 2 x 2 cell, (R + 2 G + B) / 4. Never finer */
};

/* What a pixel format of the camera (PFNC, core/frame.h) is here.
 * Returns false for one that cannot be processed; Mono8 and Bayer of 8 bits can. */
bool shef_frame_pixels_of(uint32_t pixel_format, enum shef_frame_pixels *out_pixels);

struct shef_frame_rectify;

/* Makes the table and the work space.                               Thread: setup.
 *   rectification  of the frame camera, whose sides are 2 px or more
 *   cpu_features   usually shef_cpu_features()
 * SHEF_ERR_INVALID: a side or focal length out of range, or the profile shows nothing of the
 * sensor. SHEF_ERR_NO_MEMORY. Nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_frame_rectify_create(
    struct shef_frame_rectify **out_rectify, const struct shef_rectification *rectification,
    enum shef_frame_pixels pixels, uint32_t cpu_features, struct shef_error *err);

/* NULL is allowed. */
void shef_frame_rectify_destroy(struct shef_frame_rectify *rectify);

/* Rectifies one frame. Pixels that the sensor does not see are 0.
 *   raw  of the sensor's size
 *   out  of the profile's size */
void shef_frame_rectify_run(struct shef_frame_rectify *rectify, struct shef_image_u8 raw,
                            struct shef_image_u8 out);

/* 255 where the sensor sees the pixel, else 0; of the profile's size, valid until destroy(). */
struct shef_image_u8 shef_frame_rectify_valid(const struct shef_frame_rectify *rectify);

/* Whether every pixel is valid. */
bool shef_frame_rectify_is_complete(const struct shef_frame_rectify *rectify);

/* Side of a cell in raw pixels: 1 or 2. */
int32_t shef_frame_rectify_cell_px(const struct shef_frame_rectify *rectify);

#ifdef __cplusplus
}
#endif

#endif
