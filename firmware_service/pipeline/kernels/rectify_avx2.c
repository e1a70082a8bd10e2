/* A segment of 8 pixels at a time: AVX2. Shuffles in place of gathers, which some processors have
 * made slow on purpose. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/rectify.h"

#define ONE         (1 << SHEF_RECTIFY_FRACTION_BITS)
#define FINAL_SHIFT (2 + 2 * SHEF_RECTIFY_FRACTION_BITS - SHEF_RECTIFY_MIDDLE_SHIFT)

static inline __m256i load(const void *from)
{
    return _mm256_loadu_si256((const __m256i *)from);
}

static void sum_cells_avx2(uint16_t *out_cells, const uint8_t *upper, const uint8_t *lower,
                           int32_t n)
{
    const __m256i ones = _mm256_set1_epi8(1);
    int32_t i = 0;

    for (; i + 16 <= n; i += 16)
        _mm256_storeu_si256((__m256i *)(void *)(out_cells + i),
                            _mm256_add_epi16(_mm256_maddubs_epi16(load(upper + 2 * i), ones),
                                             _mm256_maddubs_epi16(load(lower + 2 * i), ones)));
    shef_rectify_kernels_c.sum_cells(out_cells + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void widen_avx2(uint16_t *out_cells, const uint8_t *pixels, int32_t n)
{
    int32_t i = 0;

    for (; i + 16 <= n; i += 16) {
        const __m128i bytes = _mm_loadu_si128((const __m128i *)(const void *)(pixels + i));

        _mm256_storeu_si256((__m256i *)(void *)(out_cells + i),
                            _mm256_slli_epi16(_mm256_cvtepu8_epi16(bytes), 2));
    }
    shef_rectify_kernels_c.widen(out_cells + i, pixels + i, n - i);
}

/* 12-bit weights of the two neighbours, the first one low. */
static inline __m256i weights(__m256i fractions)
{
    return _mm256_add_epi32(_mm256_sub_epi32(_mm256_slli_epi32(fractions, 16), fractions),
                            _mm256_set1_epi32(ONE));
}

static inline __m256i entries(const uint16_t *table)
{
    return _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(const void *)table));
}

/* One row of cells mixed along x at 8 positions: 8 columns from each half's first one. */
static inline __m256i mixed_row(const uint16_t *row, const int16_t *first_x, __m256i shuffle,
                                __m256i x_weights)
{
    const __m128i *left = (const __m128i *)(const void *)(row + first_x[0]);
    const __m128i *right = (const __m128i *)(const void *)(row + first_x[1]);
    const __m256i both = _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(left)),
                                                 _mm_loadu_si128(right), 1);

    return _mm256_madd_epi16(_mm256_shuffle_epi8(both, shuffle), x_weights);
}

/* Eight pixels, one in each 32-bit lane. */
static inline __m256i segment_pixels(const struct shef_rectify_segment *segment,
                                     const uint16_t *const *rows)
{
    const __m256i fraction_mask = _mm256_set1_epi32(ONE - 1);
    const __m256i x = entries(segment->x);
    const __m256i y = entries(segment->y);
    const __m256i x_weights = weights(_mm256_and_si256(x, fraction_mask));
    /* Four bytes fetch two columns. */
    const __m256i columns = _mm256_srli_epi32(x, SHEF_RECTIFY_FRACTION_BITS);
    const __m256i shuffle = _mm256_add_epi32(
        _mm256_mullo_epi32(columns, _mm256_set1_epi32(0x02020202)), _mm256_set1_epi32(0x03020100));
    const int16_t *first_x = segment->at.first_x;
    const uint16_t *const *row = rows + segment->first_y;
    __m256i upper = mixed_row(row[0], first_x, shuffle, x_weights);
    __m256i lower = mixed_row(row[1], first_x, shuffle, x_weights);

    if (segment->form == SHEF_RECTIFY_THREE_ROWS) {
        const __m256i is_further =
            _mm256_cmpgt_epi32(y, fraction_mask); /* a whole cell, not only a fraction */

        upper = _mm256_blendv_epi8(upper, lower, is_further);
        lower =
            _mm256_blendv_epi8(lower, mixed_row(row[2], first_x, shuffle, x_weights), is_further);
    }

    const __m256i pairs =
        _mm256_blend_epi16(_mm256_srli_epi32(upper, SHEF_RECTIFY_MIDDLE_SHIFT),
                           _mm256_slli_epi32(lower, 16 - SHEF_RECTIFY_MIDDLE_SHIFT), 0xaa);
    const __m256i mix = _mm256_madd_epi16(pairs, weights(_mm256_and_si256(y, fraction_mask)));

    return _mm256_srli_epi32(_mm256_add_epi32(mix, _mm256_set1_epi32(1 << (FINAL_SHIFT - 1))),
                             FINAL_SHIFT);
}

static void row_avx2(uint8_t *out_pixels, const struct shef_rectify_segment *segments,
                     int32_t n_segments, const uint16_t *const *rows,
                     const struct shef_rectify_position *scattered)
{
    for (int32_t s = 0; s < n_segments; s++) {
        /* A loop without calls keeps its constants in registers. */
        for (; s < n_segments && segments[s].form != SHEF_RECTIFY_SCATTERED; s++) {
            const __m256i pixels = segment_pixels(segments + s, rows);
            const __m128i words = _mm_packus_epi32(_mm256_castsi256_si128(pixels),
                                                   _mm256_extracti128_si256(pixels, 1));

            _mm_storel_epi64((__m128i *)(void *)(out_pixels + s * SHEF_RECTIFY_SEGMENT_PX),
                             _mm_packus_epi16(words, words));
        }
        if (s < n_segments)
            shef_rectify_kernels_c.row(out_pixels + s * SHEF_RECTIFY_SEGMENT_PX, segments + s, 1,
                                       rows, scattered);
    }
}

const struct shef_rectify_kernels shef_rectify_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .sum_cells = sum_cells_avx2,
    .widen = widen_avx2,
    .row = row_avx2,
};
