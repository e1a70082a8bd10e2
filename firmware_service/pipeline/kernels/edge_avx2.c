/* 16 lanes: AVX2. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_avx2.h"

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    _mm256_storeu_si256((__m256i *)(void *)to,
                        _mm256_permute4x64_epi64(_mm256_packs_epi16(a, b), 0xd8));
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

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
