/* Vertical paths in strips of columns, then each cell's winner.
 *
 * A strip's volume (240 rows of 16 cells: 370 kB at 40 levels) stays in the second-level cache
 * between the way down and the way up. */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <string.h>

/* A margin of this cost or more is trusted fully as a prior. */
#define PRIOR_FULL_MARGIN 2000

int32_t robust_n_strips(const struct shef_robust *matcher)
{
    return (matcher->shape.grid_width + STRIP_CELLS - 1) / STRIP_CELLS;
}

/* Disparity in 1/32 px with the parabola through the winner and its neighbours. */
static int32_t refine(const struct shef_match_best *best, int32_t step_px)
{
    const float below = best->below;
    const float above = best->above;
    const float curve = below - 2.0f * (float)best->sum + above;
    float offset = 0.0f;

    if (curve > 0.0f && below < 4.0f * SHEF_MATCH_NO_LEVEL && above < 4.0f * SHEF_MATCH_NO_LEVEL)
        offset = 0.5f * (below - above) / curve;
    return (int32_t)lrintf(((float)best->level + 1.0f + offset) * (float)(32 * step_px));
}

static void store_winners(struct shef_robust *matcher, const struct shef_match_best *best,
                          int32_t x, int32_t y, int32_t n_cells)
{
    struct robust_grid *grid = &matcher->grids[matcher->current];
    int16_t *disparity = shef_row_i16(grid->disparity, y) + x;
    int16_t *expected = shef_row_i16(grid->expected, y) + x;
    uint16_t *margin = shef_row_u16(grid->margin, y) + x;
    int16_t *trust = shef_row_i16(grid->trust, y) + x;

    for (int32_t i = 0; i < n_cells; i++) {
        const int32_t capped =
            best[i].margin < PRIOR_FULL_MARGIN ? best[i].margin : PRIOR_FULL_MARGIN;

        disparity[i] = (int16_t)refine(&best[i], matcher->params.step_px);
        expected[i] = (int16_t)(disparity[i] / 2);
        margin[i] = best[i].margin;
        trust[i] = (int16_t)(capped * 32767 / PRIOR_FULL_MARGIN);
    }
}

void robust_aggregate_task(void *context, int32_t strip, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_shape *shape = &matcher->shape;
    struct robust_chunk *chunk = &matcher->chunks[worker];
    const int32_t x = strip * STRIP_CELLS;
    const int32_t n_cells =
        shape->grid_width - x < STRIP_CELLS ? shape->grid_width - x : STRIP_CELLS;
    const size_t path_bytes = (size_t)n_cells * (size_t)shape->n_lanes * sizeof(uint16_t);
    uint16_t minima[2][STRIP_CELLS];

    for (int direction = 0; direction < 2; direction++) {
        int from = 0;

        memset(chunk->paths[from], 0, path_bytes);
        memset(minima[from], 0, sizeof minima[from]);
        for (int32_t i = 0; i < shape->grid_height; i++, from = !from) {
            const int32_t y = direction ? shape->grid_height - 1 - i : i;
            const ptrdiff_t at = ((ptrdiff_t)y * shape->grid_width + x) * shape->n_lanes;

            matcher->kernels->path(&(struct shef_match_path){
                .costs = matcher->costs + at,
                .costs_stride = shape->n_lanes,
                .prev = chunk->paths[from],
                .prev_min = minima[from],
                .out = chunk->paths[!from],
                .out_min = minima[!from],
                .sums = matcher->sums + at,
                .sums_stride = shape->n_lanes,
                .is_first = 0,
                .n_cells = n_cells,
                .n_lanes = shape->n_lanes,
                .p1 = (uint16_t)matcher->params.p1,
                .p2 = (uint16_t)matcher->params.p2,
            });
            if (direction == 1) {
                matcher->kernels->winner(chunk->best, matcher->sums + at, n_cells, shape->n_lanes,
                                         shape->n_levels);
                store_winners(matcher, chunk->best, x, y, n_cells);
            }
        }
    }
}
