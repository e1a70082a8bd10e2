/* Textures: what a surface sends out, made once and looked up bilinearly.
 *
 * Texels hold the square root of the light in 8 bits, so that dark places have fine steps too; each
 * is stored with the one below it, so that the four of a lookup are one read. A texel is about as
 * large as a camera in the middle of the path can resolve at the surface's nearest point, and its
 * pattern is averaged over what such a camera's pixel covers there, slanted as it is: a fixed
 * texture, without levels that would switch as the camera moves. */
#ifndef SHEFSIM_TEXTURE_H
#define SHEFSIM_TEXTURE_H

#include <stdint.h>

#include "core/error.h"
#include "core/workers.h"
#include "shefsim/description.h"
#include "shefsim/surface.h"

/* What a pixel covers at 1 m: that of the finest camera, f 1301 px, behind a lens that blurs by
 * half a pixel. */
#define SIM_TEXTURE_PIXEL_RAD    (1.5 / 1301)
#define SIM_TEXTURE_MAX_SIDE     8192
#define SIM_TEXTURE_TOTAL_TEXELS 40000000

struct sim_lighting {
    double ambient;
    const struct sim_lamp *const *lamps;
    int32_t n_lamps;
};

/* Fills a surface's texture.
 *   description  for its scales
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_texture_bake(struct sim_surface *surface,
                                               const struct sim_material *material,
                                               const struct sim_description *description,
                                               const struct sim_lighting *lighting,
                                               struct shef_workers *workers,
                                               struct shef_error *err);

/* How much the distance of a flat surface from the middle of the path changes along its x (0) and y
 * (1): the largest by the smallest. */
void sim_texture_spread(const struct sim_surface *surface, double out_spread[2]);

void sim_texture_destroy(struct sim_texture *texture);

/* Light falling on a point with this normal. */
double sim_lighting_irradiance(const struct sim_lighting *lighting, const double point[3],
                               const double normal[3]);

#endif
