/* 16 values at a time: AVX2. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/flow.h"

static inline __m256i load(const void *from)
{
    return _mm256_loadu_si256((const __m256i *)from);
}

static inline void store(int16_t *to, __m256i values)
{
    _mm256_storeu_si256((__m256i *)(void *)to, values);
}

static void halve_avx2(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n)
{
    const __m256i ones = _mm256_set1_epi8(1);
    int32_t i = 0;

    for (; i + 16 <= n; i += 16)
        store(out + i, _mm256_add_epi16(_mm256_maddubs_epi16(ones, load(upper + 2 * i)),
                                        _mm256_maddubs_epi16(ones, load(lower + 2 * i))));
    shef_flow_kernels_c.halve(out + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void shrink_avx2(int16_t *out, const int16_t *slopes, int32_t n)
{
    int32_t i = 0;

    for (; i + 16 <= n; i += 16)
        store(out + i, _mm256_srai_epi16(load(slopes + i), 5));
    shef_flow_kernels_c.shrink(out + i, slopes + i, n - i);
}

static inline __m256i add_product(__m256i sums, __m256i a, __m256i b)
{
    return _mm256_add_epi32(sums, _mm256_madd_epi16(a, b));
}

/* The totals of three vectors in the first three lanes. */
static inline __m128i totals(__m256i a, __m256i b, __m256i c)
{
    const __m256i ab = _mm256_hadd_epi32(a, b);
    const __m256i cc = _mm256_hadd_epi32(c, c);
    const __m256i all = _mm256_hadd_epi32(ab, cc);

    return _mm_add_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
}

static struct shef_flow_sums correlate_avx2(const int16_t *events, const int16_t *gx,
                                            const int16_t *gy, ptrdiff_t stride)
{
    __m256i ex = _mm256_setzero_si256();
    __m256i ey = _mm256_setzero_si256();
    __m256i ee = _mm256_setzero_si256();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, events += stride, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += 16) {
            const __m256i e = load(events + x);

            ex = add_product(ex, e, load(gx + x));
            ey = add_product(ey, e, load(gy + x));
            ee = add_product(ee, e, e);
        }

    const __m128i sums = totals(ex, ey, ee);

    return (struct shef_flow_sums){
        _mm_cvtsi128_si32(sums),
        _mm_extract_epi32(sums, 1),
        _mm_extract_epi32(sums, 2),
    };
}

static struct shef_flow_slope_sums measure_avx2(const int16_t *gx, const int16_t *gy,
                                                ptrdiff_t stride)
{
    __m256i xx = _mm256_setzero_si256();
    __m256i xy = _mm256_setzero_si256();
    __m256i yy = _mm256_setzero_si256();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += 16) {
            const __m256i slope_x = load(gx + x);
            const __m256i slope_y = load(gy + x);

            xx = add_product(xx, slope_x, slope_x);
            xy = add_product(xy, slope_x, slope_y);
            yy = add_product(yy, slope_y, slope_y);
        }

    const __m128i sums = totals(xx, xy, yy);

    return (struct shef_flow_slope_sums){
        _mm_cvtsi128_si32(sums),
        _mm_extract_epi32(sums, 1),
        _mm_extract_epi32(sums, 2),
    };
}

const struct shef_flow_kernels shef_flow_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .halve = halve_avx2,
    .shrink = shrink_avx2,
    .correlate = correlate_avx2,
    .measure = measure_avx2,
};
