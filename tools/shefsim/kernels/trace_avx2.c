/* 8 rays at a time: AVX2. */
#include <immintrin.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/cpu.h"

#define LANES 8
typedef __m256 real;
typedef __m256i whole;
typedef __m256 mask;

static inline real r_set(float value)
{
    return _mm256_set1_ps(value);
}

static inline real r_load(const float *from)
{
    return _mm256_loadu_ps(from);
}

static inline void r_store(float *to, real a)
{
    _mm256_storeu_ps(to, a);
}

static inline real r_sqrt(real a)
{
    return _mm256_sqrt_ps(a);
}

static inline mask r_less(real a, real b)
{
    return _mm256_cmp_ps(a, b, _CMP_LT_OQ);
}

static inline real r_pick(mask m, real a, real b)
{
    return _mm256_blendv_ps(b, a, m);
}

static inline real r_from(whole a)
{
    return _mm256_cvtepi32_ps(a);
}

static inline real r_byte0(whole a)
{
    return r_from(_mm256_and_si256(a, _mm256_set1_epi32(255)));
}

static inline real r_byte1(whole a)
{
    return r_from(_mm256_and_si256(_mm256_srli_epi32(a, 8), _mm256_set1_epi32(255)));
}

static inline real r_byte2(whole a)
{
    return r_from(_mm256_and_si256(_mm256_srli_epi32(a, 16), _mm256_set1_epi32(255)));
}

static inline real r_byte3(whole a)
{
    return r_from(_mm256_srli_epi32(a, 24));
}

static inline whole w_set(int32_t value)
{
    return _mm256_set1_epi32(value);
}

static inline void w_store(int32_t *to, whole a)
{
    _mm256_storeu_si256((__m256i *)to, a);
}

/* Towards zero; within the range of int32. */
static inline whole w_truncate(real a)
{
    return _mm256_cvttps_epi32(a);
}

static inline whole w_least(whole a, whole b)
{
    return _mm256_min_epi32(a, b);
}

static inline whole w_pick(mask m, whole a, whole b)
{
    return _mm256_blendv_epi8(b, a, _mm256_castps_si256(m));
}

/* row * pitch + column */
static inline whole w_at(whole row, int32_t pitch, whole column)
{
    return _mm256_add_epi32(_mm256_mullo_epi32(row, w_set(pitch)), column);
}

/* from[index] in the lower half, from[index + 1] in the upper one */
static inline whole w_gather(const uint16_t *from, whole index)
{
    return _mm256_i32gather_epi32((const int *)(const void *)from, index, 2);
}

static inline mask m_and(mask a, mask b)
{
    return _mm256_and_ps(a, b);
}

static inline mask m_or(mask a, mask b)
{
    return _mm256_or_ps(a, b);
}

static inline bool m_any(mask a)
{
    return _mm256_movemask_ps(a) != 0;
}

#include "shefsim/kernels/trace_body.h"

const struct sim_trace_kernels sim_trace_kernels_avx2 = { "avx2", SHEF_CPU_AVX2, light, depth };
