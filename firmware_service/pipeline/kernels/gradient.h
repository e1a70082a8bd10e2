/* From rows of a rectified frame to the values its edges are cut from, one table of functions per
 * instruction set.
 *
 * Rows of brightness or of its logarithm are int16 with one more value before and after the row.
 * Where floating point is used, every operation is one that IEEE 754 rounds correctly: every
 * implementation is bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_GRADIENT_H
#define SHEF_PIPELINE_KERNELS_GRADIENT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_GRADIENT_LOG_MAX       7727 /* 2048 ln(261 / 6): four of them fit an int16 */
#define SHEF_GRADIENT_DIRECTION_ONE 16384
#define SHEF_GRADIENT_LENGTH_SCALE  8

/* The direction against the image flow at pixel i of a row:
 *   (first_x + step_x * i, y) / |...| * 16384, and 0 where both are 0
 * For a pixel's ray (X, Y, 1) and a camera velocity v that is (v_x - X v_z, v_y - Y v_z). */
struct shef_gradient_rays {
    float first_x;
    float step_x;
    float y;
};

struct shef_gradient_kernels {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */

    /* table[pixel] of n pixels. */
    void (*look_up)(int16_t *out, const uint8_t *pixels, int32_t n, const int16_t table[256]);

    /* n pixels as they are. */
    void (*widen)(int16_t *out, const uint8_t *pixels, int32_t n);

    /* The 3 x 3 Sobel operators, 8 times the slope: gx + to the right, gy + downwards.
     *   rows  0..SHEF_GRADIENT_LOG_MAX; one value before and after is read, too */
    void (*sobel)(int16_t *out_gx, int16_t *out_gy, const int16_t *const rows[3], int32_t n);

    /* 8 sqrt(gx^2 + gy^2) of gradients within +-1020, rounded to even. */
    void (*length)(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n);

    /* mulhrs(gx, ux) + mulhrs(gy, uy) with mulhrs(a, b) = (a * b + 2^14) >> 15: half the slope
     * along a direction of length 16384. */
    void (*along)(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n, int16_t ux,
                  int16_t uy);

    /* The same, with a direction for each pixel. */
    void (*along_rays)(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n,
                       const struct shef_gradient_rays *rays);

    /* a - b. */
    void (*difference)(int16_t *out, const int16_t *a, const int16_t *b, int32_t n);

    /* One bit plane of gradient maxima: lengths of at least threshold that are above the
     * neighbour before them and not below the one after, across the edge. The direction across is
     * level if |gy| <= tan(22.5 deg) |gx|, upright if it is the other way round, else one of the
     * diagonals.
     *   rows    lengths 0..32767 of three rows; one value before and after is read, too
     *   gx, gy  of the middle one, within +-1020 */
    void (*thin)(uint64_t *out_words, const int16_t *const rows[3], const int16_t *gx,
                 const int16_t *gy, int32_t n, int32_t threshold);
};

/* The best of them for these features. */
const struct shef_gradient_kernels *shef_gradient_pick(uint32_t cpu_features);

extern const struct shef_gradient_kernels shef_gradient_kernels_c;
extern const struct shef_gradient_kernels shef_gradient_kernels_avx2;
extern const struct shef_gradient_kernels shef_gradient_kernels_avx512;
extern const struct shef_gradient_kernels shef_gradient_kernels_neon;

#ifdef __cplusplus
}
#endif

#endif
