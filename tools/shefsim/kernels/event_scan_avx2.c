#include "shefsim/kernels/event_scan_loops.h"

void sim_level_avx2(const float *radiance, float dark, int32_t offset, int32_t n_px,
                    int32_t *out_level)
{
    level_row(radiance, dark, offset, n_px, out_level);
}

void sim_scan_avx2(const int32_t *level, const int32_t *low, const int32_t *high, int32_t n_px,
                   uint8_t *out_hit)
{
    scan_row(level, low, high, n_px, out_hit);
}

void sim_grain_avx2(float *radiance, uint32_t key, int32_t n_px)
{
    grain_row(radiance, key, n_px);
}
