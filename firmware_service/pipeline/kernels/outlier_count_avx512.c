#include <immintrin.h>

#include "pipeline/kernels/outlier_count.h"

#define N_VECTORS (SHEF_OUTLIER_COUNT_PX / 16)

void shef_outlier_count_avx512(const float *first, ptrdiff_t step, int32_t n_samples,
                               const float low[SHEF_OUTLIER_COUNT_PX],
                               const float high[SHEF_OUTLIER_COUNT_PX],
                               int16_t out_below[SHEF_OUTLIER_COUNT_PX],
                               int16_t out_above[SHEF_OUTLIER_COUNT_PX])
{
    const __m512i one = _mm512_set1_epi32(1);
    __m512i below[N_VECTORS];
    __m512i above[N_VECTORS];

    for (int i = 0; i < N_VECTORS; i++)
        below[i] = above[i] = _mm512_setzero_si512();
    for (int32_t j = 0; j < n_samples; j++)
        for (int i = 0; i < N_VECTORS; i++) {
            const __m512 sample = _mm512_loadu_ps(first + j * step + 16 * i);
            const __mmask16 is_below =
                _mm512_cmp_ps_mask(sample, _mm512_load_ps(low + 16 * i), _CMP_LT_OQ);
            const __mmask16 is_above =
                _mm512_cmp_ps_mask(sample, _mm512_load_ps(high + 16 * i), _CMP_GT_OQ);

            below[i] = _mm512_mask_add_epi32(below[i], is_below, below[i], one);
            above[i] = _mm512_mask_add_epi32(above[i], is_above, above[i], one);
        }
    for (int i = 0; i < N_VECTORS; i++) {
        _mm256_store_si256((__m256i *)(out_below + 16 * i), _mm512_cvtepi32_epi16(below[i]));
        _mm256_store_si256((__m256i *)(out_above + 16 * i), _mm512_cvtepi32_epi16(above[i]));
    }
}
