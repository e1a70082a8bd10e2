#include <stdlib.h>

#include "core/memory.h"
#include "shefsim/view_internal.h"

#define NODE_PX   4
#define MAX_NODES (SIM_VIEW_MAX_SIDE_PX / NODE_PX + 5)

static size_t tile_floats(const struct sim_ray_grid *grid)
{
    return (size_t)SIM_TILE_ROWS * (size_t)grid->n_subs * 2 * SIM_TRACE_LANES;
}

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static void widen(struct sim_tile_bounds *bounds, float x, float y)
{
    bounds->x[0] = x < bounds->x[0] ? x : bounds->x[0];
    bounds->x[1] = x > bounds->x[1] ? x : bounds->x[1];
    bounds->y[0] = y < bounds->y[0] ? y : bounds->y[0];
    bounds->y[1] = y > bounds->y[1] ? y : bounds->y[1];
}

static const struct sim_tile_bounds empty = { { 1e9f, -1e9f }, { 1e9f, -1e9f } };

/* Rays in the making. */
struct fill {
    struct sim_ray_grid *grid;
    const struct shef_camera_model *camera;
    int32_t supersample;
    int32_t *blind_px; /* per row of tiles: x and y of a pixel that sees nothing, else -1 */
};

/* Directions at every NODE_PX px of a line, from two nodes before its first pixel on. */
struct line {
    double x[MAX_NODES];
    double y[MAX_NODES];
    bool is_smooth; /* the lens sees all nodes, those outside of the image too */
};

static void fill_line(struct line *line, const struct fill *fill, double y)
{
    const int32_t n = fill->grid->width_px / NODE_PX + 5;

    line->is_smooth = true;
    for (int32_t i = 0; i < n; i++) {
        double direction[3];

        if (!shef_camera_unproject(fill->camera, (double)(i - 2) * NODE_PX, y, direction)) {
            line->is_smooth = false;
            return;
        }
        line->x[i] = direction[0];
        line->y[i] = direction[1];
    }
}

/* Lagrange's cubic through four nodes, t from the second of them: the directions bend so little
 * that this is right to 1e-8, less than the rays' own rounding. */
static double between(const double nodes[4], double t)
{
    const double before = t + 1;
    const double next = t - 1;
    const double last = t - 2;

    return nodes[0] * (t * next * last) / -6 + nodes[1] * (before * next * last) / 2 +
           nodes[2] * (before * t * last) / -2 + nodes[3] * (before * t * next) / 6;
}

/* False: the lens sees nothing there. */
static bool find_direction(const struct fill *fill, const struct line *line, double x, double y,
                           double out_direction[3])
{
    const int32_t node = (int32_t)((x + NODE_PX) / NODE_PX) - 1;
    const double t = x / NODE_PX - node;

    if (!line->is_smooth)
        return shef_camera_unproject(fill->camera, x, y, out_direction);
    out_direction[0] = between(line->x + node + 1, t);
    out_direction[1] = between(line->y + node + 1, t);
    return true;
}

/* One of the lines of rays of a row of pixels, in all its tiles. Pixels past the image's edge
 * repeat the last. */
static void fill_rays(const struct fill *fill, int32_t y, int32_t sub_row, struct line *line)
{
    struct sim_ray_grid *grid = fill->grid;
    const int32_t row = y / SIM_TILE_ROWS;
    const int32_t n = fill->supersample;
    const double sub_y = y + (sub_row + .5) / n - .5;

    fill_line(line, fill, sub_y);
    for (int32_t i = 0; i < grid->n_columns * SIM_TRACE_LANES; i++)
        for (int32_t k = 0; k < n; k++) {
            const int32_t x = least(i, grid->width_px - 1);
            const ptrdiff_t tile = (ptrdiff_t)row * grid->n_columns + i / SIM_TRACE_LANES;
            const ptrdiff_t ray = (ptrdiff_t)(y % SIM_TILE_ROWS) * grid->n_subs + sub_row * n + k;
            float *out = grid->rays + tile * (ptrdiff_t)tile_floats(grid) +
                         ray * 2 * SIM_TRACE_LANES + i % SIM_TRACE_LANES;
            double direction[3] = { 0, 0, 1 };

            if (!find_direction(fill, line, x + (k + .5) / n - .5, sub_y, direction)) {
                fill->blind_px[2 * row] = x;
                fill->blind_px[2 * row + 1] = y;
            }
            out[0] = (float)direction[0];
            out[SIM_TRACE_LANES] = (float)direction[1];
            widen(&grid->tiles[tile], out[0], out[SIM_TRACE_LANES]);
        }
}

