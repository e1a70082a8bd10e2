/* 8 values at a time: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_neon.h"

typedef int32x4_t wide;

static inline vec vec_cell_sums(const int8_t *upper, const int8_t *lower)
{
    return vpadalq_s8(vpaddlq_s8(vld1q_s8(upper)), vld1q_s8(lower));
}

static inline wide wide_zero(void)
{
    return vdupq_n_s32(0);
}

static inline wide wide_add_products(wide sums, vec a, vec b)
{
    return vmlal_high_s16(vmlal_s16(sums, vget_low_s16(a), vget_low_s16(b)), a, b);
}

static inline void wide_totals(int32_t out[3], wide a, wide b, wide c)
{
    out[0] = vaddvq_s32(a);
    out[1] = vaddvq_s32(b);
    out[2] = vaddvq_s32(c);
}

#include "pipeline/kernels/flow_vec.h"

const struct shef_flow_kernels shef_flow_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .halve = halve_vec,
    .shrink = shrink_vec,
    .correlate = correlate_vec,
    .measure = measure_vec,
};
