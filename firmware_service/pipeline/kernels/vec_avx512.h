/* 32 lanes of 16 bits: AVX-512. The vocabulary of the kernels that are written once for every
 * instruction set, in *_vec.h; VEC_LANES divides 32. */
#ifndef SHEF_PIPELINE_KERNELS_VEC_AVX512_H
#define SHEF_PIPELINE_KERNELS_VEC_AVX512_H

#include <immintrin.h>
#include <stdint.h>

#define VEC_LANES 32
typedef __m512i vec;
typedef __mmask32 vec_select; /* lanes that a comparison holds for */

static inline vec vec_load(const int16_t *from)
{
    return _mm512_loadu_si512(from);
}

static inline void vec_store(int16_t *to, vec a)
{
    _mm512_storeu_si512(to, a);
}

static inline vec vec_set1(int16_t value)
{
    return _mm512_set1_epi16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return _mm512_add_epi16(a, b);
}

static inline vec vec_sub(vec a, vec b)
{
    return _mm512_sub_epi16(a, b);
}

/* (a * b + 2^14) >> 15 */
static inline vec vec_mulhrs(vec a, vec b)
{
    return _mm512_mulhrs_epi16(a, b);
}

static inline vec vec_shift_left(vec a, int bits)
{
    return _mm512_sll_epi16(a, _mm_cvtsi32_si128(bits));
}

static inline vec vec_shift_right(vec a, int bits)
{
    return _mm512_srai_epi16(a, (unsigned)bits);
}

static inline vec vec_abs(vec a)
{
    return _mm512_abs_epi16(a);
}

/* Of unsigned lanes, rounded up. */
static inline vec vec_average(vec a, vec b)
{
    return _mm512_avg_epu16(a, b);
}

static inline vec vec_min(vec a, vec b)
{
    return _mm512_min_epi16(a, b);
}

static inline vec vec_max(vec a, vec b)
{
    return _mm512_max_epi16(a, b);
}

static inline vec_select vec_above(vec a, vec b)
{
    return _mm512_cmpgt_epi16_mask(a, b);
}

static inline vec_select vec_both(vec_select a, vec_select b)
{
    return a & b;
}

static inline vec_select vec_both_not(vec_select a, vec_select not_b)
{
    return a & ~not_b;
}

static inline vec vec_choose(vec_select which, vec yes, vec no)
{
    return _mm512_mask_blend_epi16(which, no, yes);
}

/* A bit for each lane, the first one lowest. */
static inline uint32_t vec_bits(vec_select which)
{
    return which;
}

#endif
