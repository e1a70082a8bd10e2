/* 16 rays at a time: AVX-512 F. */
#include <immintrin.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/cpu.h"

#define LANES 16
typedef __m512 real;
typedef __m512i whole;
typedef __mmask16 mask;

static inline real r_set(float value)
{
    return _mm512_set1_ps(value);
}

static inline real r_load(const float *from)
{
    return _mm512_loadu_ps(from);
}

static inline void r_store(float *to, real a)
{
    _mm512_storeu_ps(to, a);
}

static inline real r_sqrt(real a)
{
    return _mm512_sqrt_ps(a);
}

static inline mask r_less(real a, real b)
{
    return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
}

static inline real r_pick(mask m, real a, real b)
{
    return _mm512_mask_blend_ps(m, b, a);
}

static inline real r_from(whole a)
{
    return _mm512_cvtepi32_ps(a);
}

static inline real r_byte0(whole a)
{
    return r_from(_mm512_and_si512(a, _mm512_set1_epi32(255)));
}

static inline real r_byte1(whole a)
{
    return r_from(_mm512_and_si512(_mm512_srli_epi32(a, 8), _mm512_set1_epi32(255)));
}

static inline real r_byte2(whole a)
{
    return r_from(_mm512_and_si512(_mm512_srli_epi32(a, 16), _mm512_set1_epi32(255)));
}

static inline real r_byte3(whole a)
{
    return r_from(_mm512_srli_epi32(a, 24));
}

static inline whole w_set(int32_t value)
{
    return _mm512_set1_epi32(value);
}

static inline void w_store(int32_t *to, whole a)
{
    _mm512_storeu_si512(to, a);
}

/* Towards zero; within the range of int32. */
static inline whole w_truncate(real a)
{
    return _mm512_cvttps_epi32(a);
}

static inline whole w_least(whole a, whole b)
{
    return _mm512_min_epi32(a, b);
}

static inline whole w_pick(mask m, whole a, whole b)
{
    return _mm512_mask_blend_epi32(m, b, a);
}

/* row * pitch + column */
static inline whole w_at(whole row, int32_t pitch, whole column)
{
    return _mm512_add_epi32(_mm512_mullo_epi32(row, w_set(pitch)), column);
}

/* from[index] in the lower half, from[index + 1] in the upper one */
static inline whole w_gather(const uint16_t *from, whole index)
{
    return _mm512_i32gather_epi32(index, from, 2);
}

static inline mask m_and(mask a, mask b)
{
    return (mask)(a & b);
}

static inline mask m_or(mask a, mask b)
{
    return (mask)(a | b);
}

static inline bool m_any(mask a)
{
    return a != 0;
}

#include "shefsim/kernels/trace_body.h"

const struct sim_trace_kernels sim_trace_kernels_avx512 = { "avx512", SHEF_CPU_AVX512, light,
                                                            depth };
