/* 32 lanes: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_avx512.h"

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    _mm256_storeu_si256((__m256i *)(void *)to, _mm512_cvtepi16_epi8(a));
    _mm256_storeu_si256((__m256i *)(void *)(to + VEC_LANES), _mm512_cvtepi16_epi8(b));
}

/* One more in the lanes selected. */
static inline vec vec_count(vec counts, vec_select which)
{
    return _mm512_mask_add_epi16(counts, which, counts, _mm512_set1_epi16(1));
}

/* The sum of unsigned lanes. */
static inline uint32_t vec_total(vec counts)
{
    const __m512i low = _mm512_and_si512(counts, _mm512_set1_epi32(0xffff));

    return (uint32_t)_mm512_reduce_add_epi32(_mm512_add_epi32(low, _mm512_srli_epi32(counts, 16)));
}

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
