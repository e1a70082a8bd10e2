/* The outlier filter of the authors' evaluation, with all its quirks.
 *
 * A step of their protocol, not of ours: figures that are to stand beside the paper's table need
 * it (Wang 2021, section IV, "remove disparity outliers that do not have sufficient surrounding
 * support"), nothing else does. Semantics, after the published evaluation code:
 *
 *   1. Values below 1 become NaN, that is, no estimate. 0 means none from outside.
 *   2. In raster order, in place, every pixel (r, c) looks at the 2 * radius + 1 samples
 *      (clamp(r + k), clamp(c + k)), k = -radius..radius: the main diagonal only, each coordinate
 *      clamped on its own, so that samples repeat along the border and slide along it.
 *   3. NaN samples are dropped. Zeros that earlier rejections left behind are not: they pull
 *      later medians down.
 *   4. Fewer than 4 samples: the pixel becomes 0, also if it was NaN, and so becomes a sample.
 *   5. Else with med = their median (of an even number the mean of the middle two) the pixel v
 *      becomes 0 if |v - med| / med > 1/3 or |v - med| > 10 px. A NaN pixel compares false and
 *      stays; med = 0 rejects every v.
 *   6. At the end NaN becomes 0.
 *
 * Medians, differences and the quotient are formed in double, from float samples.
 *
 * Fast form. Between step 5's thresholds lies an interval of medians that v survives. Whether the
 * median is inside follows from how many samples lie below and above the interval, except where an
 * even number splits exactly at a threshold; there the middle two are the neighbours of the
 * threshold. So one pass of comparisons over the samples decides, no sorting, and the pixels of a
 * row are independent of each other except in the first row. Bit for bit the same as the plain
 * form for any input, infinities included. */
#ifndef SHEF_PIPELINE_OUTLIER_AUTHORS_H
#define SHEF_PIPELINE_OUTLIER_AUTHORS_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The protocol filters twice: once behind the matcher, once in the evaluation. */
#define SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX  50
#define SHEF_OUTLIER_AUTHORS_RADIUS_SECOND_PX 40

#define SHEF_OUTLIER_AUTHORS_MAX_RADIUS_PX 1024

struct shef_outlier_authors;

/* Allocates the memory for images of one size and radii up to one.             Thread: setup.
 *   cpu_features  which implementations may be picked: shef_cpu_features(), or fewer bits
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: out_filter is untouched. */
SHEF_MUST_CHECK enum shef_err shef_outlier_authors_create(struct shef_outlier_authors **out_filter,
                                                          int32_t width_px, int32_t height_px,
                                                          int32_t max_radius_px,
                                                          uint32_t cpu_features,
                                                          struct shef_error *err);

/* Filters one map. Allocates nothing, cannot fail.         Thread: one at a time per workspace.
 *   radius_px  1..max_radius_px
 *   out        may be the same image as in */
void shef_outlier_authors_run(struct shef_outlier_authors *filter, struct shef_image_f32 in,
                              int32_t radius_px, struct shef_image_f32 out);

/* The same by the letter of the steps above, for the tests: slow. */
void shef_outlier_authors_plain(struct shef_image_f32 in, int32_t radius_px,
                                struct shef_image_f32 out);

/* The implementation that was picked: "avx512", "avx2", "neon" or "c". */
const char *shef_outlier_authors_isa(const struct shef_outlier_authors *filter);

/* What create() allocated. */
size_t shef_outlier_authors_bytes(const struct shef_outlier_authors *filter);

/* NULL is allowed. */
void shef_outlier_authors_destroy(struct shef_outlier_authors *filter);

#ifdef __cplusplus
}
#endif

#endif
