/* The robust matcher's kernels on vectors of 16-bit lanes, written once for every instruction set.
 *
 * The including file first includes its vec_*.h and defines the further vec_ functions used here.
 * Those with a last argument n touch only the first n lanes in memory (all of them if n is
 * larger); where VEC_LANES divides SHEF_MATCH_LANE_MULTIPLE they can ignore it. The meaning of
 * every line is in match_c.c; the checks hold both to the same bits. */

#include <string.h>

#include "pipeline/kernels/match.h"

static inline vec rows_product(const struct shef_match_rows *rows, int32_t cell, ptrdiff_t right_at,
                               int32_t n)
{
    return vec_add(vec_dot_pairs(vec_set1((int16_t)rows->left[0][cell]),
                                 vec_load_first(rows->right[0] + right_at, n)),
                   vec_dot_pairs(vec_set1((int16_t)rows->left[1][cell]),
                                 vec_load_first(rows->right[1] + right_at, n)));
}

static void columns_vec(int16_t *columns, const struct shef_match_rows *entering,
                        const struct shef_match_rows *leaving, int32_t n_cells,
                        int32_t pairs_per_cell, int32_t n_lanes)
{
    for (int32_t g = 0; g < n_cells; g++)
        for (int32_t k = 0; k < n_lanes; k += VEC_LANES) {
            const ptrdiff_t right_at = k - (ptrdiff_t)g * pairs_per_cell;
            const int32_t n = n_lanes - k;
            int16_t *sum = columns + (ptrdiff_t)g * n_lanes + k;
            const vec change = vec_sub(rows_product(entering, g, right_at, n),
                                       rows_product(leaving, g, right_at, n));

            vec_store_first(sum, vec_add(vec_load_first(sum, n), change), n);
        }
}

/* One vector of levels along the row, the running window sum in a register. The flags are
 * constants where this is inlined. The row is taken by value: vector stores may alias anything but
 * a local. */
static inline __attribute__((always_inline)) void costs_of_levels(uint16_t *costs,
                                                                  const struct shef_match_row row,
                                                                  int32_t k, int is_signed,
                                                                  int has_prior)
{
    const int32_t w = row.half_width_cells;
    const ptrdiff_t stride = row.n_lanes;
    const int32_t n = row.n_lanes - k;
    const struct shef_match_scale scale = row.scale;
    const vec one = vec_set1(SHEF_MATCH_COST_ONE);
    const vec minus_one = vec_set1(-SHEF_MATCH_COST_ONE);
    const vec unit = vec_set1(scale.unit);
    const vec cap = vec_set1(row.prior_cap);
    const vec lanes = vec_add(vec_iota(), vec_set1((int16_t)k));
    const vec position = vec_mul(vec_add(lanes, vec_set1(1)), vec_set1(row.step));
    const vec_select is_level = vec_above(vec_set1((int16_t)row.n_levels), lanes);
    const int16_t *column = row.columns + k;
    vec box = vec_set1(0);

    for (int32_t g = -w; g < w; g++)
        box = vec_add(box, vec_load_first(column + g * stride, n));
    for (int32_t g = 0; g < row.n_cells; g++) {
        const ptrdiff_t right_at = k - (ptrdiff_t)g * row.pairs_per_cell;
        const vec right_sum = vec_load_first(row.right_sum + right_at, n);
        uint16_t *cost = costs + g * stride + k;

        box = vec_add(box, vec_load_first(column + (g + w) * stride, n));
        vec t = vec_shift_left(box, scale.shift);
        if (is_signed)
            t = vec_sub(t, right_sum);
        const vec num = vec_sub(t, vec_mulhrs(vec_set1(row.left_mean[g]), right_sum));
        const vec half =
            vec_shift_left(vec_mulhrs(num, vec_set1(row.left_gain[g])), scale.gain_shift);
        const vec z =
            vec_mulhrs(vec_mulhrs(half, vec_load_first(row.right_gain + right_at, n)), unit);
        vec value = vec_sub(one, vec_max(minus_one, vec_min(one, z)));

        if (row.is_second_pair)
            value = vec_average(value, vec_load_first(cost, n));
        if (has_prior) {
            const vec away = vec_abs(vec_sub(position, vec_set1(row.expected[g])));
            const vec capped = vec_shift_left(vec_min(away, cap), 6);

            value = vec_add(value, vec_mulhrs(capped, vec_set1(row.weight[g])));
        }
        vec_store_first(cost, vec_choose(is_level, value, vec_set1(SHEF_MATCH_NO_LEVEL)), n);
        box = vec_sub(box, vec_load_first(column + (g - w) * stride, n));
    }
}

static void costs_vec(uint16_t *costs, const struct shef_match_row *row)
{
    for (int32_t k = 0; k < row->n_lanes; k += VEC_LANES) {
        if (row->scale.is_signed && row->expected)
            costs_of_levels(costs, *row, k, 1, 1);
        else if (row->scale.is_signed)
            costs_of_levels(costs, *row, k, 1, 0);
        else if (row->expected)
            costs_of_levels(costs, *row, k, 0, 1);
        else
            costs_of_levels(costs, *row, k, 0, 0);
    }
}

/* The path is taken by value: vector stores may alias anything but a local.
 *
 * The state was stored a few cells ago and is still on its way to the cache: a load gets it from
 * there without waiting only if it asks for the same bytes that one store wrote. So the lanes'
 * neighbours come out of registers. */
