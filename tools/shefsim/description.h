/* A scene as a file describes it: see docs/scenes.md for every field. */
#ifndef SHEFSIM_DESCRIPTION_H
#define SHEFSIM_DESCRIPTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

enum sim_shape {
    SIM_SHAPE_BOX,
    SIM_SHAPE_ELLIPSOID,
    SIM_SHAPE_CYLINDER,
    SIM_SHAPE_CUP,   /* a cylinder without its upper end */
    SIM_SHAPE_BOWL,  /* the lower half of an ellipsoid */
    SIM_SHAPE_DISC,  /* flat, facing up */
    SIM_SHAPE_FLOOR, /* a rectangle facing up */
    SIM_SHAPE_WALL,  /* a rectangle facing the camera */
};

enum sim_pattern {
    SIM_PATTERN_PLAIN,
    SIM_PATTERN_CELLS,
    SIM_PATTERN_BLOBS,
    SIM_PATTERN_CARPET,
    SIM_PATTERN_STRIPES,
    SIM_PATTERN_MARKER,
    SIM_PATTERN_CHECKER,
};

struct sim_material {
    char *name;
    enum sim_pattern pattern;
    double albedo;   /* mean reflectance, 0.02..0.95 */
    double contrast; /* of ln(albedo), about its largest swing to either side, 0..3 */
    double cell_mm;  /* side of the largest cells, 1..2000 */
    double colour[3];
    double gloss;      /* 0..10 */
    int32_t sharpness; /* 1..8 */
    bool blink;
};

struct sim_object {
    char *name;
    enum sim_shape shape;
    char *material;
    double position_m[3]; /* the middle of the underside */
    double size_m[3];     /* along x, y and z, before it is turned */
    double yaw_deg;       /* about the vertical; its front turns to the right */
    double tilt_deg;      /* about its own x axis, before the yaw; its top leans back */
};

struct sim_lamp {
    char *name; /* of the lighting it belongs to: "day" */
    double position_m[3];
    double power; /* irradiance at 1 m, straight on; 1.0 = full light */
};

struct sim_ambient {
    char *name;
    double level; /* irradiance from everywhere */
};

struct sim_description {
    char *name;
    double contrast_scale; /* of all materials */
    double cell_scale;
    struct sim_material *materials;
    uint32_t n_materials;
    struct sim_object *objects;
    uint32_t n_objects;
    struct sim_ambient *lights; /* the lightings */
    uint32_t n_lights;
    struct sim_lamp *lamps;
    uint32_t n_lamps;
};

/* Reads and checks a description.
 *   label  what sentences call the text: its path
 * SHEF_ERR_FORMAT: the sentence names label, line and reason. SHEF_ERR_NO_MEMORY.
 * sim_description_free() gives it back. */
SHEF_MUST_CHECK enum shef_err sim_description_parse(struct sim_description **out_description,
                                                    const char *label, const uint8_t *text,
                                                    size_t n_bytes, struct shef_error *err);

/* NULL is allowed. */
void sim_description_free(struct sim_description *description);

/* The material an object names; the description was checked. */
const struct sim_material *sim_description_material(const struct sim_description *description,
                                                    const struct sim_object *object);

#endif
