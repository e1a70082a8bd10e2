#include "shefsim/view.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "shefsim/view_internal.h"

#define BACKGROUND_SHARE 0.1 /* of the ambient light, where a ray leaves the scene */

struct sim_view {
    const struct sim_scene *scene;
    struct shef_workers *workers;
    const struct sim_trace_kernels *kernels;
    struct sim_ray_grid light; /* N x N rays per pixel */
    struct sim_ray_grid depth; /* one; without memory of its own if N is 1 */
    struct sim_posed_scene posed[SIM_VIEW_MAX_INSTANTS];
    struct sim_tile_lists *lists; /* one per worker */
    int32_t n_lists;
    bool blink_on;
};

/* A picture in the making. */
struct job {
    const struct sim_view *view;
    int32_t n_poses;
    struct shef_image_f32 light;
    struct shef_image_f32 depth;
    struct shef_image_i16 object;
};

static enum shef_err check(const struct sim_view_params *params, struct shef_error *err)
{
    if (params->width_px < 1 || params->width_px > SIM_VIEW_MAX_SIDE_PX || params->height_px < 1 ||
        params->height_px > SIM_VIEW_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID, "view of %d x %d px: sides must be 1 to %d",
                         params->width_px, params->height_px, SIM_VIEW_MAX_SIDE_PX);
    if (params->supersample < 1 || params->supersample > SIM_VIEW_MAX_SUPERSAMPLE)
        return shef_fail(err, SHEF_ERR_INVALID, "view with %d x %d rays per pixel: 1 to %d a side",
                         params->supersample, params->supersample, SIM_VIEW_MAX_SUPERSAMPLE);
    if (!(params->camera.fx_px >= 1 && params->camera.fy_px >= 1))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "view with focal lengths of %g and %g px: they must be 1 or more",
                         params->camera.fx_px, params->camera.fy_px);
    return SHEF_OK;
}

static bool allocate(struct sim_view *view)
{
    const size_t n = (size_t)view->scene->n_surfaces + 1;

    view->lists = calloc((size_t)view->n_lists, sizeof *view->lists);
    if (!view->lists)
        return false;
    for (int32_t i = 0; i < SIM_VIEW_MAX_INSTANTS; i++) {
        view->posed[i].surfaces = calloc(n, sizeof *view->posed[i].surfaces);
        if (!view->posed[i].surfaces)
            return false;
    }
    for (int32_t i = 0; i < view->n_lists; i++) {
        struct sim_tile_lists *lists = &view->lists[i];

        lists->row = calloc(n, sizeof *lists->row);
        lists->tile = calloc(n, sizeof *lists->tile);
        lists->nearest_m = calloc(n, sizeof *lists->nearest_m);
        if (!lists->row || !lists->tile || !lists->nearest_m)
            return false;
    }
    return true;
}

enum shef_err sim_view_create(struct sim_view **out_view, const struct sim_scene *scene,
                              const struct sim_view_params *params, struct shef_workers *workers,
                              uint32_t cpu_features, struct shef_error *err)
{
    enum shef_err code = check(params, err);
    struct sim_view *view;

    if (code != SHEF_OK)
        return code;
    view = calloc(1, sizeof *view);
    if (!view)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "view: out of memory");
    view->scene = scene;
    view->workers = workers;
    view->kernels = sim_trace_pick(cpu_features);
    view->n_lists = workers ? shef_workers_count(workers) : 1;
    view->blink_on = true;
    if (!allocate(view))
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "view: out of memory");
    if (code == SHEF_OK)
        code = sim_ray_grid_create(&view->light, params, params->supersample, workers, err);
    if (code == SHEF_OK && params->supersample > 1)
        code = sim_ray_grid_create(&view->depth, params, 1, workers, err);
    if (code != SHEF_OK) {
        sim_view_destroy(view);
        return code;
    }
    *out_view = view;
    return SHEF_OK;
}

void sim_view_destroy(struct sim_view *view)
{
    if (!view)
        return;
    sim_ray_grid_destroy(&view->light);
    sim_ray_grid_destroy(&view->depth);
    for (int32_t i = 0; i < SIM_VIEW_MAX_INSTANTS; i++)
        free(view->posed[i].surfaces);
    for (int32_t i = 0; view->lists && i < view->n_lists; i++) {
        free(view->lists[i].row);
        free(view->lists[i].tile);
        free(view->lists[i].nearest_m);
    }
    free(view->lists);
    free(view);
}

void sim_view_set_blink(struct sim_view *view, bool on)
{
    view->blink_on = on;
}

static int32_t columns_of(const struct sim_ray_grid *grid, int32_t column)
{
    const int32_t left = grid->width_px - column * SIM_TRACE_LANES;

    return left < SIM_TRACE_LANES ? left : SIM_TRACE_LANES;
}

static void render_tile(const struct job *job, struct sim_tile_lists *lists, int32_t row,
                        int32_t column, float *sums)
{
    const struct sim_view *view = job->view;
    const struct sim_ray_grid *grid = &view->light;
    struct sim_trace_tile tile = {
        .n_subs = grid->n_subs,
        .background = (float)(BACKGROUND_SHARE * view->scene->ambient),
    };

    tile.rays = sim_ray_grid_tile(grid, row, column, &tile.n_rows);
    sim_tile_lists_tile(lists, &grid->tiles[row * grid->n_columns + column], &tile);
    view->kernels->light(&tile, sums);
}

