/* The declared disparity bias: a smooth field, six numbers, fitted on named pairs with ground
 * truth and subtracted from later disparities. It is a calibration, not part of the method: every
 * table shows results with it in a row of their own.
 *
 * Thread: setup. */
#ifndef SHEF_PIPELINE_BIAS_H
#define SHEF_PIPELINE_BIAS_H

#include "core/error.h"
#include "core/image.h"
#include "pipeline/smooth_field.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One pair's estimate and truth, images of one size, px. A pixel counts where the estimate is
 * above 0 and the truth is above 0 and below hole_px (the authors' ground truth marks holes
 * with 80). */
struct shef_bias_sample {
    struct shef_image_f32 disparity;
    struct shef_image_f32 truth;
};

/* Fits estimate - truth by robust least squares: mismatches of more than a few px count little.
 *   samples  n_samples of one size
 * SHEF_ERR_EMPTY: fewer than 1000 usable pixels, or all in one corner. */
SHEF_MUST_CHECK enum shef_err shef_bias_fit(const struct shef_bias_sample *samples,
                                            int32_t n_samples, float hole_px,
                                            struct shef_smooth_field *out_bias,
                                            struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
