/* The arm's paths: where the camera is at any time.
 *
 * A path is a closed curve about a point of the world, 15 cm wide as a rule, that the camera
 * follows without turning, round after round, at constant speed; a square's corners are rounded.
 * The straight lines go there and back, at first in the direction that their name says, and slow
 * down over the last centimetre before they turn. Everything is a function of the time alone, from
 * + - * / and sqrt: the same bytes on every machine. Read-only after create. Thread: any. */
#ifndef SHEFSIM_PATH_H
#define SHEFSIM_PATH_H

#include <stdint.h>

#include "calib/rigid.h"
#include "core/error.h"
#include "shefsim/scene.h"

#define SIM_PATH_SIZE_M 0.15

struct sim_path;

struct sim_path_params {
    const char *name;   /* one of sim_path_names() */
    double size_m;      /* width of the curve, 0.03..1 */
    double speed_m_s;   /* 0.001..1 */
    double tilt_deg;    /* of the curve's plane about the x axis: its top farther away, -85..85 */
    double phase;       /* where on the curve it starts, 0..1; lines start at their end */
    double centre_m[3]; /* of the curve, in the world */
};

/* In a list that NULL ends: square, circle, lissajous-a (1:2), -b (3:2), -c (3:4), line-left,
 * line-right, line-up, line-down. */
const char *const *sim_path_names(void);

/* Thread: setup.
 * SHEF_ERR_INVALID: no such path, or a value out of range. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_path_create(struct sim_path **out_path,
                                              const struct sim_path_params *params,
                                              struct shef_error *err);

/* NULL is allowed. */
void sim_path_destroy(struct sim_path *path);

/* Length and duration of one round. */
double sim_path_round_m(const struct sim_path *path);
double sim_path_round_s(const struct sim_path *path);

/* The camera at a time, 0 or later: T_world_camera, and its velocity in m/s in world axes. */
struct shef_rigid sim_path_pose(const struct sim_path *path, int64_t t_ns);
void sim_path_velocity(const struct sim_path *path, int64_t t_ns, double out_m_s[3]);

/* Where the arm's base stands in the world, T_world_base: a UR5 on a bench, 0.45 m behind and
 * 0.35 m below the middle of the path; the base's x is forward, y left, z up. */
struct shef_rigid sim_path_base(void);

/* Whether the arm can take the camera along the path without touching the scene: all of it within
 * the UR5's reach (0.85 m about the shoulder, 0.15 m or more from the base's axis), 0.10 m or more
 * from any object.
 *   scene  NULL: only the reach
 * SHEF_ERR_INVALID with a sentence if not. */
SHEF_MUST_CHECK enum shef_err sim_path_check(const struct sim_path *path,
                                             const struct sim_scene *scene, struct shef_error *err);

#endif
