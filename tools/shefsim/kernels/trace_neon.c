/* 4 rays at a time: NEON. */
#include <arm_neon.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "core/cpu.h"

#define LANES 4
typedef float32x4_t real;
typedef int32x4_t whole;
typedef uint32x4_t mask;

static inline real r_set(float value)
{
    return vdupq_n_f32(value);
}

static inline real r_load(const float *from)
{
    return vld1q_f32(from);
}

static inline void r_store(float *to, real a)
{
    vst1q_f32(to, a);
}

static inline real r_sqrt(real a)
{
    return vsqrtq_f32(a);
}

static inline mask r_less(real a, real b)
{
    return vcltq_f32(a, b);
}

static inline real r_pick(mask m, real a, real b)
{
    return vbslq_f32(m, a, b);
}

static inline real r_from(whole a)
{
    return vcvtq_f32_s32(a);
}

static inline real r_byte0(whole a)
{
    return r_from(vandq_s32(a, vdupq_n_s32(255)));
}

static inline real r_byte1(whole a)
{
    return r_from(vandq_s32(vshrq_n_s32(a, 8), vdupq_n_s32(255)));
}

static inline real r_byte2(whole a)
{
    return r_from(vandq_s32(vshrq_n_s32(a, 16), vdupq_n_s32(255)));
}

static inline real r_byte3(whole a)
{
    return vcvtq_f32_u32(vshrq_n_u32(vreinterpretq_u32_s32(a), 24));
}

static inline whole w_set(int32_t value)
{
    return vdupq_n_s32(value);
}

static inline void w_store(int32_t *to, whole a)
{
    vst1q_s32(to, a);
}

/* Towards zero; within the range of int32. */
static inline whole w_truncate(real a)
{
    return vcvtq_s32_f32(a);
}

static inline whole w_least(whole a, whole b)
{
    return vminq_s32(a, b);
}

static inline whole w_pick(mask m, whole a, whole b)
{
    return vbslq_s32(m, a, b);
}

/* row * pitch + column */
static inline whole w_at(whole row, int32_t pitch, whole column)
{
    return vmlaq_n_s32(column, row, pitch);
}

/* from[index] in the lower half, from[index + 1] in the upper one */
static inline whole w_gather(const uint16_t *from, whole index)
{
    uint32_t values[LANES];

    memcpy(&values[0], from + vgetq_lane_s32(index, 0), sizeof values[0]);
    memcpy(&values[1], from + vgetq_lane_s32(index, 1), sizeof values[1]);
    memcpy(&values[2], from + vgetq_lane_s32(index, 2), sizeof values[2]);
    memcpy(&values[3], from + vgetq_lane_s32(index, 3), sizeof values[3]);
    return vreinterpretq_s32_u32(vld1q_u32(values));
}

static inline mask m_and(mask a, mask b)
{
    return vandq_u32(a, b);
}

static inline mask m_or(mask a, mask b)
{
    return vorrq_u32(a, b);
}

static inline bool m_any(mask a)
{
    return vmaxvq_u32(a) != 0;
}

#include "shefsim/kernels/trace_body.h"

const struct sim_trace_kernels sim_trace_kernels_neon = { "neon", SHEF_CPU_NEON, light, depth };
