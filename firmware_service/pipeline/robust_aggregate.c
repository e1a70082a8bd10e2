/* Vertical paths in strips of columns, then each cell's winner.
 *
 * A strip's volume (240 rows of 16 cells: 370 kB at 40 levels) stays in the second-level cache
 * between the way down and the way up. */
#include "pipeline/robust_internal.h"

#include <math.h>

/* A margin of this cost or more is trusted fully as a prior. */
#define PRIOR_FULL_MARGIN 2000

int32_t robust_n_strips(const struct shef_robust *matcher)
{
    return (matcher->shape.grid_width + STRIP_CELLS - 1) / STRIP_CELLS;
}

/* Disparity in 1/32 px. Sums rise linearly on both sides of a surface that lies between two levels,
 * because every path pays p1 per level, so a V with equal slopes is fitted; a parabola would pull
 * slanted surfaces towards the levels. */
static int32_t refine(const struct shef_match_best *best, int32_t step_px)
{
    const float below = best->below;
    const float above = best->above;
    const float slope = (below > above ? below : above) - (float)best->sum;
    float offset = 0.0f;

    if (slope > 0.0f && below < 4.0f * SHEF_MATCH_NO_LEVEL && above < 4.0f * SHEF_MATCH_NO_LEVEL)
        offset = 0.5f * (below - above) / slope;
    return (int32_t)lrintf(((float)best->level + 1.0f + offset) * (float)(32 * step_px));
}

/* The same by a parabola through the sums and the pair's own costs. The sums know the surface but
 * are stiff, the costs are exact but noisy; together they halve the error of either.
 *   costs  of the cell */
static int32_t refine_with_scores(const struct shef_match_best *best, const uint16_t *costs,
                                  float weight, int32_t step_px)
{
    if (best->below >= 4 * SHEF_MATCH_NO_LEVEL || best->above >= 4 * SHEF_MATCH_NO_LEVEL)
        return refine(best, step_px);

    const uint16_t *at = costs + best->level;
    const float below = (float)best->below + weight * (float)at[-1];
    const float above = (float)best->above + weight * (float)at[1];
    const float middle = (float)best->sum + weight * (float)at[0];
    const float bend = below + above - 2.0f * middle;
    float offset = bend > 0.0f ? 0.5f * (below - above) / bend : 0.0f;

    offset = offset < -0.5f ? -0.5f : offset > 0.5f ? 0.5f : offset;
    return (int32_t)lrintf(((float)best->level + 1.0f + offset) * (float)(32 * step_px));
}

/*   costs  of the first cell */
static void store_winners(struct shef_robust *matcher, const struct shef_match_best *best,
                          const uint16_t *costs, int32_t x, int32_t y, int32_t n_cells)
{
    const float weight = (float)matcher->params.score_weight;
    const int32_t step_px = matcher->params.step_px;
    struct robust_grid *grid = &matcher->grids[matcher->current];
    int16_t *disparity = shef_row_i16(grid->disparity, y) + x;
    int16_t *expected = shef_row_i16(grid->expected, y) + x;
    uint16_t *margin = shef_row_u16(grid->margin, y) + x;
    int16_t *trust = shef_row_i16(grid->trust, y) + x;

    for (int32_t i = 0; i < n_cells; i++) {
        const int32_t capped =
            best[i].margin < PRIOR_FULL_MARGIN ? best[i].margin : PRIOR_FULL_MARGIN;

        disparity[i] =
            (int16_t)(weight > 0.0f
                          ? refine_with_scores(&best[i], costs + i * matcher->shape.n_lanes, weight,
                                               step_px)
                          : refine(&best[i], step_px));
        expected[i] = (int16_t)(disparity[i] / 2);
        margin[i] = best[i].margin;
        trust[i] = (int16_t)(capped * 32767 / PRIOR_FULL_MARGIN);
    }
}

/* The strip's sums are in memory of their own: the path downwards starts them, the path upwards
 * adds itself and the horizontal ones, and the winner reads them while they are in the cache. */
void robust_aggregate_task(void *context, int32_t strip, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_shape *shape = &matcher->shape;
    struct robust_chunk *chunk = &matcher->chunks[worker];
    const int32_t x = strip * STRIP_CELLS;
    const int32_t n_cells =
        shape->grid_width - x < STRIP_CELLS ? shape->grid_width - x : STRIP_CELLS;
    const ptrdiff_t row_lanes = (ptrdiff_t)shape->grid_width * shape->n_lanes;
    const ptrdiff_t strip_lanes = (ptrdiff_t)STRIP_CELLS * shape->n_lanes;
    const int32_t last_row = shape->grid_height - 1;
    struct shef_match_path path = {
        .costs = matcher->costs + (ptrdiff_t)x * shape->n_lanes,
        .sums = chunk->strip_sums,
        .cell_stride = shape->n_lanes,
        .step = row_lanes,
        .sums_step = strip_lanes,
        .state = { chunk->paths[0], chunk->paths[1] },
        .n_cells = n_cells,
        .n_steps = shape->grid_height,
        .n_lanes = shape->n_lanes,
        .p1 = (uint16_t)matcher->params.p1,
        .p2 = (uint16_t)matcher->params.p2,
    };

    matcher->kernels->path(&path);
    path.costs += last_row * row_lanes;
    path.sums += last_row * strip_lanes;
    path.addend[0] = path.sums;
    path.addend[1] = matcher->sums + last_row * row_lanes + (ptrdiff_t)x * shape->n_lanes;
    path.step = -path.step;
    path.sums_step = -path.sums_step;
    matcher->kernels->path(&path);
    for (int32_t y = 0; y <= last_row; y++) {
        matcher->kernels->winner(chunk->best, chunk->strip_sums + y * strip_lanes, n_cells,
                                 shape->n_lanes, shape->n_levels);
        store_winners(matcher, chunk->best,
                      matcher->costs + y * row_lanes + (ptrdiff_t)x * shape->n_lanes, x, y,
                      n_cells);
    }
}
