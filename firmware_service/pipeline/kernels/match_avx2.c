/* 16 lanes: AVX2. */
#include <immintrin.h>
#include "core/cpu.h"
#include "pipeline/kernels/vec_avx2.h"

static inline vec vec_load_first(const void *from, int32_t n)
{
    (void)n;
    return _mm256_loadu_si256((const __m256i *)from);
}

static inline vec vec_load_filled(const void *from, int32_t n, vec fill)
{
    (void)fill;
    return vec_load_first(from, n);
}

static inline void vec_store_first(void *to, vec a, int32_t n)
{
    (void)n;
    _mm256_storeu_si256((__m256i *)to, a);
}

static inline vec vec_iota(void)
{
    return _mm256_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

/* Lane k is lane k - 1; the first is the last of what lies before. */
static inline vec vec_moved_up(vec before, vec a)
{
    return _mm256_alignr_epi8(a, _mm256_permute2x128_si256(before, a, 0x21), 14);
}

/* Lane k is lane k + 1; the last is the first of what comes next. */
static inline vec vec_moved_down(vec a, vec next)
{
    return _mm256_alignr_epi8(_mm256_permute2x128_si256(a, next, 0x21), a, 2);
}

static inline vec vec_mul(vec a, vec b)
{
    return _mm256_mullo_epi16(a, b);
}

static inline vec vec_dot_pairs(vec unsigned_pairs, vec signed_pairs)
{
    return _mm256_maddubs_epi16(unsigned_pairs, signed_pairs);
}

static inline vec vec_min_unsigned(vec a, vec b)
{
    return _mm256_min_epu16(a, b);
}

static inline vec vec_min_of_first(vec so_far, vec a, int32_t n)
{
    (void)n;
    return _mm256_min_epu16(so_far, a);
}

static inline uint16_t vec_smallest(vec a)
{
    const __m128i half = _mm_min_epu16(_mm256_castsi256_si128(a), _mm256_extracti128_si256(a, 1));

    return (uint16_t)_mm_cvtsi128_si32(_mm_minpos_epu16(half));
}

static inline int32_t vec_first_equal(vec a, vec b)
{
    const unsigned mask = (unsigned)_mm256_movemask_epi8(_mm256_cmpeq_epi16(a, b));

    return mask ? __builtin_ctz(mask) / 2 : -1;
}

#include "pipeline/kernels/match_vec.h"

const struct shef_match_kernels shef_match_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .columns = columns_vec,
    .costs = costs_vec,
    .path = path_vec,
    .winner = winner_vec,
};
