/* Window correlation: pair rows to the cost volume, row by row, and the horizontal paths.
 *
 * A chunk of grid rows keeps column sums of the products over the window's rows; each new grid
 * row enters, the one that leaves the window is taken off, and the kernels slide the window along
 * the row. The same is done for the values and squares that the normalisation needs. Every
 * PATH_ROWS rows, while their costs are still in the cache, the two horizontal paths run. */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <string.h>

#define Q15_ONE 32767
#define OUTSIDE (-1) /* a grid row without edges */

static struct shef_match_rows rows_at(const struct shef_robust *matcher, int32_t grid_row)
{
    const struct robust_shape *shape = &matcher->shape;
    const struct robust_view *view = &matcher->views[matcher->view];
    struct shef_match_rows rows;

    for (int i = 0; i < 2; i++) {
        const size_t y = (size_t)(2 * grid_row + i);
        const bool inside = grid_row >= 0 && grid_row < shape->grid_height;

        rows.left[i] =
            inside ? view->left_pairs + y * (size_t)shape->left_length : matcher->zero_left;
        rows.right[i] =
            (inside ? view->right_pairs + y * (size_t)shape->right_length : matcher->zero_right) +
            shape->right_front;
    }
    return rows;
}

static void slide_sums(const struct shef_row_kernels *rows, struct robust_sums *sums,
                       const uint16_t *const entering[2], const uint16_t *const leaving[2],
                       int32_t n_pairs, int32_t offset)
{
    const uint8_t *const in[2] = { (const uint8_t *)entering[0], (const uint8_t *)entering[1] };
    const uint8_t *const out[2] = { (const uint8_t *)leaving[0], (const uint8_t *)leaving[1] };

    rows->slide_values(in, out, n_pairs, offset, sums->column_sum);
    if (sums->column_square != sums->column_sum)
        rows->slide_squares(in, out, n_pairs, offset, sums->column_square);
}

/* Lets one grid row into all of the chunk's sums and takes another one off. */
static void slide(const struct shef_robust *matcher, struct robust_chunk *chunk,
                  int32_t entering_row, int32_t leaving_row)
{
    const struct robust_shape *shape = &matcher->shape;
    const struct shef_match_rows in = rows_at(matcher, entering_row);
    const struct shef_match_rows out = rows_at(matcher, leaving_row);
    const uint16_t *const right_in[2] = { in.right[0] - shape->right_front,
                                          in.right[1] - shape->right_front };
    const uint16_t *const right_out[2] = { out.right[0] - shape->right_front,
                                           out.right[1] - shape->right_front };

    matcher->kernels->columns(chunk->columns + (ptrdiff_t)(shape->half_width + 1) * shape->n_lanes,
                              &in, &out, shape->left_length, shape->pairs_per_cell, shape->n_lanes);
    slide_sums(matcher->rows, &chunk->left, in.left, out.left, shape->left_length, shape->offset);
    slide_sums(matcher->rows, &chunk->right, right_in, right_out, shape->right_length, 0);
}

/* Both kinds of window sums of a view, and its gains: smallest_sigma / sigma, Q15. */
static void fill_sums_and_gains(const struct shef_robust *matcher, struct robust_sums *sums,
                                int32_t n_columns, int32_t spacing, int32_t n, int32_t window_px,
                                int16_t *out_gain)
{
    const struct robust_shape *shape = &matcher->shape;

    matcher->rows->window_sums(sums->column_sum, n_columns, shape->half_width, spacing, n,
                               sums->window_sum);
    if (sums->window_square != sums->window_sum)
        matcher->rows->window_sums(sums->column_square, n_columns, shape->half_width, spacing, n,
                                   sums->window_square);
    matcher->rows->gains(sums->window_sum, sums->window_square, n, 1.0f / (float)window_px,
                         (float)(shape->smallest_sigma * shape->smallest_sigma), out_gain);
}

/* Mean, gain and texture of each cell's window in the left view. */
static void normalise_left(const struct shef_robust *matcher, struct robust_chunk *chunk,
                           int32_t window_px, uint8_t *texture)
{
    const struct robust_shape *shape = &matcher->shape;
    const struct robust_sums *sums = &chunk->left;
    const int32_t n = shape->grid_width;
    const float to_q15 = (float)Q15_ONE / (float)(window_px * shape->amplitude);
    const float to_share = 255.0f / (float)(window_px * shape->amplitude * shape->amplitude);

    fill_sums_and_gains(matcher, &chunk->left, shape->left_length, 1, n, window_px,
                        chunk->left_gain);
    for (int32_t g = 0; g < n; g++) {
        const float mean = (float)sums->window_sum[g] * to_q15;

        chunk->left_mean[g] = (int16_t)(mean + (mean < 0.0f ? -0.5f : 0.5f));
    }
    if (texture)
        for (int32_t g = 0; g < n; g++)
            texture[g] = (uint8_t)((float)sums->window_square[g] * to_share + 0.5f);
}

/* The same for the right view, at every pair. */
static void normalise_right(const struct shef_robust *matcher, struct robust_chunk *chunk,
                            int32_t window_px)
{
    const struct robust_shape *shape = &matcher->shape;
    const int32_t n = shape->right_length;
    const int32_t scale = shape->amplitude << shape->scale.shift;

    fill_sums_and_gains(matcher, &chunk->right, n, shape->pairs_per_cell, n, window_px,
                        chunk->right_gain);
    for (int32_t j = 0; j < n; j++)
        chunk->right_scaled[j] = (int16_t)(chunk->right.window_sum[j] * scale);
}

