/* How a view is cut into tiles, and what it prepares per pose. */
#ifndef SHEFSIM_VIEW_INTERNAL_H
#define SHEFSIM_VIEW_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "shefsim/kernels/trace.h"
#include "shefsim/scene_internal.h"
#include "shefsim/view.h"

#define SIM_TILE_ROWS 16

/* The directions of a tile's rays: x / z and y / z. */
struct sim_tile_bounds {
    float x[2];
    float y[2];
};

/* A view's rays for N x N per pixel. */
struct sim_ray_grid {
    float *rays; /* tile by tile, see struct sim_trace_tile */
    struct sim_tile_bounds *tiles;
    struct sim_tile_bounds *rows; /* of tiles, all of a row together */
    int32_t n_subs;
    int32_t n_columns; /* tiles */
    int32_t n_rows;
    int32_t width_px;
    int32_t height_px;
};

/* SHEF_ERR_INVALID: a ray that the lens does not see. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_ray_grid_create(struct sim_ray_grid *out_grid,
                                                  const struct sim_view_params *params,
                                                  int32_t supersample, struct shef_workers *workers,
                                                  struct shef_error *err);

/* A zeroed grid is allowed. */
void sim_ray_grid_destroy(struct sim_ray_grid *grid);

/* The rays of a tile, and how many rows of pixels it has. */
const float *sim_ray_grid_tile(const struct sim_ray_grid *grid, int32_t row, int32_t column,
                               int32_t *out_n_rows);

/* A surface as one pose sees it. */
struct sim_posed_surface {
    struct sim_trace_surface trace;
    float x[2]; /* bounds of its rays' directions */
    float y[2];
    float nearest_m;
    bool is_flat; /* and a quadrilateral: it can fill a tile */
};

/* All surfaces in front of a camera, near ones first. */
struct sim_posed_scene {
    struct sim_posed_surface *surfaces; /* room for all of the scene's */
    int32_t n_surfaces;
};

/* Prepares a scene for one pose.   blink_on  see sim_view_set_blink() */
void sim_posed_scene_set(struct sim_posed_scene *posed, const struct sim_scene *scene,
                         const struct shef_rigid *t_world_camera, bool blink_on);

/* Scratch memory of one worker. */
struct sim_tile_lists {
    const struct sim_posed_surface **row; /* room for all surfaces each */
    const struct sim_trace_surface **tile;
    float *nearest_m;
    int32_t n_row;
};

/* The surfaces that may be in a row of tiles, then in one tile of that row. The second fills the
 * fields of a tile that say what it sees; they stay valid until the next call. */
void sim_tile_lists_row(struct sim_tile_lists *lists, const struct sim_posed_scene *posed,
                        const struct sim_tile_bounds *bounds);
void sim_tile_lists_tile(struct sim_tile_lists *lists, const struct sim_tile_bounds *bounds,
                         struct sim_trace_tile *tile);

#endif
