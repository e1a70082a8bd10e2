/* 16 cells at a time: AVX-512. */
#include <immintrin.h>
#include "core/cpu.h"
#include "pipeline/kernels/decay.h"
#include "pipeline/kernels/vec_avx512.h"

typedef __m512 vec_f;
typedef __m512i vec_i;

/* Within each quarter of a vector lanes come in the order 0 1 of the first eight cells' quarter,
 * then 0 1 of the second's; see vec_store_values(). */
static inline void vec_load_cells(const struct shef_decay_cell *cells, vec_i *level, vec_i *t_us)
{
    const __m512 low = _mm512_loadu_ps(cells);
    const __m512 high = _mm512_loadu_ps(cells + 8);

    *level = _mm512_castps_si512(_mm512_shuffle_ps(low, high, 0x88));
    *t_us = _mm512_castps_si512(_mm512_shuffle_ps(low, high, 0xdd));
}

static inline void vec_store_values(int16_t *to, vec_i first, vec_i second)
{
    /* In pairs of values: 0 4 8 12 | 1 5 9 13 | 2 6 10 14 | 3 7 11 15. */
    const __m512i order = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    const __m512i pairs = _mm512_permutexvar_epi32(order, _mm512_packs_epi32(first, second));

    _mm512_storeu_si512(to, _mm512_max_epi16(pairs, _mm512_set1_epi16(-SHEF_DECAY_MAX_VALUE)));
}

static inline vec_i vec_set_i(int32_t value)
{
    return _mm512_set1_epi32(value);
}

static inline vec_i vec_sub_i(vec_i a, vec_i b)
{
    return _mm512_sub_epi32(a, b);
}

static inline vec_i vec_min_i(vec_i a, vec_i b)
{
    return _mm512_min_epi32(a, b);
}

static inline vec_i vec_max_i(vec_i a, vec_i b)
{
    return _mm512_max_epi32(a, b);
}

static inline vec_i vec_shift_left_i(vec_i a, int bits)
{
    return _mm512_slli_epi32(a, bits);
}

static inline vec_i vec_truncate(vec_f a)
{
    return _mm512_cvttps_epi32(a);
}

static inline vec_i vec_round(vec_f a)
{
    return _mm512_cvtps_epi32(a);
}

static inline vec_f vec_to_f(vec_i a)
{
    return _mm512_cvtepi32_ps(a);
}

static inline vec_f vec_as_f(vec_i a)
{
    return _mm512_castsi512_ps(a);
}

static inline vec_f vec_set_f(float value)
{
    return _mm512_set1_ps(value);
}

static inline vec_f vec_add_f(vec_f a, vec_f b)
{
    return _mm512_add_ps(a, b);
}

static inline vec_f vec_sub_f(vec_f a, vec_f b)
{
    return _mm512_sub_ps(a, b);
}

static inline vec_f vec_mul_f(vec_f a, vec_f b)
{
    return _mm512_mul_ps(a, b);
}

static inline vec vec_add_saturated(vec a, vec b)
{
    return _mm512_adds_epi16(a, b);
}

#include "pipeline/kernels/decay_vec.h"

const struct shef_decay_kernels shef_decay_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512,
    .row = row_vec,
    .accrue = accrue_vec,
};
