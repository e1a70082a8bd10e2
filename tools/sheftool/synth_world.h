/* A world of textured walls and boxes, seen by a pinhole camera: what synthetic pairs are made of.
 *
 * Axes x right, y down, z forward; metres. A ray hits the nearest surface, so occlusion is exact.
 * Brightness is a function of the place on the surface, so both cameras see the same texture.
 * Everything follows from the seed. Thread: any; a world is read-only once made. */
#ifndef SHEFTOOL_SYNTH_WORLD_H
#define SHEFTOOL_SYNTH_WORLD_H

#include <stdint.h>

#define SHEF_SYNTH_MAX_BOXES 16

/* A box turned about the vertical axis. */
struct shef_synth_box {
    double centre_m[3];
    double half_m[3];
    double cos_yaw, sin_yaw;
};

struct shef_synth_world {
    uint64_t seed;
    /* The wall behind everything: z = wall_m[0] + wall_m[1] x + wall_m[2] y. */
    double wall_m[3];
    struct shef_synth_box boxes[SHEF_SYNTH_MAX_BOXES];
    int32_t n_boxes;
};

enum shef_synth_kind {
    SHEF_SYNTH_WALL,    /* a slanted wall and two boxes */
    SHEF_SYNTH_BOXES,   /* five large boxes before a wall */
    SHEF_SYNTH_CLUTTER, /* twelve small ones at all depths */
    SHEF_SYNTH_N_KINDS,
};

struct shef_synth_world shef_synth_world_make(enum shef_synth_kind kind, uint64_t seed);

struct shef_synth_hit {
    double depth_m;    /* along z */
    double brightness; /* 0..1 */
};

/* Follows a ray from `from_m` along `direction` (direction[2] = 1). It always hits something:
 * the wall has no end. */
struct shef_synth_hit shef_synth_world_look(const struct shef_synth_world *world,
                                            const double from_m[3], const double direction[3]);

/* Repeatable noise in 0..1 from a seed and a place. */
double shef_synth_hash(uint64_t seed, int64_t x, int64_t y);

/* Smooth repeatable noise in 0..1 with cells of size 1. */
double shef_synth_noise(uint64_t seed, double x, double y);

#endif
