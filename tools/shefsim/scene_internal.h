/* A scene's content, for the files that make, see and export it. */
#ifndef SHEFSIM_SCENE_INTERNAL_H
#define SHEFSIM_SCENE_INTERNAL_H

#include "shefsim/description.h"
#include "shefsim/scene.h"
#include "shefsim/surface.h"
#include "shefsim/texture.h"

#define SIM_SURFACES_PER_OBJECT 6

struct sim_scene {
    struct sim_description *description; /* owned */
    struct sim_surface *surfaces;        /* with their textures, owned */
    int32_t n_surfaces;
    struct sim_lamp brightest; /* whose highlights are seen on glossy materials */
    double ambient;
};

/* The surfaces of an object, without textures, those left out that no camera near the path sees:
 * undersides, and sides that face away.
 *   out_surfaces  room for SIM_SURFACES_PER_OBJECT
 * Returns how many there are. */
int32_t sim_object_surfaces(const struct sim_object *object, int32_t number,
                            const struct sim_material *material, struct sim_surface *out_surfaces);

/* How far a point is from the box around an object; 0 inside. */
double sim_object_clearance_m(const struct sim_object *object, const double point_m[3]);

#endif
