/* 32 values at a time, a block's whole row: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/flow.h"

static void halve_avx512(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n)
{
    const __m512i ones = _mm512_set1_epi8(1);
    int32_t i = 0;

    for (; i + 32 <= n; i += 32)
        _mm512_storeu_si512(
            out + i,
            _mm512_add_epi16(_mm512_maddubs_epi16(ones, _mm512_loadu_si512(upper + 2 * i)),
                             _mm512_maddubs_epi16(ones, _mm512_loadu_si512(lower + 2 * i))));
    shef_flow_kernels_c.halve(out + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void shrink_avx512(int16_t *out, const int16_t *slopes, int32_t n)
{
    int32_t i = 0;

    for (; i + 32 <= n; i += 32)
        _mm512_storeu_si512(out + i, _mm512_srai_epi16(_mm512_loadu_si512(slopes + i), 5));
    shef_flow_kernels_c.shrink(out + i, slopes + i, n - i);
}

static inline __m512i add_product(__m512i sums, __m512i a, __m512i b)
{
    return _mm512_add_epi32(sums, _mm512_madd_epi16(a, b));
}

static struct shef_flow_sums correlate_avx512(const int16_t *events, const int16_t *gx,
                                              const int16_t *gy, ptrdiff_t stride)
{
    __m512i ex = _mm512_setzero_si512();
    __m512i ey = _mm512_setzero_si512();
    __m512i ee = _mm512_setzero_si512();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, events += stride, gx += stride, gy += stride) {
        const __m512i e = _mm512_loadu_si512(events);

        ex = add_product(ex, e, _mm512_loadu_si512(gx));
        ey = add_product(ey, e, _mm512_loadu_si512(gy));
        ee = add_product(ee, e, e);
    }
    return (struct shef_flow_sums){
        _mm512_reduce_add_epi32(ex),
        _mm512_reduce_add_epi32(ey),
        _mm512_reduce_add_epi32(ee),
    };
}

static struct shef_flow_slope_sums measure_avx512(const int16_t *gx, const int16_t *gy,
                                                  ptrdiff_t stride)
{
    __m512i xx = _mm512_setzero_si512();
    __m512i xy = _mm512_setzero_si512();
    __m512i yy = _mm512_setzero_si512();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, gx += stride, gy += stride) {
        const __m512i slope_x = _mm512_loadu_si512(gx);
        const __m512i slope_y = _mm512_loadu_si512(gy);

        xx = add_product(xx, slope_x, slope_x);
        xy = add_product(xy, slope_x, slope_y);
        yy = add_product(yy, slope_y, slope_y);
    }
    return (struct shef_flow_slope_sums){
        _mm512_reduce_add_epi32(xx),
        _mm512_reduce_add_epi32(xy),
        _mm512_reduce_add_epi32(yy),
    };
}

const struct shef_flow_kernels shef_flow_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .halve = halve_avx512,
    .shrink = shrink_avx512,
    .correlate = correlate_avx512,
    .measure = measure_avx512,
};
