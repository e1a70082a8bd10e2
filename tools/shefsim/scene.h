/* Scenes: what the simulated cameras look at.
 *
 * World axes W are those of a camera in the middle of the path: x right, y down, z forward, in
 * metres; nothing moves. A scene is a list of surfaces, each with its texture, in which the light
 * is already included: what a surface sends out does not depend on where it is seen from, except
 * for highlights on glossy materials. Textures hold no more detail than a camera in the middle of
 * the path could see, so that nothing flickers.
 *
 * Scenes come from files that people write, see docs/scenes.md; the built-in ones are such files
 * too. The seed changes the textures, never the layout. The same file, light and seed give the same
 * bytes on every machine and for any number of workers. Read-only after it is made: any number of
 * views and threads can use one scene. */
#ifndef SHEFSIM_SCENE_H
#define SHEFSIM_SCENE_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"

struct sim_scene;

struct sim_scene_options {
    const char *light;            /* "day" or "night"; a scene file may name others */
    uint64_t seed;                /* of the textures */
    struct shef_workers *workers; /* may be NULL; used while the scene is made */
};

/* The built-in scenes' names in a list that NULL ends. */
const char *const *sim_scene_names(void);

/* Makes a scene.                                                   Thread: setup.
 *   name_or_path  a built-in scene's name, else a scene file
 * SHEF_ERR_NOT_FOUND: neither. SHEF_ERR_FORMAT: the file breaks a rule; the sentence says where and
 * which. SHEF_ERR_INVALID: no such light. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_scene_open(struct sim_scene **out_scene, const char *name_or_path,
                                             const struct sim_scene_options *options,
                                             struct shef_error *err);

/* sim_scene_open() for one kind of name only. */
SHEF_MUST_CHECK enum shef_err sim_scene_builtin(struct sim_scene **out_scene, const char *name,
                                                const struct sim_scene_options *options,
                                                struct shef_error *err);
SHEF_MUST_CHECK enum shef_err sim_scene_read(struct sim_scene **out_scene, const char *path,
                                             const struct sim_scene_options *options,
                                             struct shef_error *err);

/* NULL is allowed. */
void sim_scene_destroy(struct sim_scene *scene);

/* As the file names it, for reports. */
const char *sim_scene_name(const struct sim_scene *scene);

/* Objects are counted from 0 in the order of the file. */
int32_t sim_scene_n_objects(const struct sim_scene *scene);
const char *sim_scene_object_name(const struct sim_scene *scene, int32_t object);

/* The colour of an object's material: three factors, mean 1, for grey light. Multiply radiance by
 * them for the red, green and blue pixels of a colour camera. */
void sim_scene_object_tint(const struct sim_scene *scene, int32_t object, float out_rgb[3]);

/* How far a point is from the nearest object, or rather from the box around it; 0 inside.
 *   out_object  that object; may be NULL */
double sim_scene_clearance_m(const struct sim_scene *scene, const double point_m[3],
                             int32_t *out_object);

#endif
