/* Counts, for each of 32 neighbouring pixels, the samples below and above the pixel's own interval.
 *
 * Part of outlier_authors.c. Sample j of pixel i is first[j * step + i]. NaN samples count as
 * neither, and so do all samples where the bounds are NaN. Every implementation is bit-exact with
 * shef_outlier_count_c(). */
#ifndef SHEF_PIPELINE_KERNELS_OUTLIER_COUNT_H
#define SHEF_PIPELINE_KERNELS_OUTLIER_COUNT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_OUTLIER_COUNT_PX 32

/* first, step  floats, any alignment
 * n_samples    at most INT16_MAX
 * low, high    the bounds; 64-byte aligned, as are the counts
 * out_below    how many samples are less than low
 * out_above    how many samples are greater than high */
typedef void shef_outlier_count_fn(const float *first, ptrdiff_t step, int32_t n_samples,
                                   const float low[SHEF_OUTLIER_COUNT_PX],
                                   const float high[SHEF_OUTLIER_COUNT_PX],
                                   int16_t out_below[SHEF_OUTLIER_COUNT_PX],
                                   int16_t out_above[SHEF_OUTLIER_COUNT_PX]);

shef_outlier_count_fn shef_outlier_count_c;
shef_outlier_count_fn shef_outlier_count_avx2;
shef_outlier_count_fn shef_outlier_count_avx512;
shef_outlier_count_fn shef_outlier_count_neon;

#ifdef __cplusplus
}
#endif

#endif
