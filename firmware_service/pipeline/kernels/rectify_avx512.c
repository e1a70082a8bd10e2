/* Two segments of 8 pixels at a time: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/rectify.h"

#define ONE         (1 << SHEF_RECTIFY_FRACTION_BITS)
#define FINAL_SHIFT (2 + 2 * SHEF_RECTIFY_FRACTION_BITS - SHEF_RECTIFY_MIDDLE_SHIFT)

static void sum_cells_avx512(uint16_t *out_cells, const uint8_t *upper, const uint8_t *lower,
                             int32_t n)
{
    const __m512i ones = _mm512_set1_epi8(1);
    int32_t i = 0;

    for (; i + 32 <= n; i += 32)
        _mm512_storeu_si512(
            out_cells + i,
            _mm512_add_epi16(_mm512_maddubs_epi16(_mm512_loadu_si512(upper + 2 * i), ones),
                             _mm512_maddubs_epi16(_mm512_loadu_si512(lower + 2 * i), ones)));
    shef_rectify_kernels_c.sum_cells(out_cells + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void widen_avx512(uint16_t *out_cells, const uint8_t *pixels, int32_t n)
{
    int32_t i = 0;

    for (; i + 32 <= n; i += 32) {
        const __m256i bytes = _mm256_loadu_si256((const __m256i *)(const void *)(pixels + i));

        _mm512_storeu_si512(out_cells + i, _mm512_slli_epi16(_mm512_cvtepu8_epi16(bytes), 2));
    }
    shef_rectify_kernels_c.widen(out_cells + i, pixels + i, n - i);
}

/* 12-bit weights of the two neighbours, the first one low. */
static inline __m512i weights(__m512i fractions)
{
    return _mm512_add_epi32(_mm512_sub_epi32(_mm512_slli_epi32(fractions, 16), fractions),
                            _mm512_set1_epi32(ONE));
}

static inline __m128i load_half(const void *from)
{
    return _mm_loadu_si128((const __m128i *)from);
}

/* The entries of two segments' tables. */
static inline __m512i entries(const uint16_t *first, const uint16_t *second)
{
    return _mm512_cvtepu16_epi32(
        _mm256_inserti128_si256(_mm256_castsi128_si256(load_half(first)), load_half(second), 1));
}

/* One row of cells of each segment mixed along x at 16 positions: 8 columns for each half. */
static inline __m512i mixed_row(const uint16_t *const *row0, const uint16_t *const *row1,
                                const struct shef_rectify_segment *segments, int32_t further,
                                __m512i shuffle, __m512i x_weights)
{
    const int16_t *x0 = segments[0].at.first_x;
    const int16_t *x1 = segments[1].at.first_x;
    const __m256i first =
        _mm256_inserti128_si256(_mm256_castsi128_si256(load_half(row0[further] + x0[0])),
                                load_half(row0[further] + x0[1]), 1);
    const __m256i second =
        _mm256_inserti128_si256(_mm256_castsi128_si256(load_half(row1[further] + x1[0])),
                                load_half(row1[further] + x1[1]), 1);
    const __m512i both = _mm512_inserti64x4(_mm512_castsi256_si512(first), second, 1);

    return _mm512_madd_epi16(_mm512_shuffle_epi8(both, shuffle), x_weights);
}

/* Sixteen pixels, one in each 32-bit lane. */
static inline __m512i pair_pixels(const struct shef_rectify_segment *segments,
                                  const uint16_t *const *rows)
{
    const __m512i fraction_mask = _mm512_set1_epi32(ONE - 1);
    const __m512i x = entries(segments[0].x, segments[1].x);
    const __m512i y = entries(segments[0].y, segments[1].y);
    const __m512i x_weights = weights(_mm512_and_si512(x, fraction_mask));
    /* Four bytes fetch two columns. */
    const __m512i columns = _mm512_srli_epi32(x, SHEF_RECTIFY_FRACTION_BITS);
    const __m512i shuffle = _mm512_add_epi32(
        _mm512_mullo_epi32(columns, _mm512_set1_epi32(0x02020202)), _mm512_set1_epi32(0x03020100));
    const uint16_t *const *row0 = rows + segments[0].first_y;
    const uint16_t *const *row1 = rows + segments[1].first_y;
    __m512i upper = mixed_row(row0, row1, segments, 0, shuffle, x_weights);
    __m512i lower = mixed_row(row0, row1, segments, 1, shuffle, x_weights);

    if (segments[0].form == SHEF_RECTIFY_THREE_ROWS ||
        segments[1].form == SHEF_RECTIFY_THREE_ROWS) {
        const __mmask16 is_further = _mm512_cmpgt_epi32_mask(y, fraction_mask);

        upper = _mm512_mask_blend_epi32(is_further, upper, lower);
        lower = _mm512_mask_blend_epi32(is_further, lower,
                                        mixed_row(row0, row1, segments, 2, shuffle, x_weights));
    }

    const __m512i pairs =
        _mm512_mask_blend_epi16(0xaaaaaaaa, _mm512_srli_epi32(upper, SHEF_RECTIFY_MIDDLE_SHIFT),
                                _mm512_slli_epi32(lower, 16 - SHEF_RECTIFY_MIDDLE_SHIFT));
    const __m512i mix = _mm512_madd_epi16(pairs, weights(_mm512_and_si512(y, fraction_mask)));

    return _mm512_srli_epi32(_mm512_add_epi32(mix, _mm512_set1_epi32(1 << (FINAL_SHIFT - 1))),
                             FINAL_SHIFT);
}

static void row_avx512(uint8_t *out_pixels, const struct shef_rectify_segment *segments,
                       int32_t n_segments, const uint16_t *const *rows,
                       const struct shef_rectify_position *scattered)
{
    for (int32_t s = 0; s < n_segments; s++) {
        for (; s + 2 <= n_segments && segments[s].form != SHEF_RECTIFY_SCATTERED &&
               segments[s + 1].form != SHEF_RECTIFY_SCATTERED;
             s += 2)
            _mm_storeu_si128((__m128i *)(void *)(out_pixels + s * SHEF_RECTIFY_SEGMENT_PX),
                             _mm512_cvtepi32_epi8(pair_pixels(segments + s, rows)));
        if (s < n_segments)
            shef_rectify_kernels_c.row(out_pixels + s * SHEF_RECTIFY_SEGMENT_PX, segments + s, 1,
                                       rows, scattered);
    }
}

const struct shef_rectify_kernels shef_rectify_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .sum_cells = sum_cells_avx512,
    .widen = widen_avx512,
    .row = row_avx512,
};
