/* What the search for the flow's direction sums up, one table of functions per instruction set.
 *
 * All arithmetic is on integers: every implementation is bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_FLOW_H
#define SHEF_PIPELINE_KERNELS_FLOW_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FLOW_BLOCK_PX  32  /* width and height of a block */
#define SHEF_FLOW_VALUE_MAX 508 /* four int8 of +-127 */
#define SHEF_FLOW_SLOPE_MAX 966 /* the largest slope of logarithms, / 32 */

/* Sums over a block. They fit: 32 * 32 * 966 * 966 < 2^30. */
struct shef_flow_sums {
    int32_t ex; /* of event times slope along x */
    int32_t ey;
    int32_t ee; /* of event squared */
};

struct shef_flow_slope_sums {
    int32_t xx, xy, yy;
};

struct shef_flow_kernels {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */

    /* Sums of n cells of 2 x 2 values of two adjacent rows of 2 n values, each within +-127. */
    void (*halve)(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n);

    /* values / 32 of n slopes, rounded downwards. In place is allowed. */
    void (*shrink)(int16_t *out, const int16_t *slopes, int32_t n);

    /* Sums over a block.
     *   events, gx, gy  at its first pixel; rows stride values apart */
    struct shef_flow_sums (*correlate)(const int16_t *events, const int16_t *gx, const int16_t *gy,
                                       ptrdiff_t stride);

    /* Sums of a block's slopes alone. */
    struct shef_flow_slope_sums (*measure)(const int16_t *gx, const int16_t *gy, ptrdiff_t stride);
};

/* The best of them for these features. */
const struct shef_flow_kernels *shef_flow_pick(uint32_t cpu_features);

extern const struct shef_flow_kernels shef_flow_kernels_c;
extern const struct shef_flow_kernels shef_flow_kernels_avx2;
extern const struct shef_flow_kernels shef_flow_kernels_avx512;
extern const struct shef_flow_kernels shef_flow_kernels_neon;

#ifdef __cplusplus
}
#endif

#endif