static void fill_tiles(void *opaque, int32_t row, int32_t worker)
{
    const struct fill *fill = opaque;
    struct sim_ray_grid *grid = fill->grid;
    struct sim_tile_bounds *tiles = grid->tiles + (ptrdiff_t)row * grid->n_columns;
    const int32_t end = least((row + 1) * SIM_TILE_ROWS, grid->height_px);
    struct line line;

    (void)worker;
    fill->blind_px[2 * row] = -1;
    grid->rows[row] = empty;
    for (int32_t column = 0; column < grid->n_columns; column++)
        tiles[column] = empty;
    for (int32_t y = row * SIM_TILE_ROWS; y < end; y++)
        for (int32_t sub_row = 0; sub_row < fill->supersample; sub_row++)
            fill_rays(fill, y, sub_row, &line);
    for (int32_t column = 0; column < grid->n_columns; column++) {
        widen(&grid->rows[row], tiles[column].x[0], tiles[column].y[0]);
        widen(&grid->rows[row], tiles[column].x[1], tiles[column].y[1]);
    }
}

static enum shef_err fill_all(struct fill *fill, struct shef_workers *workers,
                              struct shef_error *err)
{
    const struct sim_ray_grid *grid = fill->grid;

    shef_workers_run(workers, fill_tiles, fill, grid->n_rows);
    for (int32_t row = 0; row < grid->n_rows; row++)
        if (fill->blind_px[2 * row] >= 0)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "view of %d x %d px: the lens model sees nothing at pixel (%d, %d); "
                             "check its distortion",
                             grid->width_px, grid->height_px, fill->blind_px[2 * row],
                             fill->blind_px[2 * row + 1]);
    return SHEF_OK;
}

enum shef_err sim_ray_grid_create(struct sim_ray_grid *out_grid,
                                  const struct sim_view_params *params, int32_t supersample,
                                  struct shef_workers *workers, struct shef_error *err)
{
    struct sim_ray_grid grid = {
        .n_subs = supersample * supersample,
        .n_columns = (params->width_px + SIM_TRACE_LANES - 1) / SIM_TRACE_LANES,
        .n_rows = (params->height_px + SIM_TILE_ROWS - 1) / SIM_TILE_ROWS,
        .width_px = params->width_px,
        .height_px = params->height_px,
    };
    const size_t n_tiles = (size_t)grid.n_columns * (size_t)grid.n_rows;
    struct fill fill = { &grid, &params->camera, supersample, NULL };
    enum shef_err code;

    grid.rays = shef_memory_create(n_tiles, tile_floats(&grid) * sizeof *grid.rays);
    grid.tiles = calloc(n_tiles, sizeof *grid.tiles);
    grid.rows = calloc((size_t)grid.n_rows, sizeof *grid.rows);
    fill.blind_px = calloc((size_t)grid.n_rows, 2 * sizeof *fill.blind_px);
    if (grid.rays && grid.tiles && grid.rows && fill.blind_px)
        code = fill_all(&fill, workers, err);
    else
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "view of %d x %d px: out of memory",
                         params->width_px, params->height_px);
    free(fill.blind_px);
    if (code != SHEF_OK) {
        sim_ray_grid_destroy(&grid);
        return code;
    }
    *out_grid = grid;
    return SHEF_OK;
}

void sim_ray_grid_destroy(struct sim_ray_grid *grid)
{
    free(grid->rays);
    free(grid->tiles);
    free(grid->rows);
    *grid = (struct sim_ray_grid){ 0 };
}

const float *sim_ray_grid_tile(const struct sim_ray_grid *grid, int32_t row, int32_t column,
                               int32_t *out_n_rows)
{
    *out_n_rows = least(SIM_TILE_ROWS, grid->height_px - row * SIM_TILE_ROWS);
    return grid->rays +
           ((size_t)row * (size_t)grid->n_columns + (size_t)column) * tile_floats(grid);
}
