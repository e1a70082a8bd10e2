/* A segment of 8 pixels at a time: AVX2. Shuffles in place of gathers, which some processors have
 * made slow on purpose. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/warp.h"

/* Positions of a segment's pixels. */
static inline __m256i positions(int32_t first, int32_t per_segment)
{
    const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i along = _mm256_mullo_epi32(_mm256_set1_epi32(per_segment), lanes);

    return _mm256_add_epi32(_mm256_set1_epi32(first), _mm256_srai_epi32(along, 3));
}

/* 14-bit weights of the two neighbours, the nearer to the origin low. */
static inline __m256i weights(__m256i q16)
{
    const __m256i far_weight =
        _mm256_and_si256(_mm256_srli_epi32(q16, 16 - SHEF_WARP_WEIGHT_BITS),
                         _mm256_set1_epi32((1 << SHEF_WARP_WEIGHT_BITS) - 1));

    return _mm256_or_si256(
        _mm256_sub_epi32(_mm256_set1_epi32(1 << SHEF_WARP_WEIGHT_BITS), far_weight),
        _mm256_slli_epi32(far_weight, 16));
}

static inline __m256i mixed(__m256i pairs, __m256i pair_weights)
{
    const __m256i half = _mm256_set1_epi32(1 << (SHEF_WARP_WEIGHT_BITS - 1));

    return _mm256_srai_epi32(_mm256_add_epi32(_mm256_madd_epi16(pairs, pair_weights), half),
                             SHEF_WARP_WEIGHT_BITS);
}

/* One source row mixed along x at 8 positions: 8 columns from each half's first one. */
static inline __m256i mixed_row(const int16_t *low_half, const int16_t *high_half, __m256i shuffle,
                                __m256i x_weights)
{
    const __m128i low = _mm_loadu_si128((const __m128i *)(const void *)low_half);
    const __m128i high = _mm_loadu_si128((const __m128i *)(const void *)high_half);
    const __m256i both = _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);

    return mixed(_mm256_shuffle_epi8(both, shuffle), x_weights);
}

static inline void simple_segment(int16_t *out_values, const struct shef_warp_segment *segment,
                                  const struct shef_warp_source *source)
{
    const __m256i x_q16 = positions(segment->x_q16, segment->dx_q16);
    const __m256i y_q16 = positions(segment->y_q16, segment->dy_q16);
    const __m256i x = _mm256_srai_epi32(x_q16, 16);
    const __m256i x_weights = weights(x_q16);
    /* Each half counts its columns from its own first pixel. Four bytes fetch two columns. */
    const __m256i column = _mm256_sub_epi32(x, _mm256_shuffle_epi32(x, 0));
    const __m256i first_byte =
        _mm256_shuffle_epi8(_mm256_add_epi32(column, column),
                            _mm256_setr_epi8(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12, 0,
                                             0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12));
    const __m256i shuffle = _mm256_add_epi32(first_byte, _mm256_set1_epi32(0x03020100));
    const int32_t low_x = segment->x_q16 >> 16;
    const int32_t high_x = (segment->x_q16 + (segment->dx_q16 * 4 >> 3)) >> 16;
    const int32_t y_first = segment->y_q16 >> 16;
    const int32_t y_last = (segment->y_q16 + (segment->dy_q16 * 7 >> 3)) >> 16;
    const int32_t y_low = y_first < y_last ? y_first : y_last;
    const int16_t *row = source->pixels + y_low * source->stride;
    __m256i upper = mixed_row(row + low_x, row + high_x, shuffle, x_weights);

    row += source->stride;

    __m256i lower = mixed_row(row + low_x, row + high_x, shuffle, x_weights);

    if (y_first != y_last) {
        /* Some pixels lie one row further down. */
        const __m256i is_low =
            _mm256_cmpeq_epi32(_mm256_srai_epi32(y_q16, 16), _mm256_set1_epi32(y_low));

        row += source->stride;
        upper = _mm256_blendv_epi8(lower, upper, is_low);
        lower = _mm256_blendv_epi8(mixed_row(row + low_x, row + high_x, shuffle, x_weights), lower,
                                   is_low);
    }

    const __m256i pairs = _mm256_blend_epi16(upper, _mm256_slli_epi32(lower, 16), 0xaa);
    const __m256i values = mixed(pairs, weights(y_q16));
    const __m256i packed = _mm256_permute4x64_epi64(_mm256_packs_epi32(values, values), 0x08);

    _mm_storeu_si128((__m128i *)(void *)out_values, _mm256_castsi256_si128(packed));
}

static void row_avx2(int16_t *out_values, const struct shef_warp_node *nodes,
                     const struct shef_warp_node *offsets, int32_t n_segments,
                     const struct shef_warp_source *source)
{
    for (int32_t s = 0; s < n_segments; s++) {
        /* A loop without calls keeps its constants in registers. */
        for (; s < n_segments; s++) {
            const struct shef_warp_segment segment = shef_warp_segment_at(nodes, offsets, s);

            if (!shef_warp_is_simple(&segment, source))
                break;
            simple_segment(out_values + s * SHEF_WARP_SEGMENT_PX, &segment, source);
        }
        if (s < n_segments)
            shef_warp_kernel_c.row(out_values + s * SHEF_WARP_SEGMENT_PX, nodes + s,
                                   offsets + s / 2, 1, source);
    }
}

const struct shef_warp_kernel shef_warp_kernel_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .row = row_avx2,
};
