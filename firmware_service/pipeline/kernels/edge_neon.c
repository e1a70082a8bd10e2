/* 8 lanes: NEON of arm64. */
#include <arm_neon.h>
#include <stddef.h>

#include "core/cpu.h"

#define VEC_LANES 8
typedef int16x8_t vec;
typedef uint16x8_t vec_select;

static inline vec vec_load(const int16_t *from)
{
    return vld1q_s16(from);
}

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    vst1q_s8(to, vcombine_s8(vmovn_s16(a), vmovn_s16(b)));
}

static inline vec vec_set1(int16_t value)
{
    return vdupq_n_s16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return vaddq_s16(a, b);
}

/* (2ab + 2^15) >> 16: the same rounding; it saturates only at -2^15 squared, and no gain is
 * negative. */
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

/* Of two values from 0 to 32767, rounded up. */
static inline vec vec_average(vec a, vec b)
{
    return vrhaddq_s16(a, b);
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

/* One more in the lanes selected. */
static inline vec vec_count(vec counts, vec_select which)
{
    return vsubq_s16(counts, vreinterpretq_s16_u16(which));
}

/* The sum of unsigned lanes. */
static inline uint32_t vec_total(vec counts)
{
    return vaddlvq_u16(vreinterpretq_u16_s16(counts));
}

static inline uint32_t vec_bits(vec_select which)
{
    static const uint16_t bits[VEC_LANES] = { 1, 2, 4, 8, 16, 32, 64, 128 };

    return vaddvq_u16(vandq_u16(which, vld1q_u16(bits)));
}

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
