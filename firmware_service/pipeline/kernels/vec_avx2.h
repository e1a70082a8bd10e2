/* 16 lanes of 16 bits: AVX2. The vocabulary of the kernels that are written once for every
 * instruction set, in *_vec.h; VEC_LANES divides 32. */
#ifndef SHEF_PIPELINE_KERNELS_VEC_AVX2_H
#define SHEF_PIPELINE_KERNELS_VEC_AVX2_H

#include <immintrin.h>
#include <stdint.h>

#define VEC_LANES 16
typedef __m256i vec;
typedef __m256i vec_select; /* lanes that a comparison holds for */

static inline vec vec_load(const int16_t *from)
{
    return _mm256_loadu_si256((const __m256i *)(const void *)from);
}

static inline void vec_store(int16_t *to, vec a)
{
    _mm256_storeu_si256((__m256i *)(void *)to, a);
}

static inline vec vec_set1(int16_t value)
{
    return _mm256_set1_epi16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return _mm256_add_epi16(a, b);
}

static inline vec vec_sub(vec a, vec b)
{
    return _mm256_sub_epi16(a, b);
}

/* (a * b + 2^14) >> 15 */
static inline vec vec_mulhrs(vec a, vec b)
{
    return _mm256_mulhrs_epi16(a, b);
}

static inline vec vec_shift_left(vec a, int bits)
{
    return _mm256_sll_epi16(a, _mm_cvtsi32_si128(bits));
}

static inline vec vec_shift_right(vec a, int bits)
{
    return _mm256_srai_epi16(a, bits);
}

static inline vec vec_abs(vec a)
{
    return _mm256_abs_epi16(a);
}

/* Of unsigned lanes, rounded up. */
static inline vec vec_average(vec a, vec b)
{
    return _mm256_avg_epu16(a, b);
}

static inline vec vec_min(vec a, vec b)
{
    return _mm256_min_epi16(a, b);
}

static inline vec vec_max(vec a, vec b)
{
    return _mm256_max_epi16(a, b);
}

static inline vec_select vec_above(vec a, vec b)
{
    return _mm256_cmpgt_epi16(a, b);
}

static inline vec_select vec_both(vec_select a, vec_select b)
{
    return _mm256_and_si256(a, b);
}

static inline vec_select vec_both_not(vec_select a, vec_select not_b)
{
    return _mm256_andnot_si256(not_b, a);
}

static inline vec vec_choose(vec_select which, vec yes, vec no)
{
    return _mm256_blendv_epi8(no, yes, which);
}

/* A bit for each lane, the first one lowest. */
static inline uint32_t vec_bits(vec_select which)
{
    const __m256i bytes = _mm256_packs_epi16(which, _mm256_setzero_si256());

    return (uint32_t)_mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0xd8));
}

#endif
