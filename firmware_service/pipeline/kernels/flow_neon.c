/* 8 values at a time: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/flow.h"

static void halve_neon(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n)
{
    int32_t i = 0;

    for (; i + 8 <= n; i += 8)
        vst1q_s16(out + i,
                  vpadalq_s8(vpaddlq_s8(vld1q_s8(upper + 2 * i)), vld1q_s8(lower + 2 * i)));
    shef_flow_kernels_c.halve(out + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void shrink_neon(int16_t *out, const int16_t *slopes, int32_t n)
{
    int32_t i = 0;

    for (; i + 8 <= n; i += 8)
        vst1q_s16(out + i, vshrq_n_s16(vld1q_s16(slopes + i), 5));
    shef_flow_kernels_c.shrink(out + i, slopes + i, n - i);
}

static inline int32x4_t add_product(int32x4_t sums, int16x8_t a, int16x8_t b)
{
    return vmlal_high_s16(vmlal_s16(sums, vget_low_s16(a), vget_low_s16(b)), a, b);
}

static struct shef_flow_sums correlate_neon(const int16_t *events, const int16_t *gx,
                                            const int16_t *gy, ptrdiff_t stride)
{
    int32x4_t ex = vdupq_n_s32(0);
    int32x4_t ey = vdupq_n_s32(0);
    int32x4_t ee = vdupq_n_s32(0);

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, events += stride, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += 8) {
            const int16x8_t e = vld1q_s16(events + x);

            ex = add_product(ex, e, vld1q_s16(gx + x));
            ey = add_product(ey, e, vld1q_s16(gy + x));
            ee = add_product(ee, e, e);
        }
    return (struct shef_flow_sums){ vaddvq_s32(ex), vaddvq_s32(ey), vaddvq_s32(ee) };
}

static struct shef_flow_slope_sums measure_neon(const int16_t *gx, const int16_t *gy,
                                                ptrdiff_t stride)
{
    int32x4_t xx = vdupq_n_s32(0);
    int32x4_t xy = vdupq_n_s32(0);
    int32x4_t yy = vdupq_n_s32(0);

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += 8) {
            const int16x8_t slope_x = vld1q_s16(gx + x);
            const int16x8_t slope_y = vld1q_s16(gy + x);

            xx = add_product(xx, slope_x, slope_x);
            xy = add_product(xy, slope_x, slope_y);
            yy = add_product(yy, slope_y, slope_y);
        }
    return (struct shef_flow_slope_sums){ vaddvq_s32(xx), vaddvq_s32(xy), vaddvq_s32(yy) };
}

const struct shef_flow_kernels shef_flow_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .halve = halve_neon,
    .shrink = shrink_neon,
    .correlate = correlate_neon,
    .measure = measure_neon,
};