/* A row of tiles: for each pose in turn, so that its lists are made once. */
static void render_row(void *opaque, int32_t row, int32_t worker)
{
    const struct job *job = opaque;
    const struct sim_ray_grid *grid = &job->view->light;
    struct sim_tile_lists *lists = &job->view->lists[worker];
    const float share = 1.0f / (float)(grid->n_subs * job->n_poses);
    float sums[SIM_TILE_ROWS * SIM_TRACE_LANES];
    int32_t n_rows;

    (void)sim_ray_grid_tile(grid, row, 0, &n_rows);
    for (int32_t pose = 0; pose < job->n_poses; pose++) {
        const bool is_last = pose == job->n_poses - 1;

        sim_tile_lists_row(lists, &job->view->posed[pose], &grid->rows[row]);
        for (int32_t column = 0; column < grid->n_columns; column++) {
            const int32_t width = columns_of(grid, column);

            memset(sums, 0, sizeof sums);
            for (int32_t y = 0; pose > 0 && y < n_rows; y++)
                memcpy(sums + y * SIM_TRACE_LANES,
                       shef_row_f32(job->light, row * SIM_TILE_ROWS + y) + column * SIM_TRACE_LANES,
                       (size_t)width * sizeof *sums);
            render_tile(job, lists, row, column, sums);
            for (int32_t y = 0; y < n_rows; y++) {
                float *out =
                    shef_row_f32(job->light, row * SIM_TILE_ROWS + y) + column * SIM_TRACE_LANES;

                for (int32_t x = 0; x < width; x++)
                    out[x] = sums[y * SIM_TRACE_LANES + x] * (is_last ? share : 1);
            }
        }
    }
}

void sim_view_render_exposure(struct sim_view *view, const struct shef_rigid *poses,
                              int32_t n_poses, struct shef_image_f32 out_radiance)
{
    struct job job = { .view = view, .n_poses = n_poses, .light = out_radiance };

    assert(n_poses >= 1 && n_poses <= SIM_VIEW_MAX_INSTANTS);
    assert(out_radiance.width_px == view->light.width_px &&
           out_radiance.height_px == view->light.height_px);
    for (int32_t i = 0; i < n_poses; i++)
        sim_posed_scene_set(&view->posed[i], view->scene, &poses[i], view->blink_on);
    shef_workers_run(view->workers, render_row, &job, view->light.n_rows);
}

void sim_view_render(struct sim_view *view, const struct shef_rigid *t_world_camera,
                     struct shef_image_f32 out_radiance)
{
    sim_view_render_exposure(view, t_world_camera, 1, out_radiance);
}

static const struct sim_ray_grid *depth_grid(const struct sim_view *view)
{
    return view->depth.rays ? &view->depth : &view->light;
}

static void depth_row(void *opaque, int32_t row, int32_t worker)
{
    const struct job *job = opaque;
    const struct sim_ray_grid *grid = depth_grid(job->view);
    struct sim_tile_lists *lists = &job->view->lists[worker];
    float depth_m[SIM_TILE_ROWS * SIM_TRACE_LANES];
    int32_t object[SIM_TILE_ROWS * SIM_TRACE_LANES];

    sim_tile_lists_row(lists, &job->view->posed[0], &grid->rows[row]);
    for (int32_t column = 0; column < grid->n_columns; column++) {
        const int32_t width = columns_of(grid, column);
        struct sim_trace_tile tile = { .n_subs = 1 };

        tile.rays = sim_ray_grid_tile(grid, row, column, &tile.n_rows);
        sim_tile_lists_tile(lists, &grid->tiles[row * grid->n_columns + column], &tile);
        job->view->kernels->depth(&tile, depth_m, object);
        for (int32_t y = 0; y < tile.n_rows; y++) {
            const int32_t at = row * SIM_TILE_ROWS + y;

            memcpy(shef_row_f32(job->depth, at) + column * SIM_TRACE_LANES,
                   depth_m + y * SIM_TRACE_LANES, (size_t)width * sizeof *depth_m);
            for (int32_t x = 0; job->object.data && x < width; x++)
                shef_row_i16(job->object, at)[column * SIM_TRACE_LANES + x] =
                    (int16_t)object[y * SIM_TRACE_LANES + x];
        }
    }
}

void sim_view_depth(struct sim_view *view, const struct shef_rigid *t_world_camera,
                    struct shef_image_f32 out_depth_m, struct shef_image_i16 out_object_id)
{
    struct job job = { .view = view, .n_poses = 1, .depth = out_depth_m, .object = out_object_id };

    assert(out_depth_m.width_px == view->light.width_px &&
           out_depth_m.height_px == view->light.height_px);
    sim_posed_scene_set(&view->posed[0], view->scene, t_world_camera, view->blink_on);
    shef_workers_run(view->workers, depth_row, &job, depth_grid(view)->n_rows);
}
