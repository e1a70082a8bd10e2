/* The loops of rows.h, included once per instruction set. Selections, not branches. */

#include <math.h>

#include "core/cpu.h"
#include "pipeline/kernels/depth_sigma.h"
#include "pipeline/kernels/rows.h"

static inline __attribute__((always_inline)) void slide(const uint8_t *const entering[2],
                                                        const uint8_t *const leaving[2],
                                                        int32_t n_pairs, int32_t offset,
                                                        int16_t *restrict sum, int is_square)
{
    for (int row = 0; row < 2; row++) {
        const uint8_t *restrict in = entering[row];
        const uint8_t *restrict out = leaving[row];

        for (int32_t i = 0; i < n_pairs; i++) {
            const int16_t a = (int8_t)(in[2 * i] - offset);
            const int16_t b = (int8_t)(in[2 * i + 1] - offset);
            const int16_t c = (int8_t)(out[2 * i] - offset);
            const int16_t d = (int8_t)(out[2 * i + 1] - offset);

            sum[i] =
                (int16_t)(sum[i] + (is_square ? a * a + b * b - c * c - d * d : a + b - c - d));
        }
    }
}

static void slide_values(const uint8_t *const entering[2], const uint8_t *const leaving[2],
                         int32_t n_pairs, int32_t offset, int16_t *sum)
{
    slide(entering, leaving, n_pairs, offset, sum, 0);
}

static void slide_squares(const uint8_t *const entering[2], const uint8_t *const leaving[2],
                          int32_t n_pairs, int32_t offset, int16_t *sum)
{
    slide(entering, leaving, n_pairs, offset, sum, 1);
}

/* A window is a few columns wide: adding them all, a vector at a time, is less work than to take
 * each sum from the one before. */
static void window_sums(const int16_t *restrict column, int32_t n_columns, int32_t half_width,
                        int32_t spacing, int32_t n, int32_t *restrict out_sum)
{
    const int32_t reach = half_width * spacing;

    for (int32_t i = 0; i < n; i++)
        out_sum[i] = 0;
    for (int32_t shift = -reach; shift <= reach; shift += spacing) {
        const int32_t first = shift < 0 ? -shift : 0;
        const int32_t last = n_columns - shift < n ? n_columns - shift : n;

        for (int32_t i = first; i < last; i++)
            out_sum[i] += column[i + shift];
    }
}

static void mirror_pairs(const int8_t *restrict row, int32_t step, int32_t n,
                         uint16_t *restrict out_pairs)
{
    if (step == 1)
        for (int32_t i = 0; i < n; i++)
            out_pairs[i] = (uint16_t)((uint8_t)row[-i] | (uint8_t)row[1 - i] << 8);
    else
        for (int32_t i = 0; i < n; i++)
            out_pairs[i] = (uint16_t)((uint8_t)row[-2 * i] | (uint8_t)row[1 - 2 * i] << 8);
}

static void gains(const int32_t *restrict sum, const int32_t *restrict square, int32_t n,
                  float inverse_n, float floor2, int16_t *restrict out_gain)
{
    for (int32_t i = 0; i < n; i++) {
        const float s = (float)sum[i];
        const float raw = (float)square[i] - s * s * inverse_n;
        const float variance = raw > 0.0f ? raw : 0.0f;

        out_gain[i] = (int16_t)(int32_t)(sqrtf(floor2 / (variance + floor2)) * 32767.0f + 0.5f);
    }
}

static void side_pixels(const struct shef_cell_row *near_row, const struct shef_cell_row *far_row,
                        int32_t side, int32_t n_cells, float same_surface,
                        float *restrict out_disparity, float *restrict out_confidence)
{
    const float *const disparity[4] = { near_row->disparity, near_row->disparity + side,
                                        far_row->disparity, far_row->disparity + side };
    const float *const weight[4] = { near_row->weight, near_row->weight + side, far_row->weight,
                                     far_row->weight + side };
    const float *const confidence[4] = { near_row->confidence, near_row->confidence + side,
                                         far_row->confidence, far_row->confidence + side };

    for (int32_t x = 0; x < n_cells; x++) {
        const float w0 = 9.0f * weight[0][x];
        const float w1 = 3.0f * weight[1][x];
        const float w2 = 3.0f * weight[2][x];
        const float w3 = weight[3][x];
        const float d0 = disparity[0][x];
        const float d1 = disparity[1][x];
        const float d2 = disparity[2][x];
        const float d3 = disparity[3][x];
        const float p0 = confidence[0][x];
        const float p1 = confidence[1][x];
        const float p2 = confidence[2][x];
        const float p3 = confidence[3][x];
        const float w01 = w1 > w0 ? w1 : w0;
        const float d01 = w1 > w0 ? d1 : d0;
        const float p01 = w1 > w0 ? p1 : p0;
        const float w23 = w3 > w2 ? w3 : w2;
        const float d23 = w3 > w2 ? d3 : d2;
        const float p23 = w3 > w2 ? p3 : p2;
        const float surface = w23 > w01 ? d23 : d01;
        const float share0 = fabsf(d0 - surface) < same_surface ? w0 : 0.0f;
        const float share1 = fabsf(d1 - surface) < same_surface ? w1 : 0.0f;
        const float share2 = fabsf(d2 - surface) < same_surface ? w2 : 0.0f;
        const float share3 = fabsf(d3 - surface) < same_surface ? w3 : 0.0f;
        const float sum = share0 * d0 + share1 * d1 + share2 * d2 + share3 * d3;

        out_disparity[x] = sum / (32.0f * (share0 + share1 + share2 + share3));
        out_confidence[x] = w23 > w01 ? p23 : p01;
    }
}

