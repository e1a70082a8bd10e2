/* From a row of filter values to a row of an edge map, one table of functions per instruction set.
 *
 * Values are int16 within +-32767. All arithmetic is on integers: every implementation is
 * bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_EDGE_H
#define SHEF_PIPELINE_KERNELS_EDGE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How a value becomes a graded edge: (mulhrs(clamped << shift, gain) + 64) >> 7, where clamped is
 * within +-limit and mulhrs(a, b) = (a * b + 2^14) >> 15. That is 127 * value / limit, rounded. */
struct shef_edge_scale {
    int16_t limit;
    int16_t shift;
    int16_t gain;
};

/* The scale for a limit of 1..32767. */
struct shef_edge_scale shef_edge_scale_of(int32_t limit);

struct shef_edge_kernels {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */

    /* How many of n values are at least threshold away from zero.
     *   threshold  1..32767 */
    uint32_t (*count)(const int16_t *values, int32_t n, int32_t threshold);

    /* Bit planes of n values: plus gets those of at least threshold, minus those of at most
     * -threshold. Without a minus plane plus gets both. Writes (n + 63) / 64 words, bits beyond n
     * zero. */
    void (*bits)(uint64_t *plus, uint64_t *minus, const int16_t *values, int32_t n,
                 int32_t threshold);

    /* Graded edges of n values. */
    void (*graded)(int8_t *out, const int16_t *values, int32_t n,
                   const struct shef_edge_scale *scale);

    /* One bit plane of ridges: values of at least threshold that are above their left or upper
     * neighbour and not below the right or lower one. Of the two directions it is the one in which
     * the mean of both neighbours, rounded up, is smaller; horizontal if they are equal. Slanted
     * ridges come out one pixel wide too, joined at corners.
     *   rows  magnitudes 0..32767 of three rows; one value before and after the middle one's is
     *         read too */
    void (*ridges)(uint64_t *out_words, const int16_t *const rows[3], int32_t n, int32_t threshold);
};

/* The best of them for these features. */
const struct shef_edge_kernels *shef_edge_pick(uint32_t cpu_features);

extern const struct shef_edge_kernels shef_edge_kernels_c;
extern const struct shef_edge_kernels shef_edge_kernels_avx2;
extern const struct shef_edge_kernels shef_edge_kernels_avx512;
extern const struct shef_edge_kernels shef_edge_kernels_neon;

#ifdef __cplusplus
}
#endif

#endif
