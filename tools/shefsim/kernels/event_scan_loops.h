/* The loops of event_scan.h, compiled once for each instruction set.
 *
 * Private to kernels/event_scan_*.c. On arm64 the plain build already uses the vector unit. */
#ifndef SHEFSIM_KERNELS_EVENT_SCAN_LOOPS_H
#define SHEFSIM_KERNELS_EVENT_SCAN_LOOPS_H

#include <stdint.h>
#include <string.h>

#include "shefsim/kernels/event_scan.h"
#include "shefsim/random.h"

static inline int32_t bits_of(float x)
{
    int32_t bits;

    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float float_of(int32_t bits)
{
    float x;

    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline int32_t level_of(float x)
{
    const int32_t ln2 = 726817;           /* in levels */
    const int32_t root_half = 0x3f3504f3; /* the float next to sqrt(1/2) */
    const float magic = 12582912;         /* 1.5 * 2^23: adding it rounds to whole numbers */
    const int32_t bits = bits_of(x);
    const int32_t exponent = (bits - root_half) >> 23;
    const float mantissa = float_of(bits - exponent * (1 << 23)); /* sqrt(1/2)..sqrt(2) */

    /* ln(m) = 2 atanh((m - 1) / (m + 1)); t^9 and on are below 3e-8. */
    const float t = (mantissa - 1) / (mantissa + 1);
    const float t2 = t * t;
    const float sum = 1 + t2 * (0.333333333f + t2 * (0.2f + t2 * 0.142857143f));
    const float level = t * sum * (float)(2 * SIM_LEVEL_ONE);

    return exponent * ln2 + (bits_of(level + magic) - bits_of(magic));
}

static inline void level_row(const float *restrict radiance, float dark, int32_t offset,
                             int32_t n_px, int32_t *restrict out_level)
{
    for (int32_t i = 0; i < n_px; i++) {
        const float light = radiance[i] > 0 ? radiance[i] : 0;

        out_level[i] = level_of(light + dark) + offset;
    }
}

static inline void scan_row(const int32_t *restrict level, const int32_t *restrict low,
                            const int32_t *restrict high, int32_t n_px, uint8_t *restrict out_hit)
{
    for (int32_t i = 0; i < n_px; i++)
        out_hit[i] = (uint8_t)((level[i] <= low[i]) | (level[i] >= high[i]));
}

static inline void grain_row(float *restrict radiance, uint32_t key, int32_t n_px)
{
    const float scale = (float)(SIM_GRAIN / 0x1p31);

    for (int32_t i = 0; i < n_px; i++) {
        const int32_t bits = (int32_t)sim_mix32(key + (uint32_t)i * 0x9e3779b9u);

        radiance[i] += radiance[i] * ((float)bits * scale);
    }
}

#endif
