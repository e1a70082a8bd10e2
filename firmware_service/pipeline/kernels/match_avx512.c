/* 32 lanes: AVX-512 F, BW, VL, DQ. */
#include <immintrin.h>
#include "core/cpu.h"
#include "pipeline/kernels/vec_avx512.h"

/* A row's last vector holds 16 or 32 lanes. Half a vector is moved as one: masked stores are slow
 * on some processors. */
static inline vec vec_load_first(const void *from, int32_t n)
{
    return n >= VEC_LANES ? _mm512_loadu_si512(from)
                          : _mm512_zextsi256_si512(_mm256_loadu_si256((const __m256i *)from));
}

/* Lanes that are not loaded are those of fill. */
static inline vec vec_load_filled(const void *from, int32_t n, vec fill)
{
    return n >= VEC_LANES ? _mm512_loadu_si512(from)
                          : _mm512_inserti64x4(fill, _mm256_loadu_si256((const __m256i *)from), 0);
}

static inline void vec_store_first(void *to, vec a, int32_t n)
{
    if (n >= VEC_LANES)
        _mm512_storeu_si512(to, a);
    else
        _mm256_storeu_si256((__m256i *)to, _mm512_castsi512_si256(a));
}

static inline vec vec_iota(void)
{
    return _mm512_cvtepu8_epi16(_mm256_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14,
                                                 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27,
                                                 28, 29, 30, 31));
}

/* Lane k is lane k - 1; the first is the last of what lies before. */
static inline vec vec_moved_up(vec before, vec a)
{
    return _mm512_permutex2var_epi16(before, _mm512_add_epi16(vec_iota(), vec_set1(31)), a);
}

/* Lane k is lane k + 1; the last is the first of what comes next. */
static inline vec vec_moved_down(vec a, vec next)
{
    return _mm512_permutex2var_epi16(a, _mm512_add_epi16(vec_iota(), vec_set1(1)), next);
}

static inline vec vec_mul(vec a, vec b)
{
    return _mm512_mullo_epi16(a, b);
}

static inline vec vec_dot_pairs(vec unsigned_pairs, vec signed_pairs)
{
    return _mm512_maddubs_epi16(unsigned_pairs, signed_pairs);
}

static inline vec vec_min_unsigned(vec a, vec b)
{
    return _mm512_min_epu16(a, b);
}

static inline vec vec_min_of_first(vec so_far, vec a, int32_t n)
{
    return n >= VEC_LANES ? _mm512_min_epu16(so_far, a)
                          : _mm512_mask_min_epu16(so_far, 0xffff, so_far, a);
}

static inline uint16_t vec_smallest(vec a)
{
    const __m256i half =
        _mm256_min_epu16(_mm512_castsi512_si256(a), _mm512_extracti64x4_epi64(a, 1));
    const __m128i quarter =
        _mm_min_epu16(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));

    return (uint16_t)_mm_cvtsi128_si32(_mm_minpos_epu16(quarter));
}

static inline int32_t vec_first_equal(vec a, vec b)
{
    const uint32_t mask = _mm512_cmpeq_epi16_mask(a, b);

    return mask ? __builtin_ctz(mask) : -1;
}

#include "pipeline/kernels/match_vec.h"

const struct shef_match_kernels shef_match_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512,
    .columns = columns_vec,
    .costs = costs_vec,
    .path = path_vec,
    .winner = winner_vec,
};
