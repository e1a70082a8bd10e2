/* The readable definition of the robust matcher's kernels. */
#include "pipeline/kernels/match.h"

#include <string.h>

#include "core/cpu.h"

static int32_t min_of(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t max_of(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

/* Rounded product of two Q15 numbers. */
static int16_t mulhrs(int16_t a, int16_t b)
{
    return (int16_t)(((int32_t)a * b + (1 << 14)) >> 15);
}

static int32_t pair_product(uint16_t left, uint16_t right)
{
    return (left & 0xff) * (int8_t)(right & 0xff) + (left >> 8) * (int8_t)(right >> 8);
}

static int32_t row_product(const struct shef_match_rows *rows, int32_t cell, ptrdiff_t right_at)
{
    return pair_product(rows->left[0][cell], rows->right[0][right_at]) +
           pair_product(rows->left[1][cell], rows->right[1][right_at]);
}

static void columns_c(int16_t *columns, const struct shef_match_rows *entering,
                      const struct shef_match_rows *leaving, int32_t n_cells,
                      int32_t pairs_per_cell, int32_t n_lanes)
{
    for (int32_t g = 0; g < n_cells; g++)
        for (int32_t k = 0; k < n_lanes; k++) {
            const ptrdiff_t right_at = k - (ptrdiff_t)g * pairs_per_cell;
            int16_t *sum = &columns[(ptrdiff_t)g * n_lanes + k];

            *sum = (int16_t)(*sum + row_product(entering, g, right_at) -
                             row_product(leaving, g, right_at));
        }
}

static int32_t correlation(const struct shef_match_row *row, int16_t box, int32_t g,
                           ptrdiff_t right_at)
{
    const struct shef_match_scale *scale = &row->scale;
    const int16_t right_sum = row->right_sum[right_at];
    const int16_t t = (int16_t)((box * (1 << scale->shift)) - (scale->is_signed ? right_sum : 0));
    const int16_t num = (int16_t)(t - mulhrs(row->left_mean[g], right_sum));
    const int16_t half = (int16_t)(mulhrs(num, row->left_gain[g]) * (1 << scale->gain_shift));

    return mulhrs(mulhrs(half, row->right_gain[right_at]), scale->unit);
}

static int32_t prior(const struct shef_match_row *row, int32_t g, int32_t k)
{
    const int32_t away = (int16_t)((k + 1) * row->step - row->expected[g]);
    const int32_t capped = min_of(away < 0 ? -away : away, row->prior_cap);

    return mulhrs((int16_t)(capped * 64), row->weight[g]);
}

static void costs_c(uint16_t *costs, const struct shef_match_row *row)
{
    const int32_t w = row->half_width_cells;

    for (int32_t k = 0; k < row->n_lanes; k++) {
        const int16_t *column = row->columns + k;
        int16_t box = 0;

        for (int32_t g = -w; g < w; g++)
            box = (int16_t)(box + column[(ptrdiff_t)g * row->n_lanes]);
        for (int32_t g = 0; g < row->n_cells; g++) {
            uint16_t *cost = &costs[(ptrdiff_t)g * row->n_lanes + k];

            box = (int16_t)(box + column[(ptrdiff_t)(g + w) * row->n_lanes]);
            const int32_t z = correlation(row, box, g, k - (ptrdiff_t)g * row->pairs_per_cell);
            int32_t value =
                SHEF_MATCH_COST_ONE - max_of(-SHEF_MATCH_COST_ONE, min_of(SHEF_MATCH_COST_ONE, z));

            if (row->is_second_pair)
                value = (value + *cost + 1) >> 1;
            if (row->expected)
                value += prior(row, g, k);
            *cost = (uint16_t)(k < row->n_levels ? value : SHEF_MATCH_NO_LEVEL);
            box = (int16_t)(box - column[(ptrdiff_t)(g - w) * row->n_lanes]);
        }
    }
}

/* One step of one cell; returns the smallest path cost. */
static uint16_t path_step(const struct shef_match_path *path, ptrdiff_t at, ptrdiff_t sums_at,
                          const uint16_t *prev, int32_t lowest, uint16_t *out)
{
    int32_t out_min = UINT16_MAX;

    for (int32_t k = 0; k < path->n_lanes; k++) {
        const int32_t below = k > 0 ? prev[k - 1] : SHEF_MATCH_NO_LEVEL;
        const int32_t above = k + 1 < path->n_lanes ? prev[k + 1] : SHEF_MATCH_NO_LEVEL;
        const int32_t side = min_of(below, above) + path->p1;
        const int32_t jump = lowest + path->p2;
        const int32_t value = path->costs[at + k] + min_of(prev[k], min_of(side, jump)) - lowest;
        const int32_t first = path->addend[0] ? path->addend[0][sums_at + k] : 0;
        const int32_t second = path->addend[1] ? path->addend[1][at + k] : 0;

        out[k] = (uint16_t)value;
        path->sums[sums_at + k] = (uint16_t)(value + first + second);
        out_min = min_of(out_min, value);
    }
    return (uint16_t)out_min;
}

static void path_c(const struct shef_match_path *path)
{
    uint16_t lowest[SHEF_MATCH_PATH_CELLS] = { 0 };
    const size_t n_state = (size_t)path->n_cells * (size_t)path->n_lanes;

    memset(path->state[0], 0, n_state * sizeof(uint16_t));
    for (int32_t step = 0; step < path->n_steps; step++)
        for (int32_t i = 0; i < path->n_cells; i++)
            lowest[i] = path_step(path, i * path->cell_stride + step * path->step,
                                  i * path->cell_stride + step * path->sums_step,
                                  path->state[step % 2] + (ptrdiff_t)i * path->n_lanes, lowest[i],
                                  path->state[(step + 1) % 2] + (ptrdiff_t)i * path->n_lanes);
}

static void winner_c(struct shef_match_best *out_best, const uint16_t *sums, int32_t n_cells,
                     int32_t n_lanes, int32_t n_levels)
{
    for (int32_t i = 0; i < n_cells; i++) {
        const uint16_t *sum = sums + (ptrdiff_t)i * n_lanes;
        int32_t best = 0;
        int32_t rival = 4 * SHEF_MATCH_NO_LEVEL;

        for (int32_t k = 1; k < n_levels; k++)
            if (sum[k] < sum[best])
                best = k;
        for (int32_t k = 0; k < n_levels; k++)
            if (k < best - 2 || k > best + 2)
                rival = min_of(rival, sum[k]);
        out_best[i] = (struct shef_match_best){
            .level = (uint16_t)best,
            .sum = sum[best],
            .below = best > 0 ? sum[best - 1] : 4 * SHEF_MATCH_NO_LEVEL,
            .above = best < n_levels - 1 ? sum[best + 1] : 4 * SHEF_MATCH_NO_LEVEL,
            .margin = (uint16_t)(rival - sum[best]),
        };
    }
}

const struct shef_match_kernels shef_match_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .columns = columns_c,
    .costs = costs_c,
    .path = path_c,
    .winner = winner_c,
};
