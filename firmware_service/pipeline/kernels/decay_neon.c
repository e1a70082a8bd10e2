/* 4 cells at a time: NEON of arm64. */
#include <arm_neon.h>
#include "core/cpu.h"
#include "pipeline/kernels/decay.h"
#include "pipeline/kernels/vec_neon.h"

typedef float32x4_t vec_f;
typedef int32x4_t vec_i;

static inline void vec_load_cells(const struct shef_decay_cell *cells, vec_i *level, vec_i *t_us)
{
    const int32x4x2_t both = vld2q_s32((const int32_t *)(const void *)cells);

    *level = both.val[0];
    *t_us = both.val[1];
}

static inline void vec_store_values(int16_t *to, vec_i first, vec_i second)
{
    vst1q_s16(to, vmaxq_s16(vcombine_s16(vqmovn_s32(first), vqmovn_s32(second)),
                            vdupq_n_s16(-SHEF_DECAY_MAX_VALUE)));
}

static inline vec_i vec_set_i(int32_t value)
{
    return vdupq_n_s32(value);
}

static inline vec_i vec_sub_i(vec_i a, vec_i b)
{
    return vsubq_s32(a, b);
}

static inline vec_i vec_min_i(vec_i a, vec_i b)
{
    return vminq_s32(a, b);
}

static inline vec_i vec_max_i(vec_i a, vec_i b)
{
    return vmaxq_s32(a, b);
}

static inline vec_i vec_shift_left_i(vec_i a, int bits)
{
    return vshlq_s32(a, vdupq_n_s32(bits));
}

static inline vec_i vec_truncate(vec_f a)
{
    return vcvtq_s32_f32(a);
}

static inline vec_i vec_round(vec_f a)
{
    return vcvtnq_s32_f32(a);
}

static inline vec_f vec_to_f(vec_i a)
{
    return vcvtq_f32_s32(a);
}

static inline vec_f vec_as_f(vec_i a)
{
    return vreinterpretq_f32_s32(a);
}

static inline vec_f vec_set_f(float value)
{
    return vdupq_n_f32(value);
}

static inline vec_f vec_add_f(vec_f a, vec_f b)
{
    return vaddq_f32(a, b);
}

static inline vec_f vec_sub_f(vec_f a, vec_f b)
{
    return vsubq_f32(a, b);
}

static inline vec_f vec_mul_f(vec_f a, vec_f b)
{
    return vmulq_f32(a, b);
}

static inline vec vec_add_saturated(vec a, vec b)
{
    return vqaddq_s16(a, b);
}

#include "pipeline/kernels/decay_vec.h"

const struct shef_decay_kernels shef_decay_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .row = row_vec,
    .accrue = accrue_vec,
};
