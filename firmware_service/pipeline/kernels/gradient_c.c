/* The reference, and the last pixels of a row for the others. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "pipeline/kernels/gradient.h"

#define TAN_22_5_Q15 13573

static void look_up_c(int16_t *out, const uint8_t *pixels, int32_t n, const int16_t table[256])
{
    for (int32_t i = 0; i < n; i++)
        out[i] = table[pixels[i]];
}

static void widen_c(int16_t *out, const uint8_t *pixels, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = pixels[i];
}

static void sobel_c(int16_t *out_gx, int16_t *out_gy, const int16_t *const rows[3], int32_t n)
{
    const int16_t *a = rows[0];
    const int16_t *b = rows[1];
    const int16_t *c = rows[2];

    for (int32_t i = 0; i < n; i++) {
        out_gx[i] =
            (int16_t)(a[i + 1] - a[i - 1] + 2 * (b[i + 1] - b[i - 1]) + c[i + 1] - c[i - 1]);
        out_gy[i] = (int16_t)(c[i - 1] - a[i - 1] + 2 * (c[i] - a[i]) + c[i + 1] - a[i + 1]);
    }
}

static void length_c(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = (int16_t)lrintf(SHEF_GRADIENT_LENGTH_SCALE *
                                 sqrtf((float)(gx[i] * gx[i] + gy[i] * gy[i])));
}

static int32_t mulhrs(int32_t a, int32_t b)
{
    return (a * b + (1 << 14)) >> 15;
}

static void along_c(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n, int16_t ux,
                    int16_t uy)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = (int16_t)(mulhrs(gx[i], ux) + mulhrs(gy[i], uy));
}

static void along_rays_c(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n,
                         const struct shef_gradient_rays *rays)
{
    for (int32_t i = 0; i < n; i++) {
        const float x = rays->first_x + rays->step_x * (float)i;
        const float length = sqrtf(x * x + rays->y * rays->y);
        const float scale = length > 0 ? SHEF_GRADIENT_DIRECTION_ONE / length : 0;

        out[i] = (int16_t)(mulhrs(gx[i], (int32_t)lrintf(x * scale)) +
                           mulhrs(gy[i], (int32_t)lrintf(rays->y * scale)));
    }
}

static void difference_c(int16_t *out, const int16_t *a, const int16_t *b, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = (int16_t)(a[i] - b[i]);
}

static void thin_c(uint64_t *out_words, const int16_t *const rows[3], const int16_t *gx,
                   const int16_t *gy, int32_t n, int32_t threshold)
{
    memset(out_words, 0, (size_t)(n + 63) / 64 * sizeof *out_words);
    for (int32_t i = 0; i < n; i++) {
        const int32_t x = abs(gx[i]);
        const int32_t y = abs(gy[i]);
        const int32_t value = rows[1][i];
        int32_t before;
        int32_t after;

        if (y <= mulhrs(x, TAN_22_5_Q15)) {
            before = rows[1][i - 1];
            after = rows[1][i + 1];
        } else if (x <= mulhrs(y, TAN_22_5_Q15)) {
            before = rows[0][i];
            after = rows[2][i];
        } else if ((gx[i] ^ gy[i]) >= 0) {
            before = rows[0][i - 1];
            after = rows[2][i + 1];
        } else {
            before = rows[0][i + 1];
            after = rows[2][i - 1];
        }
        if (value >= threshold && value > before && value >= after)
            out_words[i / 64] |= UINT64_C(1) << (i % 64);
    }
}

const struct shef_gradient_kernels shef_gradient_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .look_up = look_up_c,
    .widen = widen_c,
    .sobel = sobel_c,
    .length = length_c,
    .along = along_c,
    .along_rays = along_rays_c,
    .difference = difference_c,
    .thin = thin_c,
};
