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

/* Adds sign times the values and squares of one row of pairs. */
static void add_pairs(const uint8_t *bytes, int32_t n_pairs, int32_t offset, int32_t sign,
                      int32_t *sum, int32_t *square)
{
    for (int32_t i = 0; i < n_pairs; i++) {
        const int32_t a = (int8_t)(uint8_t)(bytes[2 * i] - offset);
        const int32_t b = (int8_t)(uint8_t)(bytes[2 * i + 1] - offset);

        sum[i] += sign * (a + b);
        square[i] += sign * (a * a + b * b);
    }
}

/* Lets a grid row into the chunk's sums (sign 1) or takes it off (-1). */
static void add_row_sums(const struct shef_robust *matcher, struct robust_chunk *chunk,
                         int32_t grid_row, int32_t sign)
{
    const struct robust_shape *shape = &matcher->shape;
    const struct shef_match_rows rows = rows_at(matcher, grid_row);

    if (grid_row < 0 || grid_row >= shape->grid_height)
        return;
    for (int i = 0; i < 2; i++) {
        add_pairs((const uint8_t *)rows.left[i], shape->left_length, shape->offset, sign,
                  chunk->left_sum, chunk->left_square);
        add_pairs((const uint8_t *)(rows.right[i] - shape->right_front), shape->right_length, 0,
                  sign, chunk->right_sum, chunk->right_square);
    }
}

/* Q15 factor smallest_sigma / sigma of a window with this sum and sum of squares. */
static int16_t gain_of(const struct robust_shape *shape, int32_t sum, int32_t square,
                       float inverse_n)
{
    const float floor2 = (float)(shape->smallest_sigma * shape->smallest_sigma);
    const float variance = (float)square - (float)sum * (float)sum * inverse_n;
    const float ratio2 = floor2 / ((variance > 0.0f ? variance : 0.0f) + floor2);

    return (int16_t)(sqrtf(ratio2) * (float)Q15_ONE + 0.5f);
}

/* Window sums of the left view along the row: mean, gain and texture of each cell. */
static void normalise_left(const struct shef_robust *matcher, struct robust_chunk *chunk,
                           int32_t window_px, uint8_t *texture)
{
    const struct robust_shape *shape = &matcher->shape;
    const int32_t w = shape->half_width;
    const float inverse_n = 1.0f / (float)window_px;
    const float to_q15 = (float)Q15_ONE / (float)(window_px * shape->amplitude);
    const float to_share = 255.0f / (float)(window_px * shape->amplitude * shape->amplitude);
    int32_t sum = 0;
    int32_t square = 0;

    for (int32_t g = 0; g < w; g++) {
        sum += chunk->left_sum[g];
        square += chunk->left_square[g];
    }
    for (int32_t g = 0; g < shape->grid_width; g++) {
        sum += chunk->left_sum[g + w];
        square += chunk->left_square[g + w];
        chunk->left_mean[g] = (int16_t)lrintf((float)sum * to_q15);
        chunk->left_gain[g] = gain_of(shape, sum, square, inverse_n);
        if (texture)
            texture[g] = (uint8_t)lrintf((float)square * to_share);
        if (g >= w) {
            sum -= chunk->left_sum[g - w];
            square -= chunk->left_square[g - w];
        }
    }
}

