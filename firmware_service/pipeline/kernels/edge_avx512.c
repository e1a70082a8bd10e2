/* 32 lanes: AVX-512. */
#include <immintrin.h>
#include <stddef.h>

#include "core/cpu.h"

#define VEC_LANES 32
typedef __m512i vec;
typedef __mmask32 vec_select;

static inline vec vec_load(const int16_t *from)
{
    return _mm512_loadu_si512(from);
}

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    _mm256_storeu_si256((__m256i *)(void *)to, _mm512_cvtepi16_epi8(a));
    _mm256_storeu_si256((__m256i *)(void *)(to + VEC_LANES), _mm512_cvtepi16_epi8(b));
}

static inline vec vec_set1(int16_t value)
{
    return _mm512_set1_epi16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return _mm512_add_epi16(a, b);
}

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

/* Of two values from 0 to 32767, rounded up. */
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

/* One more in the lanes selected. */
static inline vec vec_count(vec counts, vec_select which)
{
    return _mm512_mask_add_epi16(counts, which, counts, _mm512_set1_epi16(1));
}

/* The sum of unsigned lanes. */
static inline uint32_t vec_total(vec counts)
{
    const __m512i low = _mm512_and_si512(counts, _mm512_set1_epi32(0xffff));

    return (uint32_t)_mm512_reduce_add_epi32(_mm512_add_epi32(low, _mm512_srli_epi32(counts, 16)));
}

static inline uint32_t vec_bits(vec_select which)
{
    return which;
}

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
