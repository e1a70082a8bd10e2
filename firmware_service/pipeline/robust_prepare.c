/* Edge maps to pair rows: bytes, alignment, and the right view mirrored so that rising levels
 * (x - d, falling) are rising addresses. */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <string.h>

/* Graded values shrink to the amplitude at which a whole window's products still fit int16. */
static void shrink(int8_t *values, int32_t n, int32_t amplitude)
{
    const int16_t factor = (int16_t)((amplitude * 32768 + 63) / 127);

    for (int32_t x = 0; x < n; x++)
        values[x] = (int8_t)((values[x] * factor + (1 << 14)) >> 15);
}

static void fill_bytes(const struct shef_robust *matcher, const struct shef_edge_map *map,
                       struct shef_image_i8 bytes, int32_t first_row, int32_t last_row)
{
    for (int32_t y = first_row; y < last_row; y++) {
        int8_t *row = shef_row_i8(bytes, y);

        if (y >= map->height_px) {
            memset(row, 0, (size_t)bytes.width_px);
            continue;
        }
        shef_edge_map_row(map, y, row);
        if (map->kind == SHEF_EDGE_GRADED)
            shrink(row, map->width_px, matcher->shape.amplitude);
    }
}

/* The row that a vertical residual moves to row y; -1: none, it is higher than the image. */
static int32_t source_row(int32_t y, float residual_px, int32_t height_px)
{
    if (!(fabsf(residual_px) < (float)height_px))
        return -1;

    const int32_t source = y - (int32_t)lrintf(residual_px);

    return source < height_px ? source : -1;
}

/* The right row that lies at row y after the vertical residual is taken out, nearest row. The
 * residual is smooth, so 8 px share one source row. */
static void align_row(const struct shef_robust *matcher, const struct robust_view *view, int32_t y,
                      int8_t *out_row)
{
    enum { RUN_PX = 8, MAX_RUNS = SHEF_ROBUST_MAX_SIDE_PX / RUN_PX };
    const int32_t width = view->right.width_px;
    const int32_t n_runs = (width + RUN_PX - 1) / RUN_PX;
    float residual[MAX_RUNS];

    if (!matcher->has_alignment) {
        memcpy(out_row, shef_row_i8(view->right, y), (size_t)width);
        return;
    }
    shef_field_row(&matcher->alignment, y, (RUN_PX - 1) / 2.0, RUN_PX, n_runs, residual);
    for (int32_t run = 0; run < n_runs; run++) {
        const int32_t source = source_row(y, residual[run], view->right.height_px);
        const int32_t x = run * RUN_PX;
        const size_t n = (size_t)(width - x < RUN_PX ? width - x : RUN_PX);

        if (source < 0)
            memset(out_row + x, 0, n);
        else
            memcpy(out_row + x, shef_row_i8(view->right, source) + x, n);
    }
}

/* Pairs are little-endian: the left column's value is the low byte. */
static void fill_left_pairs(const struct robust_shape *shape, const int8_t *row,
                            uint16_t *out_pairs)
{
    uint8_t *bytes = (uint8_t *)out_pairs;

    for (int32_t x = 0; x < 2 * shape->grid_width; x++)
        bytes[x] = (uint8_t)(row[x] + shape->offset);
    memset(bytes + 2 * shape->grid_width, shape->offset,
           2 * (size_t)(shape->left_length - shape->grid_width));
}

/* Pair j holds columns q and q + 1, q = (right_front - j - 1) * step; cell g, level k reads pair
 * right_front - g * pairs_per_cell + k, whose q is 2g - (k + 1) step.
 *   row  with a zero before and after the image's columns */
static void fill_right_pairs(const struct shef_robust *matcher, const int8_t *row,
                             uint16_t *out_pairs)
{
    const struct robust_shape *shape = &matcher->shape;
    const int32_t step = 2 / shape->pairs_per_cell;
    const int32_t last_q = 2 * shape->grid_width - step;

    matcher->rows->mirror_pairs(row + last_q, step, (last_q + 1) / step + 1,
                                out_pairs + shape->right_front - 1 - last_q / step);
}

void robust_bytes_task(void *context, int32_t chunk, int32_t worker)
{
    struct shef_robust *matcher = context;
    struct robust_view *view = &matcher->views[matcher->view];
    const struct shef_edge_pair *pair = &matcher->pairs[matcher->view];
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk, &first, &last);
    fill_bytes(matcher, pair->left, view->left, 2 * first, 2 * last);
    fill_bytes(matcher, pair->right, view->right, 2 * first, 2 * last);
}

void robust_pairs_task(void *context, int32_t chunk, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_shape *shape = &matcher->shape;
    struct robust_view *view = &matcher->views[matcher->view];
    int8_t *aligned = matcher->chunks[chunk].aligned;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk, &first, &last);
    for (int32_t y = 2 * first; y < 2 * last; y++) {
        align_row(matcher, view, y, aligned);
        if (view->aligned.data)
            memcpy(shef_row_i8(view->aligned, y), aligned, (size_t)view->aligned.width_px);
        fill_left_pairs(shape, shef_row_i8(view->left, y),
                        view->left_pairs + (size_t)y * (size_t)shape->left_length);
        fill_right_pairs(matcher, aligned,
                         view->right_pairs + (size_t)y * (size_t)shape->right_length);
    }
}
