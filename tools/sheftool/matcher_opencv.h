/* OpenCV's StereoBM and StereoSGBM on edge maps: peers to compare with, never part of ours.
 *
 * Maps become 8-bit images of 0 and 255, optionally blurred. OpenCV runs on one thread.
 * Thread: one at a time per matcher. */
#ifndef SHEFTOOL_MATCHER_OPENCV_H
#define SHEFTOOL_MATCHER_OPENCV_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_opencv_params {
    int32_t width_px;
    int32_t height_px;
    int32_t max_disparity_px; /* 1..max is kept; OpenCV searches up to the next multiple of 16 */
    int32_t block_px;         /* odd, no larger than the maps */
    double blur_px;           /* sigma of a Gaussian over both maps; 0: none */
    bool semi_global;         /* StereoSGBM (5 paths), else StereoBM */
    int32_t p1, p2;           /* penalties of StereoSGBM per pixel of the block; p2 times the
                                 block's area must stay below 32767 */
    bool keep_ambiguous;      /* StereoBM: uniqueness ratio 0 instead of 15 */
};

struct shef_opencv;

/* All other OpenCV parameters keep the library's defaults. NULL: err says why. */
struct shef_opencv *shef_opencv_create(const struct shef_opencv_params *params,
                                       struct shef_error *err);

/* Turns the maps into the images that match() takes. */
SHEF_MUST_CHECK enum shef_err shef_opencv_prepare(struct shef_opencv *opencv,
                                                  const struct shef_edge_map *frame,
                                                  const struct shef_edge_map *event,
                                                  struct shef_error *err);

/* Runs OpenCV's matcher on the prepared images. */
SHEF_MUST_CHECK enum shef_err shef_opencv_match(struct shef_opencv *opencv, struct shef_error *err);

/* Copies the result, px, 0 = none.
 *   edges  keep only pixels on these edges; NULL: keep all */
void shef_opencv_read(const struct shef_opencv *opencv, const struct shef_edge_map *edges,
                      struct shef_image_f32 out_disparity);

/* NULL is allowed. */
void shef_opencv_destroy(struct shef_opencv *opencv);

/* OpenCV's version, "4.6.0". */
const char *shef_opencv_version(void);

#ifdef __cplusplus
}
#endif

#endif
