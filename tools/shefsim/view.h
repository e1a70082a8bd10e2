/* What a camera sees of a scene: light, depth, objects.
 *
 * Every sample is one ray, cast through the lens model against the exact surfaces. The result is a
 * function of scene, camera and pose: the same bytes for any number of workers and any instruction
 * set. A view belongs to one thread at a time; nothing is allocated after create. */
#ifndef SHEFSIM_VIEW_H
#define SHEFSIM_VIEW_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/camera_model.h"
#include "calib/rigid.h"
#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "shefsim/scene.h"

#define SIM_VIEW_MAX_SIDE_PX     4096
#define SIM_VIEW_MAX_SUPERSAMPLE 4
#define SIM_VIEW_MAX_INSTANTS    16
#define SIM_VIEW_NO_OBJECT       (-1)

struct sim_view;

struct sim_view_params {
    int32_t width_px; /* 1..SIM_VIEW_MAX_SIDE_PX */
    int32_t height_px;
    struct shef_camera_model camera;
    int32_t supersample; /* N x N rays per pixel on a regular grid, 1..SIM_VIEW_MAX_SUPERSAMPLE */
};

/* Prepares a view.                                                 Thread: setup.
 *   scene, workers  kept, not owned; workers may be NULL
 *   cpu_features    shef_cpu_features(), or less
 * SHEF_ERR_INVALID: a size or lens out of range; every pixel must see something.
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_view_create(struct sim_view **out_view,
                                              const struct sim_scene *scene,
                                              const struct sim_view_params *params,
                                              struct shef_workers *workers, uint32_t cpu_features,
                                              struct shef_error *err);

/* NULL is allowed. */
void sim_view_destroy(struct sim_view *view);

/* Which phase blinking surfaces show from now on: true (as created) their texture, false the
 * inverse one. */
void sim_view_set_blink(struct sim_view *view, bool on);

/* The light that reaches each pixel: linear, the mean over its rays, 1.0 = white at full light.
 *   t_world_camera  the camera's pose
 *   out_radiance    an image of the view's size */
void sim_view_render(struct sim_view *view, const struct shef_rigid *t_world_camera,
                     struct shef_image_f32 out_radiance);

/* The same, as the mean over an exposure: one pass over several instants, quicker than as many
 * calls. Exactly sim_view_render() for one.
 *   poses  n_poses of them, 1..SIM_VIEW_MAX_INSTANTS */
void sim_view_render_exposure(struct sim_view *view, const struct shef_rigid *poses,
                              int32_t n_poses, struct shef_image_f32 out_radiance);

/* What the middle of each pixel sees.
 *   out_depth_m    distance along the camera's axis; 0 where there is nothing
 *   out_object_id  the object's number, or SIM_VIEW_NO_OBJECT; .data may be NULL */
void sim_view_depth(struct sim_view *view, const struct shef_rigid *t_world_camera,
                    struct shef_image_f32 out_depth_m, struct shef_image_i16 out_object_id);

#endif
