/* Two segments, 16 pixels, at a time: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/warp.h"

#define WINDOW_COLUMNS 32 /* one vector of source pixels */

/* Positions of two segments' pixels. */
static inline __m512i positions(int32_t first, int32_t per_segment, int32_t second_first,
                                int32_t second_per_segment)
{
    const __mmask16 second = 0xff00;
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7);
    const __m512i start = _mm512_mask_set1_epi32(_mm512_set1_epi32(first), second, second_first);
    const __m512i step =
        _mm512_mask_set1_epi32(_mm512_set1_epi32(per_segment), second, second_per_segment);

    return _mm512_add_epi32(start, _mm512_srai_epi32(_mm512_mullo_epi32(step, lanes), 3));
}

/* 14-bit weights of the two neighbours, the nearer to the origin low. */
static inline __m512i weights(__m512i q16)
{
    const __m512i far_weight =
        _mm512_and_si512(_mm512_srli_epi32(q16, 16 - SHEF_WARP_WEIGHT_BITS),
                         _mm512_set1_epi32((1 << SHEF_WARP_WEIGHT_BITS) - 1));

    return _mm512_or_si512(
        _mm512_sub_epi32(_mm512_set1_epi32(1 << SHEF_WARP_WEIGHT_BITS), far_weight),
        _mm512_slli_epi32(far_weight, 16));
}

static inline __m512i mixed(__m512i pairs, __m512i pair_weights)
{
    const __m512i half = _mm512_set1_epi32(1 << (SHEF_WARP_WEIGHT_BITS - 1));

    return _mm512_srai_epi32(_mm512_add_epi32(_mm512_madd_epi16(pairs, pair_weights), half),
                             SHEF_WARP_WEIGHT_BITS);
}

static inline __m512i mixed_row(const int16_t *window, __m512i columns, __m512i x_weights)
{
    return mixed(_mm512_permutexvar_epi16(columns, _mm512_loadu_si512(window)), x_weights);
}

/* Whether both are simple and share one window of columns and three rows. */
static inline int are_simple(const struct shef_warp_segment *a, const struct shef_warp_segment *b,
                             const struct shef_warp_source *source)
{
    const int32_t x_first = a->x_q16 >> 16;
    const int32_t x_last = (b->x_q16 + (b->dx_q16 * 7 >> 3)) >> 16;
    const int32_t y_first = a->y_q16 >> 16;
    const int32_t y_last = (b->y_q16 + (b->dy_q16 * 7 >> 3)) >> 16;
    const int32_t y_inner = (a->y_q16 + (a->dy_q16 * 7 >> 3)) >> 16;
    const int32_t apart = y_last - y_first;
    const int32_t inner = y_inner - y_first;

    return shef_warp_is_simple(a, source) && shef_warp_is_simple(b, source) &&
           b->x_q16 >> 16 >= x_first && x_last - x_first < WINDOW_COLUMNS - 1 &&
           (inner == 0 || inner == apart) && apart >= -1 && apart <= 1 &&
           (b->y_q16 >> 16 == y_first || b->y_q16 >> 16 == y_last);
}

static inline void simple_segments(int16_t *out_values, const struct shef_warp_segment *a,
                                   const struct shef_warp_segment *b,
                                   const struct shef_warp_source *source)
{
    const __m512i x_q16 = positions(a->x_q16, a->dx_q16, b->x_q16, b->dx_q16);
    const __m512i y_q16 = positions(a->y_q16, a->dy_q16, b->y_q16, b->dy_q16);
    const __m512i x_weights = weights(x_q16);
    const int32_t x_first = a->x_q16 >> 16;
    const int32_t y_first = a->y_q16 >> 16;
    const int32_t y_last = (b->y_q16 + (b->dy_q16 * 7 >> 3)) >> 16;
    const int32_t y_low = y_first < y_last ? y_first : y_last;
    const __m512i column =
        _mm512_sub_epi32(_mm512_srai_epi32(x_q16, 16), _mm512_set1_epi32(x_first));
    const __m512i columns = _mm512_add_epi32(_mm512_or_si512(column, _mm512_slli_epi32(column, 16)),
                                             _mm512_set1_epi32(1 << 16));
    const int16_t *window = source->pixels + y_low * source->stride + x_first;
    __m512i upper = mixed_row(window, columns, x_weights);
    __m512i lower = mixed_row(window + source->stride, columns, x_weights);

    if (y_first != y_last) {
        /* Some pixels lie one row further down. */
        const __mmask16 is_low =
            _mm512_cmpeq_epi32_mask(_mm512_srai_epi32(y_q16, 16), _mm512_set1_epi32(y_low));

        upper = _mm512_mask_blend_epi32(is_low, lower, upper);
        lower = _mm512_mask_blend_epi32(
            is_low, mixed_row(window + 2 * source->stride, columns, x_weights), lower);
    }

    const __m512i pairs = _mm512_mask_blend_epi16(0xaaaaaaaa, upper, _mm512_slli_epi32(lower, 16));

    _mm256_storeu_si256((__m256i *)(void *)out_values,
                        _mm512_cvtepi32_epi16(mixed(pairs, weights(y_q16))));
}

static void row_avx512(int16_t *out_values, const struct shef_warp_node *nodes,
                       const struct shef_warp_node *offsets, int32_t n_segments,
                       const struct shef_warp_source *source)
{
    for (int32_t s = 0; s < n_segments; s += 2) {
        /* A loop without calls keeps its constants in registers. */
        for (; s + 1 < n_segments; s += 2) {
            const struct shef_warp_segment a = shef_warp_segment_at(nodes, offsets, s);
            const struct shef_warp_segment b = shef_warp_segment_at(nodes, offsets, s + 1);

            if (!are_simple(&a, &b, source))
                break;
            simple_segments(out_values + s * SHEF_WARP_SEGMENT_PX, &a, &b, source);
        }
        if (s < n_segments)
            shef_warp_kernel_avx2.row(out_values + s * SHEF_WARP_SEGMENT_PX, nodes + s,
                                      offsets + s / 2, n_segments - s < 2 ? 1 : 2, source);
    }
}

const struct shef_warp_kernel shef_warp_kernel_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .row = row_avx512,
};