/* Costs of one grid row whose window sums are complete. */
static void cost_row(const struct shef_robust *matcher, struct robust_chunk *chunk, int32_t y)
{
    const struct robust_shape *shape = &matcher->shape;
    const struct robust_grid *past = &matcher->grids[!matcher->current];
    const int32_t h = shape->half_height;
    const int32_t first = y - h < 0 ? 0 : y - h;
    const int32_t last = y + h >= shape->grid_height ? shape->grid_height - 1 : y + h;
    const int32_t window_px = (last - first + 1) * 2 * (2 * shape->half_width + 1) * 2;
    const bool is_last_view = matcher->view == matcher->n_pairs - 1;
    uint8_t *texture = shef_row_u8(matcher->grids[matcher->current].texture, y);

    normalise_left(matcher, chunk, window_px, matcher->view == 0 ? texture : NULL);
    normalise_right(matcher, chunk, window_px);

    struct shef_match_row row = {
        .columns = chunk->columns + (ptrdiff_t)(shape->half_width + 1) * shape->n_lanes,
        .half_width_cells = shape->half_width,
        .n_cells = shape->grid_width,
        .n_lanes = shape->n_lanes,
        .n_levels = shape->n_levels,
        .pairs_per_cell = shape->pairs_per_cell,
        .scale = shape->scale,
        .left_mean = chunk->left_mean,
        .left_gain = chunk->left_gain,
        .right_sum = chunk->right_scaled + shape->right_front,
        .right_gain = chunk->right_gain + shape->right_front,
        .is_second_pair = matcher->view == 1,
        .step = (int16_t)(matcher->params.step_px * 16),
    };

    if (matcher->uses_past && is_last_view) {
        const int16_t *trust = shef_row_i16(past->trust, y);
        const int32_t per_px = (int32_t)lrint(matcher->prior_cost_per_px * 32.0);

        for (int32_t g = 0; g < shape->grid_width; g++)
            chunk->weight[g] = (int16_t)((trust[g] * per_px) >> 15);
        row.expected = shef_row_i16(past->expected, y);
        row.weight = chunk->weight;
        row.prior_cap = (int16_t)lrint(matcher->params.prior_cap_px * 16.0);
    }
    matcher->kernels->costs(
        matcher->costs + (size_t)y * (size_t)shape->grid_width * (size_t)shape->n_lanes, &row);
}

/* Both horizontal paths of n_rows rows of costs, all rows in step. */
static void horizontal_paths(const struct shef_robust *matcher, struct robust_chunk *chunk,
                             int32_t first_row, int32_t n_rows)
{
    const struct robust_shape *shape = &matcher->shape;
    const ptrdiff_t row_lanes = (ptrdiff_t)shape->grid_width * shape->n_lanes;

    for (int32_t direction = 1; direction >= -1; direction -= 2) {
        const ptrdiff_t first_cell = direction > 0 ? 0 : row_lanes - shape->n_lanes;
        uint16_t *sums = matcher->sums + first_row * row_lanes + first_cell;

        matcher->kernels->path(&(struct shef_match_path){
            .costs = matcher->costs + first_row * row_lanes + first_cell,
            .addend = { direction > 0 ? NULL : sums },
            .sums = sums,
            .cell_stride = row_lanes,
            .step = direction * shape->n_lanes,
            .sums_step = direction * shape->n_lanes,
            .state = { chunk->paths[0], chunk->paths[1] },
            .n_cells = n_rows,
            .n_steps = shape->grid_width,
            .n_lanes = shape->n_lanes,
            .p1 = (uint16_t)matcher->params.p1,
            .p2 = (uint16_t)matcher->params.p2,
        });
    }
}

static void clear_sums(struct robust_sums *sums, int32_t n)
{
    memset(sums->column_sum, 0, (size_t)n * sizeof *sums->column_sum);
    memset(sums->column_square, 0, (size_t)n * sizeof *sums->column_square);
}

void robust_correlate_task(void *context, int32_t chunk_index, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_shape *shape = &matcher->shape;
    struct robust_chunk *chunk = &matcher->chunks[chunk_index];
    const bool is_last_view = matcher->view == matcher->n_pairs - 1;
    const size_t n_columns = (size_t)(shape->half_width + 1 + shape->left_length);
    const int32_t h = shape->half_height;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk_index, &first, &last);
    memset(chunk->columns, 0, n_columns * (size_t)shape->n_lanes * sizeof *chunk->columns);
    clear_sums(&chunk->left, shape->left_length);
    clear_sums(&chunk->right, shape->right_length);
    for (int32_t y = first - h < 0 ? 0 : first - h; y < first + h && y < shape->grid_height; y++)
        slide(matcher, chunk, y, OUTSIDE);
    for (int32_t y = first; y < last; y++) {
        /* The first row's window is complete with the row that enters: nothing leaves yet. */
        slide(matcher, chunk, y + h, y == first ? OUTSIDE : y - h - 1);
        cost_row(matcher, chunk, y);

        const int32_t n_ready = (y - first) % PATH_ROWS + 1;

        if (is_last_view && (n_ready == PATH_ROWS || y == last - 1))
            horizontal_paths(matcher, chunk, y - n_ready + 1, n_ready);
    }
}