static void interleave(const float *restrict even, const float *restrict odd, int32_t n,
                       float *restrict out)
{
    for (int32_t x = 0; x < n; x++) {
        out[2 * x] = even[x];
        out[2 * x + 1] = odd[x];
    }
}

static void take_off_bias(const float *restrict bias, int32_t n, float *restrict disparity,
                          float *restrict confidence)
{
    for (int32_t x = 0; x < n; x++) {
        const float d = disparity[x] - bias[x];

        disparity[x] = d > 0.0f ? d : 0.0f;
        confidence[x] = d > 0.0f ? confidence[x] : 0.0f;
    }
}

static void keep_edges(const int8_t *restrict left, const float *restrict values, int32_t n,
                       float *restrict out)
{
    for (int32_t x = 0; x < n; x++)
        out[x] = (float)(left[x] != 0) * values[x];
}

static void depth(const struct shef_depth_terms *terms, const float *restrict disparity,
                  const float *restrict confidence, int32_t n, float *restrict out_depth_m,
                  float *restrict out_sigma_m)
{
    const float fb = terms->fb;
    const float angle2 = terms->angle_px * terms->angle_px;
    const float shared = terms->shared;

    for (int32_t x = 0; x < n; x++) {
        const float d = disparity[x];
        const float match_px = shef_depth_sigma(confidence[x]);
        const float per_px2 = match_px * match_px + angle2;
        const float depth_m = fb / d;
        const float sigma_m = depth_m * sqrtf(per_px2 / (d * d) + shared);

        out_depth_m[x] = d > 0.0f ? depth_m : 0.0f;
        out_sigma_m[x] = d > 0.0f ? sigma_m : 0.0f;
    }
}

static void find_jumps(const float *const lines[4], int32_t n, float least,
                       uint8_t *restrict out_marks)
{
    const float *restrict a = lines[0];
    const float *restrict b = lines[1];
    const float *restrict c = lines[2];
    const float *restrict d = lines[3];

    for (int32_t i = 0; i < n; i++) {
        const float step = fabsf(c[i] - b[i]);

        out_marks[i] = (uint8_t)((fabsf(d[i] - a[i]) > least) & (step > fabsf(b[i] - a[i])) &
                                 (step >= fabsf(d[i] - c[i])));
    }
}

/* |u|, |v| <= 15 FINE: all products fit int16. */
static void evidence(const struct shef_rows_patch *patch, ptrdiff_t row_step, int32_t *sum)
{
    const int16_t w0 = patch->weight[0][0];
    const int16_t w1 = patch->weight[0][1];
    const int16_t w2 = patch->weight[1][0];
    const int16_t w3 = patch->weight[1][1];

    for (int32_t row = 0; row < patch->n_rows; row++) {
        const int8_t *restrict left = patch->left + row * patch->left_stride;
        const int8_t *restrict a = patch->at[0] + row * patch->right_stride;
        const int8_t *restrict b = patch->at[1] + row * patch->right_stride;
        int32_t *restrict to = sum + row * row_step;

        /* Unrolled, it would not be vectorised. */
#pragma GCC unroll 1
        for (int i = 0; i < SHEF_ROWS_EVIDENCE_PX; i++) {
            const int16_t u = (int16_t)(a[i] * w0 + a[i - 1] * w1);
            const int16_t v = (int16_t)(b[i] * w2 + b[i - 1] * w3);
            const int16_t both = (int16_t)(2 * SHEF_ROWS_EVIDENCE_FINE * left[i] - u - v);

            to[i] += (int16_t)((int16_t)(u - v) * both);
        }
    }
}

#define SHEF_ROW_KERNELS(features)                                                                 \
    {                                                                                              \
        .cpu_features = (features), .window_sums = window_sums, .mirror_pairs = mirror_pairs,      \
        .slide_values = slide_values, .slide_squares = slide_squares, .gains = gains,              \
        .side = side_pixels, .interleave = interleave, .take_off_bias = take_off_bias,             \
        .keep_edges = keep_edges, .depth = depth, .find_jumps = find_jumps, .evidence = evidence,  \
    }
