/* Which pairs belong to which scene, for figures per scene and for leaving scenes out in turn.
 *
 * In this order: a file scenes.json in the data folder says it; or the numbers are those of the
 * authors' data set (1-49 complex boxes, 50-98 picnic, 99-147 simple boxes, and none above 147);
 * or all pairs are one scene called "all". Thread: any. */
#ifndef SHEFTOOL_SCENES_H
#define SHEFTOOL_SCENES_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "sheftool/option.h"
#include "sheftool/pair_list.h"

#define SHEF_MAX_SCENES       16
#define SHEF_SCENE_NAME_BYTES 48

struct shef_scene {
    char name[SHEF_SCENE_NAME_BYTES];
    int64_t first, last; /* pair numbers, both included */
};

struct shef_scenes {
    struct shef_scene at[SHEF_MAX_SCENES];
    int32_t n;
    double focal_px;    /* of the rectified maps; 0: not said */
    double baseline_mm; /* 0: not said */
    bool is_synthetic;  /* made by `sheftool synth` */
    int64_t seed;       /* of synthetic pairs */
};

/* The authors' rig: what is taken where nothing else is said. */
#define SHEF_AUTHORS_FOCAL_PX    1301.0
#define SHEF_AUTHORS_BASELINE_MM 65.44

/* Finds the scenes of some pairs; scenes without a pair are left out.
 *   folder  where scenes.json may lie: {"scenes": [{"name": "...", "first": 1, "last": 16}, ...]},
 *           optionally with "focal_px" and "baseline_mm" of the rig
 * SHEF_ERR_FORMAT: the file is there but is not that; or a pair belongs to no or to two scenes. */
SHEF_MUST_CHECK enum shef_err shef_scenes_find(struct shef_scenes *out_scenes, const char *folder,
                                               const struct shef_numbered_list *pairs,
                                               struct shef_error *err);

/* Reads the content of a scenes.json.
 *   path  for the sentence
 * SHEF_ERR_FORMAT: out_scenes is untouched. */
SHEF_MUST_CHECK enum shef_err shef_scenes_parse(struct shef_scenes *out_scenes, const char *bytes,
                                                size_t n_bytes, const char *path,
                                                struct shef_error *err);

/* The scene of a pair, 0..n-1. The pair must be one of those given to find(). */
int32_t shef_scenes_of(const struct shef_scenes *scenes, int64_t number);

/* The rig: what the user gave, else what scenes.json says, else the authors'.
 *   given  0: nothing */
double shef_scenes_focal_px(const struct shef_scenes *scenes, double given_px);
double shef_scenes_baseline_mm(const struct shef_scenes *scenes, double given_mm);

/* The options behind `given`: fields focal_px and baseline_mm of a command's settings. */
#define SHEF_SCENES_RIG_OPTIONS(type_)                                                             \
    SHEF_OPT_REAL(                                                                                 \
        "focal", type_, focal_px, NULL, 1, 100000, "px",                                           \
        "focal length of the maps, for depth errors (default: scenes.json's, else 1301)"),         \
        SHEF_OPT_REAL("baseline", type_, baseline_mm, NULL, 0.001, 100000, "mm",                   \
                      "distance of the cameras, for depth errors (default: scenes.json's, else "   \
                      "65.44)")

/* The scenes' part of a scenes.json; NULL if out of memory. */
json_t *shef_scenes_json(const struct shef_scenes *scenes);

#endif
