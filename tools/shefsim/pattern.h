/* Patterns: ln(reflectance) as a function of the place on a surface, from integer hashes.
 *
 * Like natural images they have contrast at every scale: large cells with sharp borders, smaller
 * ones inside, fine grain. Detail smaller than the footprint fades to its mean. */
#ifndef SHEFSIM_PATTERN_H
#define SHEFSIM_PATTERN_H

#include <stdbool.h>
#include <stdint.h>

#include "shefsim/description.h"

#define SIM_PATTERN_SEEDS 27

/* The seeds around the last place that was asked for, of one layer of cells. Zeroed: of none. */
struct sim_pattern_layer {
    uint64_t seed;
    double cell_m;
    double corner[3];
    double at[3][SIM_PATTERN_SEEDS]; /* x, y and z of the seeds, from the corner, in cells */
    uint64_t key[SIM_PATTERN_SEEDS];
};

#define SIM_PATTERN_LAYERS 4

/* What places beside one another need again. Changes no value. One thread at a time. */
struct sim_pattern_memory {
    struct sim_pattern_layer layers[SIM_PATTERN_LAYERS];
};

/* A place and what one pixel covers there. */
struct sim_pattern_place {
    double position_m[3]; /* flat patterns use the first two */
    double extent_m[2];   /* of the surface, for patterns that fit it */
    double footprint_m[2];
    double largest_m; /* of the footprint */
    bool solid;       /* the pattern fills space, for surfaces that are round */
    struct sim_pattern_memory *memory;
};

/* ln(reflectance / mean), not scaled by the contrast: mostly within +-1. */
double sim_pattern_value(enum sim_pattern pattern, double cell_m, uint64_t seed,
                         const struct sim_pattern_place *place);

#endif
