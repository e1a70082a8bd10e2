/* 16 lanes: AVX2. */
#include <immintrin.h>
#include <stddef.h>

#include "core/cpu.h"

#define VEC_LANES 16
typedef __m256i vec;
typedef __m256i vec_select;

static inline vec vec_load(const int16_t *from)
{
    return _mm256_loadu_si256((const __m256i *)(const void *)from);
}

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    _mm256_storeu_si256((__m256i *)(void *)to,
                        _mm256_permute4x64_epi64(_mm256_packs_epi16(a, b), 0xd8));
}

static inline vec vec_set1(int16_t value)
{
    return _mm256_set1_epi16(value);
}

static inline vec vec_add(vec a, vec b)
{
    return _mm256_add_epi16(a, b);
}

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

/* Of two values from 0 to 32767, rounded up. */
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

/* One more in the lanes selected. */
static inline vec vec_count(vec counts, vec_select which)
{
    return _mm256_sub_epi16(counts, which);
}

/* The sum of unsigned lanes. */
static inline uint32_t vec_total(vec counts)
{
    const __m256i low = _mm256_and_si256(counts, _mm256_set1_epi32(0xffff));
    const __m256i both = _mm256_add_epi32(low, _mm256_srli_epi32(counts, 16));
    __m128i sum = _mm_add_epi32(_mm256_castsi256_si128(both), _mm256_extracti128_si256(both, 1));

    sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0x4e));
    sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0xb1));
    return (uint32_t)_mm_cvtsi128_si32(sum);
}

static inline uint32_t vec_bits(vec_select which)
{
    const __m256i bytes = _mm256_packs_epi16(which, _mm256_setzero_si256());

    return (uint32_t)_mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0xd8));
}

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
