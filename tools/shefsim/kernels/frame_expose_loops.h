/* The loop of frame_expose.h, compiled once for each instruction set.
 *
 * Private to kernels/frame_expose_*.c. On arm64 the plain build already uses the vector unit. */
#ifndef SHEFSIM_KERNELS_FRAME_EXPOSE_LOOPS_H
#define SHEFSIM_KERNELS_FRAME_EXPOSE_LOOPS_H

#include <math.h>
#include <stdint.h>

#include "shefsim/kernels/frame_expose.h"
#include "shefsim/random.h"

static inline uint8_t expose_pixel(const struct sim_expose_row *row, float light, uint32_t index)
{
    const uint32_t bits = sim_mix32(row->noise_key + index * 0x9e3779b9u);
    const int32_t sum =
        (int32_t)((bits & 0xff) + (bits >> 8 & 0xff) + (bits >> 16 & 0xff) + (bits >> 24));
    /* Four even numbers over 0..255: mean 510, deviation 147.80. */
    const float bell = (float)(sum - 510) * 6.7659e-3f;
    const float electrons = (light > 0 ? light : 0) * row->electrons;
    const float noise = sqrtf(electrons + row->read_variance) * bell;
    const float grey = row->black + (electrons + noise) * row->grey_per_electron + 0.5f;
    const float bounded = grey < 0 ? 0 : grey > 255 ? 255 : grey;

    return (uint8_t)(int32_t)bounded;
}

static inline void expose_row(const struct sim_expose_row *row, uint8_t *restrict out)
{
    const struct sim_expose_row r = *row;
    const float *restrict radiance = r.radiance;
    const float *restrict factor = r.factor;

    if (factor)
        for (int32_t i = 0; i < r.n_px; i++)
            out[i] = expose_pixel(&r, radiance[i] * factor[i], (uint32_t)i);
    else
        for (int32_t i = 0; i < r.n_px; i++)
            out[i] = expose_pixel(&r, radiance[i], (uint32_t)i);
}

#endif
