#include <immintrin.h>

#include "pipeline/kernels/outlier_count.h"

#define N_VECTORS (SHEF_OUTLIER_COUNT_PX / 8)

/* Four vectors of 32-bit counts to 32 words in order. */
static inline void store_words(const __m256i counts[N_VECTORS], int16_t *out)
{
    for (int i = 0; i < N_VECTORS / 2; i++) {
        const __m256i packed = _mm256_packs_epi32(counts[2 * i], counts[2 * i + 1]);

        _mm256_store_si256((__m256i *)(out + 16 * i), _mm256_permute4x64_epi64(packed, 0xd8));
    }
}

void shef_outlier_count_avx2(const float *first, ptrdiff_t step, int32_t n_samples,
                             const float low[SHEF_OUTLIER_COUNT_PX],
                             const float high[SHEF_OUTLIER_COUNT_PX],
                             int16_t out_below[SHEF_OUTLIER_COUNT_PX],
                             int16_t out_above[SHEF_OUTLIER_COUNT_PX])
{
    __m256i below[N_VECTORS];
    __m256i above[N_VECTORS];

    for (int i = 0; i < N_VECTORS; i++)
        below[i] = above[i] = _mm256_setzero_si256();
    for (int32_t j = 0; j < n_samples; j++)
        for (int i = 0; i < N_VECTORS; i++) {
            const __m256 sample = _mm256_loadu_ps(first + j * step + 8 * i);
            const __m256 is_below = _mm256_cmp_ps(sample, _mm256_load_ps(low + 8 * i), _CMP_LT_OQ);
            const __m256 is_above = _mm256_cmp_ps(sample, _mm256_load_ps(high + 8 * i), _CMP_GT_OQ);

            /* A true comparison is -1. */
            below[i] = _mm256_sub_epi32(below[i], _mm256_castps_si256(is_below));
            above[i] = _mm256_sub_epi32(above[i], _mm256_castps_si256(is_above));
        }
    store_words(below, out_below);
    store_words(above, out_above);
}