/* The same for the right view at every pair; neighbouring cells are pairs_per_cell apart. */
static void normalise_right(const struct robust_shape *shape, struct robust_chunk *chunk,
                            int32_t window_px)
{
    const int32_t c = shape->pairs_per_cell;
    const int32_t reach = shape->half_width * c;
    const float inverse_n = 1.0f / (float)window_px;
    const int32_t scale = shape->amplitude << shape->scale.shift;

    for (int32_t phase = 0; phase < c; phase++) {
        int32_t sum = 0;
        int32_t square = 0;

        for (int32_t j = phase; j < reach + phase; j += c) {
            sum += chunk->right_sum[j];
            square += chunk->right_square[j];
        }
        for (int32_t j = phase; j + reach < shape->right_length; j += c) {
            sum += chunk->right_sum[j + reach];
            square += chunk->right_square[j + reach];
            chunk->right_scaled[j] = (int16_t)(sum * scale);
            chunk->right_gain[j] = gain_of(shape, sum, square, inverse_n);
            if (j >= reach) {
                sum -= chunk->right_sum[j - reach];
                square -= chunk->right_square[j - reach];
            }
        }
    }
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
    normalise_right(shape, chunk, window_px);

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
    const size_t path_bytes = (size_t)n_rows * (size_t)shape->n_lanes * sizeof(uint16_t);
    uint16_t minima[2][PATH_ROWS];

    for (int direction = 0; direction < 2; direction++) {
        int from = 0;

        /* Before the first cell nothing has been paid. */
        memset(chunk->paths[from], 0, path_bytes);
        memset(minima[from], 0, sizeof minima[from]);
        for (int32_t i = 0; i < shape->grid_width; i++, from = !from) {
            const int32_t g = direction ? shape->grid_width - 1 - i : i;
            const ptrdiff_t at = first_row * row_lanes + (ptrdiff_t)g * shape->n_lanes;

            matcher->kernels->path(&(struct shef_match_path){
                .costs = matcher->costs + at,
                .costs_stride = row_lanes,
                .prev = chunk->paths[from],
                .prev_min = minima[from],
                .out = chunk->paths[!from],
                .out_min = minima[!from],
                .sums = matcher->sums + at,
                .sums_stride = row_lanes,
                .is_first = direction == 0,
                .n_cells = n_rows,
                .n_lanes = shape->n_lanes,
                .p1 = (uint16_t)matcher->params.p1,
                .p2 = (uint16_t)matcher->params.p2,
            });
        }
    }
}

void robust_correlate_task(void *context, int32_t chunk_index, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_shape *shape = &matcher->shape;
    struct robust_chunk *chunk = &matcher->chunks[chunk_index];
    const struct shef_match_rows nothing = rows_at(matcher, -1);
    int16_t *columns = chunk->columns + (ptrdiff_t)(shape->half_width + 1) * shape->n_lanes;
    const int32_t h = shape->half_height;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk_index, &first, &last);
    memset(columns, 0, (size_t)shape->left_length * (size_t)shape->n_lanes * sizeof *columns);
    memset(chunk->left_sum, 0, (size_t)shape->left_length * sizeof(int32_t));
    memset(chunk->left_square, 0, (size_t)shape->left_length * sizeof(int32_t));
    memset(chunk->right_sum, 0, (size_t)shape->right_length * sizeof(int32_t));
    memset(chunk->right_square, 0, (size_t)shape->right_length * sizeof(int32_t));
    for (int32_t y = first - h; y < first + h; y++) {
        const struct shef_match_rows entering = rows_at(matcher, y);

        if (y < 0 || y >= shape->grid_height)
            continue;
        matcher->kernels->columns(columns, &entering, &nothing, shape->left_length,
                                  shape->pairs_per_cell, shape->n_lanes);
        add_row_sums(matcher, chunk, y, 1);
    }

    int32_t n_ready = 0;

    for (int32_t y = first; y < last; y++) {
        const struct shef_match_rows entering = rows_at(matcher, y + h);
        /* The first row's window is already whole: nothing leaves yet. */
        const struct shef_match_rows leaving = rows_at(matcher, y == first ? -1 : y - h - 1);

        matcher->kernels->columns(columns, &entering, &leaving, shape->left_length,
                                  shape->pairs_per_cell, shape->n_lanes);
        add_row_sums(matcher, chunk, y + h, 1);
        if (y != first)
            add_row_sums(matcher, chunk, y - h - 1, -1);
        cost_row(matcher, chunk, y);
        n_ready++;
        if ((n_ready == PATH_ROWS || y == last - 1) && matcher->view == matcher->n_pairs - 1) {
            horizontal_paths(matcher, chunk, y - n_ready + 1, n_ready);
            n_ready = 0;
        } else if (n_ready == PATH_ROWS) {
            n_ready = 0;
        }
    }
}
