#include "shefsim/view_internal.h"

static bool overlap(const float a[2], const float b[2])
{
    return a[0] <= b[1] && b[0] <= a[1];
}

/* Least and largest value of factors . (x, y, 1) within bounds. */
static void find_range(const float factors[3], const struct sim_tile_bounds *bounds, float out[2])
{
    const float x[2] = { factors[0] * bounds->x[0], factors[0] * bounds->x[1] };
    const float y[2] = { factors[1] * bounds->y[0], factors[1] * bounds->y[1] };
    const bool x_turns = x[1] < x[0];
    const bool y_turns = y[1] < y[0];

    out[0] = factors[2] + x[x_turns] + y[y_turns];
    out[1] = factors[2] + x[!x_turns] + y[!y_turns];
}

/* Where texture coordinate factors / inverse depth lies against [0, size]: -1 outside of it, 1
 * inside, all over the tile; else 0.
 *   margin  for roundings and for the seam of the kernel, in the unit of the factors */
static int side_of(const float factors[3], const float inverse_depth[3], float size, float margin,
                   const struct sim_tile_bounds *bounds)
{
    const float to_end[3] = { size * inverse_depth[0] - factors[0],
                              size * inverse_depth[1] - factors[1],
                              size * inverse_depth[2] - factors[2] };
    float from_start[2];
    float before_end[2];

    find_range(factors, bounds, from_start);
    find_range(to_end, bounds, before_end);
    if (from_start[1] < -margin || before_end[1] < -margin)
        return -1;
    return from_start[0] >= 0 && before_end[0] >= 0;
}

void sim_tile_lists_row(struct sim_tile_lists *lists, const struct sim_posed_scene *posed,
                        const struct sim_tile_bounds *bounds)
{
    lists->n_row = 0;
    for (int32_t i = 0; i < posed->n_surfaces; i++) {
        const struct sim_posed_surface *surface = &posed->surfaces[i];

        if (overlap(surface->y, bounds->y) && overlap(surface->x, bounds->x))
            lists->row[lists->n_row++] = surface;
    }
}

void sim_tile_lists_tile(struct sim_tile_lists *lists, const struct sim_tile_bounds *bounds,
                         struct sim_trace_tile *tile)
{
    float wall_m = SIM_TRACE_FARTHEST_M; /* nothing behind this is seen */
    const struct sim_trace_surface *wall = NULL;
    int32_t n = 0;
    int32_t n_kept = 0;

    for (int32_t i = 0; i < lists->n_row; i++) {
        const struct sim_posed_surface *surface = lists->row[i];
        float nearest_m = surface->nearest_m;

        if (nearest_m > wall_m)
            break;
        if (!overlap(surface->x, bounds->x) || !overlap(surface->y, bounds->y))
            continue;
        if (surface->is_flat) {
            const struct sim_trace_surface *s = &surface->trace;
            float inverse[2];

            find_range(s->inverse_depth, bounds, inverse);
            if (inverse[1] <= 0)
                continue;
            if (1 / inverse[1] > nearest_m)
                nearest_m = 1 / inverse[1];
            if (nearest_m > wall_m)
                continue;

            const float margin = .02f * inverse[1];
            const int side_u = side_of(s->u, s->inverse_depth, s->max_u, margin, bounds);
            const int side_v = side_of(s->v, s->inverse_depth, s->max_v, margin, bounds);

            if (side_u < 0 || side_v < 0)
                continue;
            if (side_u > 0 && side_v > 0 && inverse[0] > 0 &&
                inverse[1] < 1 / SIM_TRACE_NEAREST_M && 1 / inverse[0] < wall_m) {
                wall_m = 1 / inverse[0];
                wall = s;
            }
        }
        lists->tile[n] = &surface->trace;
        lists->nearest_m[n++] = nearest_m;
    }
    for (int32_t i = 0; i < n; i++)
        if (lists->nearest_m[i] <= wall_m)
            lists->tile[n_kept++] = lists->tile[i];
    tile->surfaces = lists->tile;
    tile->n_surfaces = n_kept;
    tile->is_covered = n_kept == 1 && wall == lists->tile[0] && !(wall->gloss > 0);
}
