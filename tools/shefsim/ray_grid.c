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

/* The rays of one row of pixels within a tile. Pixels past the image's edge repeat the last. */
static enum shef_err fill_row(struct sim_ray_grid *grid, const struct sim_view_params *params,
                              int32_t supersample, int32_t y, int32_t column, float *out_rays,
                              struct shef_error *err)
{
    struct sim_tile_bounds *bounds =
        grid->tiles + (size_t)(y / SIM_TILE_ROWS) * (size_t)grid->n_columns + column;

    for (int32_t k = 0; k < grid->n_subs; k++)
        for (int32_t i = 0; i < SIM_TRACE_LANES; i++) {
            const int32_t x = least(column * SIM_TRACE_LANES + i, grid->width_px - 1);
            const double sub_x = (k % supersample + .5) / supersample - .5;
            const double sub_y = (double)(k / supersample) / supersample + .5 / supersample - .5;
            double direction[3];

            if (!shef_camera_unproject(&params->camera, x + sub_x, y + sub_y, direction))
                return shef_fail(err, SHEF_ERR_INVALID,
                                 "view of %d x %d px: the lens model sees nothing at pixel "
                                 "(%d, %d); check its distortion",
                                 grid->width_px, grid->height_px, x, y);
            out_rays[2 * SIM_TRACE_LANES * k + i] = (float)direction[0];
            out_rays[2 * SIM_TRACE_LANES * k + SIM_TRACE_LANES + i] = (float)direction[1];
            widen(bounds, (float)direction[0], (float)direction[1]);
        }
    return SHEF_OK;
}

static enum shef_err fill(struct sim_ray_grid *grid, const struct sim_view_params *params,
                          int32_t supersample, struct shef_error *err)
{
    const size_t row_floats = (size_t)grid->n_subs * 2 * SIM_TRACE_LANES;
    enum shef_err code = SHEF_OK;

    for (int32_t t = 0; t < grid->n_rows * grid->n_columns; t++)
        grid->tiles[t] = empty;
    for (int32_t y = 0; code == SHEF_OK && y < grid->height_px; y++)
        for (int32_t column = 0; code == SHEF_OK && column < grid->n_columns; column++) {
            const size_t tile =
                (size_t)(y / SIM_TILE_ROWS) * (size_t)grid->n_columns + (size_t)column;

            code = fill_row(grid, params, supersample, y, column,
                            grid->rays + tile * tile_floats(grid) +
                                (size_t)(y % SIM_TILE_ROWS) * row_floats,
                            err);
        }
    for (int32_t r = 0; r < grid->n_rows; r++) {
        grid->rows[r] = empty;
        for (int32_t c = 0; c < grid->n_columns; c++) {
            const struct sim_tile_bounds *tile = &grid->tiles[r * grid->n_columns + c];

            widen(&grid->rows[r], tile->x[0], tile->y[0]);
            widen(&grid->rows[r], tile->x[1], tile->y[1]);
        }
    }
    return code;
}

enum shef_err sim_ray_grid_create(struct sim_ray_grid *out_grid,
                                  const struct sim_view_params *params, int32_t supersample,
                                  struct shef_error *err)
{
    struct sim_ray_grid grid = {
        .n_subs = supersample * supersample,
        .n_columns = (params->width_px + SIM_TRACE_LANES - 1) / SIM_TRACE_LANES,
        .n_rows = (params->height_px + SIM_TILE_ROWS - 1) / SIM_TILE_ROWS,
        .width_px = params->width_px,
        .height_px = params->height_px,
    };
    const size_t n_tiles = (size_t)grid.n_columns * (size_t)grid.n_rows;
    enum shef_err code;

    grid.rays = shef_memory_create(n_tiles, tile_floats(&grid) * sizeof *grid.rays);
    grid.tiles = calloc(n_tiles, sizeof *grid.tiles);
    grid.rows = calloc((size_t)grid.n_rows, sizeof *grid.rows);
    if (grid.rays && grid.tiles && grid.rows)
        code = fill(&grid, params, supersample, err);
    else
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "view of %d x %d px: out of memory",
                         params->width_px, params->height_px);
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
