/* 8 lanes of 16 bits: NEON of arm64. The vocabulary of the kernels that are written once for every
 * instruction set, in *_vec.h; VEC_LANES divides 32. */
#ifndef SHEF_PIPELINE_KERNELS_VEC_NEON_H
#define SHEF_PIPELINE_KERNELS_VEC_NEON_H

#include <arm_neon.h>
#include <stdint.h>

#define VEC_LANES 8
typedef int16x8_t vec;
typedef uint16x8_t vec_select; /* lanes that a comparison holds for */

static inline vec vec_load(const int16_t *from)
{
    return vld1q_s16(from);
}

static inline void vec_store(int16_t *to, vec a)
{
    vst1q_s16(to, a);
}

static inline vec vec_set1(int16_t value)
{
    return vdupq_n_s16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return vaddq_s16(a, b);
}

static inline vec vec_sub(vec a, vec b)
{
    return vsubq_s16(a, b);
}

/* (2ab + 2^15) >> 16: the same rounding. Only -2^15 squared saturates, which no kernel needs. */
static inline vec vec_mulhrs(vec a, vec b)
{
    return vqrdmulhq_s16(a, b);
}

static inline vec vec_shift_left(vec a, int bits)
{
    return vshlq_s16(a, vdupq_n_s16((int16_t)bits));
}

static inline vec vec_shift_right(vec a, int bits)
{
    return vshlq_s16(a, vdupq_n_s16((int16_t)-bits));
}

static inline vec vec_abs(vec a)
{
    return vabsq_s16(a);
}

/* Of unsigned lanes, rounded up. */
static inline vec vec_average(vec a, vec b)
{
    return vreinterpretq_s16_u16(vrhaddq_u16(vreinterpretq_u16_s16(a), vreinterpretq_u16_s16(b)));
}

static inline vec vec_min(vec a, vec b)
{
    return vminq_s16(a, b);
}

static inline vec vec_max(vec a, vec b)
{
    return vmaxq_s16(a, b);
}

static inline vec_select vec_above(vec a, vec b)
{
    return vcgtq_s16(a, b);
}

static inline vec_select vec_both(vec_select a, vec_select b)
{
    return vandq_u16(a, b);
}

static inline vec_select vec_both_not(vec_select a, vec_select not_b)
{
    return vbicq_u16(a, not_b);
}

static inline vec vec_choose(vec_select which, vec yes, vec no)
{
    return vbslq_s16(which, yes, no);
}

/* A bit for each lane, the first one lowest. */
static inline uint32_t vec_bits(vec_select which)
{
    static const uint16_t bits[VEC_LANES] = { 1, 2, 4, 8, 16, 32, 64, 128 };

    return vaddvq_u16(vandq_u16(which, vld1q_u16(bits)));
}

#endif