static inline __attribute__((always_inline)) void path_cells(const struct shef_match_path path,
                                                             int32_t n_lanes, int n_addends)
{
    const vec p1 = vec_set1((int16_t)path.p1);
    const vec p2 = vec_set1((int16_t)path.p2);
    const vec outside = vec_set1(SHEF_MATCH_NO_LEVEL);
    uint16_t lowest[SHEF_MATCH_PATH_CELLS] = { 0 };

    memset(path.state[0], 0, (size_t)path.n_cells * (size_t)n_lanes * sizeof(uint16_t));
    for (int32_t step = 0; step < path.n_steps; step++) {
        const uint16_t *cost = path.costs + step * path.step;
        /* Without an addend the pointer only walks along. */
        const uint16_t *add0 = n_addends > 0 ? path.addend[0] + step * path.sums_step : cost;
        const uint16_t *add1 = n_addends > 1 ? path.addend[1] + step * path.step : cost;
        const uint16_t *prev = path.state[step % 2];
        uint16_t *out = path.state[(step + 1) % 2];
        uint16_t *sum = path.sums + step * path.sums_step;

        for (int32_t i = 0; i < path.n_cells; i++) {
            const vec low = vec_set1((int16_t)lowest[i]);
            const vec jump = vec_add(low, p2);
            vec smallest = vec_set1(-1);
            vec before = outside;
            vec here = vec_load_filled(prev, n_lanes, outside);

            for (int32_t k = 0; k < n_lanes; k += VEC_LANES) {
                const int32_t n = n_lanes - k;
                const vec next = n > VEC_LANES
                                     ? vec_load_filled(prev + k + VEC_LANES, n - VEC_LANES, outside)
                                     : outside;
                const vec sides =
                    vec_min_unsigned(vec_moved_up(before, here), vec_moved_down(here, next));
                const vec move = vec_min_unsigned(vec_add(sides, p1), jump);
                const vec value = vec_add(vec_load_first(cost + k, n),
                                          vec_sub(vec_min_unsigned(here, move), low));
                vec total = value;

                before = here;
                here = next;

                smallest = vec_min_of_first(smallest, value, n);
                if (n_addends > 0)
                    total = vec_add(total, vec_load_first(add0 + k, n));
                if (n_addends > 1)
                    total = vec_add(total, vec_load_first(add1 + k, n));
                vec_store_first(out + k, value, n);
                vec_store_first(sum + k, total, n);
            }
            lowest[i] = vec_smallest(smallest);
            prev += n_lanes;
            out += n_lanes;
            cost += path.cell_stride;
            add0 += path.cell_stride;
            add1 += path.cell_stride;
            sum += path.cell_stride;
        }
    }
}

static inline __attribute__((always_inline)) void path_lanes(const struct shef_match_path *path,
                                                             int32_t n_lanes)
{
    if (path->addend[1])
        path_cells(*path, n_lanes, 2);
    else if (path->addend[0])
        path_cells(*path, n_lanes, 1);
    else
        path_cells(*path, n_lanes, 0);
}

static void path_vec(const struct shef_match_path *path)
{
    /* 80 px in steps of 2 is what runs live: a constant number of lanes unrolls. */
    if (path->n_lanes == 48)
        path_lanes(path, 48);
    else
        path_lanes(path, path->n_lanes);
}

static inline __attribute__((always_inline)) void winner_cells(struct shef_match_best *out_best,
                                                               const uint16_t *sums,
                                                               int32_t n_cells, int32_t n_lanes,
                                                               int32_t n_levels)
{
    for (int32_t i = 0; i < n_cells; i++) {
        const uint16_t *sum = sums + (ptrdiff_t)i * n_lanes;
        vec smallest = vec_set1(-1);
        vec rival = vec_set1(-1);
        int32_t best = -1;

        for (int32_t k = 0; k < n_lanes; k += VEC_LANES)
            smallest =
                vec_min_of_first(smallest, vec_load_first(sum + k, n_lanes - k), n_lanes - k);
        const uint16_t best_sum = vec_smallest(smallest);
        for (int32_t k = 0; best < 0; k += VEC_LANES) {
            const int32_t lane =
                vec_first_equal(vec_load_first(sum + k, n_lanes - k), vec_set1((int16_t)best_sum));

            best = lane < 0 ? -1 : k + lane;
        }
        for (int32_t k = 0; k < n_lanes; k += VEC_LANES) {
            const vec away = vec_abs(vec_sub(vec_iota(), vec_set1((int16_t)(best - k))));
            const vec far_sum = vec_choose(vec_above(vec_set1(3), away), vec_set1(-1),
                                           vec_load_first(sum + k, n_lanes - k));

            rival = vec_min_of_first(rival, far_sum, n_lanes - k);
        }
        out_best[i].level = (uint16_t)best;
        out_best[i].sum = best_sum;
        out_best[i].below = best > 0 ? sum[best - 1] : 4 * SHEF_MATCH_NO_LEVEL;
        out_best[i].above = best < n_levels - 1 ? sum[best + 1] : 4 * SHEF_MATCH_NO_LEVEL;
        out_best[i].margin = (uint16_t)(vec_smallest(rival) - best_sum);
    }
}

static void winner_vec(struct shef_match_best *out_best, const uint16_t *sums, int32_t n_cells,
                       int32_t n_lanes, int32_t n_levels)
{
    if (n_lanes == 48)
        winner_cells(out_best, sums, n_cells, 48, n_levels);
    else
        winner_cells(out_best, sums, n_cells, n_lanes, n_levels);
}
