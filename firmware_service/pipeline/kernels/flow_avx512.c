/* 32 values at a time, a block's whole row: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_avx512.h"

typedef __m512i wide;

static inline vec vec_cell_sums(const int8_t *upper, const int8_t *lower)
{
    const __m512i ones = _mm512_set1_epi8(1);

    return _mm512_add_epi16(_mm512_maddubs_epi16(ones, _mm512_loadu_si512(upper)),
                            _mm512_maddubs_epi16(ones, _mm512_loadu_si512(lower)));
}

static inline wide wide_zero(void)
{
    return _mm512_setzero_si512();
}

static inline wide wide_add_products(wide sums, vec a, vec b)
{
    return _mm512_add_epi32(sums, _mm512_madd_epi16(a, b));
}

static inline void wide_totals(int32_t out[3], wide a, wide b, wide c)
{
    out[0] = _mm512_reduce_add_epi32(a);
    out[1] = _mm512_reduce_add_epi32(b);
    out[2] = _mm512_reduce_add_epi32(c);
}

#include "pipeline/kernels/flow_vec.h"

const struct shef_flow_kernels shef_flow_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .halve = halve_vec,
    .shrink = shrink_vec,
    .correlate = correlate_vec,
    .measure = measure_vec,
};
