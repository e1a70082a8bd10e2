#include <stdlib.h>

#include "core/memory.h"
#include "shefsim/view_internal.h"

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

/* The rays of one row of pixels within a tile. Pixels past the image's edge repeat the last. */
static void fill_row(const struct fill *fill, int32_t y, int32_t column, float *out_rays)
{
    struct sim_ray_grid *grid = fill->grid;
    const int32_t row = y / SIM_TILE_ROWS;
    struct sim_tile_bounds *bounds = grid->tiles + (ptrdiff_t)row * grid->n_columns + column;
    const double n = fill->supersample;

    for (int32_t k = 0; k < grid->n_subs; k++)
        for (int32_t i = 0; i < SIM_TRACE_LANES; i++) {
            const int32_t x = least(column * SIM_TRACE_LANES + i, grid->width_px - 1);
            const double sub_x = (k % fill->supersample + .5) / n - .5;
            const double sub_y = ((double)(k / fill->supersample) + .5) / n - .5;
            double direction[3] = { 0, 0, 1 };

            if (!shef_camera_unproject(fill->camera, x + sub_x, y + sub_y, direction)) {
                fill->blind_px[2 * row] = x;
                fill->blind_px[2 * row + 1] = y;
            }
            out_rays[2 * SIM_TRACE_LANES * k + i] = (float)direction[0];
            out_rays[2 * SIM_TRACE_LANES * k + SIM_TRACE_LANES + i] = (float)direction[1];
            widen(bounds, (float)direction[0], (float)direction[1]);
        }
}

static void fill_tiles(void *opaque, int32_t row, int32_t worker)
{
    const struct fill *fill = opaque;
    struct sim_ray_grid *grid = fill->grid;
    const size_t row_floats = (size_t)grid->n_subs * 2 * SIM_TRACE_LANES;
    const int32_t end = least((row + 1) * SIM_TILE_ROWS, grid->height_px);

    (void)worker;
    fill->blind_px[2 * row] = -1;
    grid->rows[row] = empty;
    for (int32_t column = 0; column < grid->n_columns; column++) {
        const ptrdiff_t tile = (ptrdiff_t)row * grid->n_columns + column;
        float *rays = grid->rays + (size_t)tile * tile_floats(grid);

        grid->tiles[tile] = empty;
        for (int32_t y = row * SIM_TILE_ROWS; y < end; y++, rays += row_floats)
            fill_row(fill, y, column, rays);
        widen(&grid->rows[row], grid->tiles[tile].x[0], grid->tiles[tile].y[0]);
        widen(&grid->rows[row], grid->tiles[tile].x[1], grid->tiles[tile].y[1]);
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
