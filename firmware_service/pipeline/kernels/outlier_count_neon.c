#include <arm_neon.h>

#include "pipeline/kernels/outlier_count.h"

#define N_VECTORS (SHEF_OUTLIER_COUNT_PX / 4)

void shef_outlier_count_neon(const float *first, ptrdiff_t step, int32_t n_samples,
                             const float low[SHEF_OUTLIER_COUNT_PX],
                             const float high[SHEF_OUTLIER_COUNT_PX],
                             int16_t out_below[SHEF_OUTLIER_COUNT_PX],
                             int16_t out_above[SHEF_OUTLIER_COUNT_PX])
{
    uint32x4_t below[N_VECTORS];
    uint32x4_t above[N_VECTORS];

    for (int i = 0; i < N_VECTORS; i++)
        below[i] = above[i] = vdupq_n_u32(0);
    for (int32_t j = 0; j < n_samples; j++)
        for (int i = 0; i < N_VECTORS; i++) {
            const float32x4_t sample = vld1q_f32(first + j * step + 4 * i);

            /* A true comparison is all ones, that is, -1. */
            below[i] = vsubq_u32(below[i], vcltq_f32(sample, vld1q_f32(low + 4 * i)));
            above[i] = vsubq_u32(above[i], vcgtq_f32(sample, vld1q_f32(high + 4 * i)));
        }
    for (int i = 0; i < N_VECTORS; i++) {
        vst1_s16(out_below + 4 * i, vreinterpret_s16_u16(vmovn_u32(below[i])));
        vst1_s16(out_above + 4 * i, vreinterpret_s16_u16(vmovn_u32(above[i])));
    }
}
