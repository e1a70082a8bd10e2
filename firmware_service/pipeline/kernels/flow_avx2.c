/* 16 values at a time: AVX2. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_avx2.h"

typedef __m256i wide;

static inline vec vec_cell_sums(const int8_t *upper, const int8_t *lower)
{
    const __m256i ones = _mm256_set1_epi8(1);
    const __m256i above = _mm256_loadu_si256((const __m256i *)(const void *)upper);
    const __m256i below = _mm256_loadu_si256((const __m256i *)(const void *)lower);

    return _mm256_add_epi16(_mm256_maddubs_epi16(ones, above), _mm256_maddubs_epi16(ones, below));
}

static inline wide wide_zero(void)
{
    return _mm256_setzero_si256();
}

static inline wide wide_add_products(wide sums, vec a, vec b)
{
    return _mm256_add_epi32(sums, _mm256_madd_epi16(a, b));
}

static inline void wide_totals(int32_t out[3], wide a, wide b, wide c)
{
    const __m256i ab = _mm256_hadd_epi32(a, b);
    const __m256i cc = _mm256_hadd_epi32(c, c);
    const __m256i all = _mm256_hadd_epi32(ab, cc);
    const __m128i totals =
        _mm_add_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));

    out[0] = _mm_cvtsi128_si32(totals);
    out[1] = _mm_extract_epi32(totals, 1);
    out[2] = _mm_extract_epi32(totals, 2);
}

#include "pipeline/kernels/flow_vec.h"

const struct shef_flow_kernels shef_flow_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .halve = halve_vec,
    .shrink = shrink_vec,
    .correlate = correlate_vec,
    .measure = measure_vec,
};
