/* Patterns: ln(reflectance) as a function of the place on a surface, from integer hashes.
 *
 * Like natural images they have contrast at every scale: large cells with sharp borders, smaller
 * ones inside, fine grain. Detail smaller than the footprint fades to its mean. */
#ifndef SHEFSIM_PATTERN_H
#define SHEFSIM_PATTERN_H

#include <stdbool.h>
#include <stdint.h>

#include "shefsim/description.h"

/* A place and what one pixel covers there. */
struct sim_pattern_place {
    double position_m[3]; /* flat patterns use the first two */
    double extent_m[2];   /* of the surface, for patterns that fit it */
    double footprint_m[2];
    double largest_m; /* of the footprint */
    bool solid;       /* the pattern fills space, for surfaces that are round */
};

/* ln(reflectance / mean), not scaled by the contrast: mostly within +-1. */
double sim_pattern_value(enum sim_pattern pattern, double cell_m, uint64_t seed,
                         const struct sim_pattern_place *place);

#endif
