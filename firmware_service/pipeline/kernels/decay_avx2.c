/* 8 cells at a time: AVX2. */
#include <immintrin.h>
#include "core/cpu.h"
#include "pipeline/kernels/decay.h"
#include "pipeline/kernels/vec_avx2.h"

typedef __m256 vec_f;
typedef __m256i vec_i;

/* Lanes come in the order 0 1 4 5 2 3 6 7. */
static inline void vec_load_cells(const struct shef_decay_cell *cells, vec_i *level, vec_i *t_us)
{
    const __m256 low = _mm256_loadu_ps((const float *)(const void *)cells);
    const __m256 high = _mm256_loadu_ps((const float *)(const void *)(cells + 4));

    *level = _mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88));
    *t_us = _mm256_castps_si256(_mm256_shuffle_ps(low, high, 0xdd));
}

static inline void vec_store_values(int16_t *to, vec_i first, vec_i second)
{
    /* In pairs of values: 0 2 4 6 | 1 3 5 7. */
    const __m256i pairs = _mm256_permutevar8x32_epi32(_mm256_packs_epi32(first, second),
                                                      _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));

    _mm256_storeu_si256((__m256i *)(void *)to,
                        _mm256_max_epi16(pairs, _mm256_set1_epi16(-SHEF_DECAY_MAX_VALUE)));
}

static inline vec_i vec_set_i(int32_t value)
{
    return _mm256_set1_epi32(value);
}

static inline vec_i vec_sub_i(vec_i a, vec_i b)
{
    return _mm256_sub_epi32(a, b);
}

static inline vec_i vec_min_i(vec_i a, vec_i b)
{
    return _mm256_min_epi32(a, b);
}

static inline vec_i vec_max_i(vec_i a, vec_i b)
{
    return _mm256_max_epi32(a, b);
}

static inline vec_i vec_shift_left_i(vec_i a, int bits)
{
    return _mm256_slli_epi32(a, bits);
}

static inline vec_i vec_truncate(vec_f a)
{
    return _mm256_cvttps_epi32(a);
}

static inline vec_i vec_round(vec_f a)
{
    return _mm256_cvtps_epi32(a);
}

static inline vec_f vec_to_f(vec_i a)
{
    return _mm256_cvtepi32_ps(a);
}

static inline vec_f vec_as_f(vec_i a)
{
    return _mm256_castsi256_ps(a);
}

static inline vec_f vec_set_f(float value)
{
    return _mm256_set1_ps(value);
}

static inline vec_f vec_add_f(vec_f a, vec_f b)
{
    return _mm256_add_ps(a, b);
}

static inline vec_f vec_sub_f(vec_f a, vec_f b)
{
    return _mm256_sub_ps(a, b);
}

static inline vec_f vec_mul_f(vec_f a, vec_f b)
{
    return _mm256_mul_ps(a, b);
}

static inline vec vec_add_saturated(vec a, vec b)
{
    return _mm256_adds_epi16(a, b);
}

#include "pipeline/kernels/decay_vec.h"

const struct shef_decay_kernels shef_decay_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .row = row_vec,
    .accrue = accrue_vec,
};
