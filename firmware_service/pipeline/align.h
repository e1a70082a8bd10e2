/* Self-alignment: the smooth vertical residual v(x, y) between two rectified edge maps, measured
 * from the maps alone.
 *
 * A right (event) map that sits v px too high is moved down by v before matching: row y is read
 * from row y - v. In each block of the image, pixels of the left map are compared with the right
 * map at their matched disparity and at vertical shifts of -6..6 px; the shift with the highest
 * covariance is the block's residual, and a quadratic through all blocks is the field. The sums
 * fade slowly, so a static shape is averaged over many pairs and a slow drift is followed.
 *
 * Thread: one caller at a time. */
#ifndef SHEF_PIPELINE_ALIGN_H
#define SHEF_PIPELINE_ALIGN_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/smooth_field.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_ALIGN_COLUMNS   8
#define SHEF_ALIGN_ROWS      6
#define SHEF_ALIGN_MAX_SHIFT 6 /* px up and down */
#define SHEF_ALIGN_N_SHIFTS  (2 * SHEF_ALIGN_MAX_SHIFT + 1)

struct shef_align {
    int32_t width_px;
    int32_t height_px;
    int64_t n_observed; /* pairs so far */
    /* Covariance of left and shifted right edges per block, faded sums. */
    double score[SHEF_ALIGN_ROWS][SHEF_ALIGN_COLUMNS][SHEF_ALIGN_N_SHIFTS];
    /* Mean column that a block's pixels match in the right map, where the residual is read, and
     * the faded number of those pixels. */
    double column[SHEF_ALIGN_ROWS][SHEF_ALIGN_COLUMNS];
    double weight[SHEF_ALIGN_ROWS][SHEF_ALIGN_COLUMNS];
};

/* Starts with no observation. */
void shef_align_init(struct shef_align *align, int32_t width_px, int32_t height_px);

/* Adds one matched pair.
 *   left, right   signed edge values, the right map not aligned
 *   disparity     one value per 2x2 px cell, 1/32 px
 *   row_step      1 or more: every row_step-th row is looked at, others in each call; 1 = all */
void shef_align_observe(struct shef_align *align, struct shef_image_i8 left,
                        struct shef_image_i8 right, struct shef_image_i16 disparity,
                        int32_t row_step);

/* The field that fits the blocks, outlying blocks down-weighted.
 *   out_spread_px  median distance of the blocks from the field, may be NULL
 * SHEF_ERR_EMPTY: too few blocks with texture. */
SHEF_MUST_CHECK enum shef_err shef_align_solve(const struct shef_align *align,
                                               struct shef_smooth_field *out_field,
                                               double *out_spread_px);

#ifdef __cplusplus
}
#endif

#endif
