/* The event sensor's inner loops: the logarithm of a row of pixels, and which of them have passed
 * a threshold; and the grain of the light that it sees.
 *
 * Levels are natural logarithms in fixed point, SIM_LEVEL_ONE for 1.0: references add up
 * thresholds for hours without drifting, and a level is exact as a float. Every implementation is
 * the same C loop compiled for another instruction set. Only additions, multiplications and
 * divisions that IEEE 754 defines to the bit: the same levels on every machine. */
#ifndef SHEFSIM_KERNELS_EVENT_SCAN_H
#define SHEFSIM_KERNELS_EVENT_SCAN_H

#include <stdint.h>

#define SIM_LEVEL_BITS 20
#define SIM_LEVEL_ONE  (1 << SIM_LEVEL_BITS)

/* Light that the sensor takes for granted, so that black has a logarithm: 1e-6 to 1 of white. */
#define SIM_DARK_MIN 1e-6f

/* ln(radiance + dark) + offset, off by less than 5e-6.
 *   radiance  n_px, finite; below 0 counts as 0
 *   dark      SIM_DARK_MIN..1
 *   offset    added to every level
 *   out_level n_px */
typedef void sim_level_fn(const float *radiance, float dark, int32_t offset, int32_t n_px,
                          int32_t *out_level);

/* Marks the pixels whose level has reached one of its limits.
 *   low, high  n_px; low < high
 *   out_hit    n_px bytes, 1 where level <= low or level >= high, else 0 */
typedef void sim_scan_fn(const int32_t *level, const int32_t *low, const int32_t *high,
                         int32_t n_px, uint8_t *out_hit);

/* Changes light by a share between -SIM_GRAIN and SIM_GRAIN, random in every pixel: finer than any
 * threshold, coarser than the rounding of floats.
 *   radiance  n_px, changed
 *   key       another one for every row of every image */
typedef void sim_grain_fn(float *radiance, uint32_t key, int32_t n_px);

#define SIM_GRAIN 0x1p-13

struct sim_event_scan_impl {
    sim_level_fn *level;
    sim_scan_fn *scan;
    sim_grain_fn *grain;
    const char *isa;
    uint32_t cpu_features;
};

/* The best that these features allow. */
const struct sim_event_scan_impl *sim_event_scan_pick(uint32_t cpu_features);

sim_level_fn sim_level_c, sim_level_avx2, sim_level_avx512;
sim_scan_fn sim_scan_c, sim_scan_avx2, sim_scan_avx512;
sim_grain_fn sim_grain_c, sim_grain_avx2, sim_grain_avx512;

#endif
