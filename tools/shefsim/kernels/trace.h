/* Casts the rays of one tile of a view against the surfaces that may be in it.
 *
 * A tile is SIM_TRACE_LANES pixels wide. Rays are directions with z = 1 in camera axes, so that the
 * distance along a ray is the depth. Surfaces come prepared for one pose of the camera: everything
 * that is linear in the ray's direction as three factors of (x, y, 1). Every implementation gives
 * the same bits: only + - * / sqrt, comparisons and roundings, in the same order. */
#ifndef SHEFSIM_KERNELS_TRACE_H
#define SHEFSIM_KERNELS_TRACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "shefsim/surface.h"

#define SIM_TRACE_LANES      16
#define SIM_TRACE_NEAREST_M  0.02f
#define SIM_TRACE_FARTHEST_M 1e6f
#define SIM_TRACE_NOTHING    (-1)

struct sim_trace_surface {
    enum sim_surface_kind kind;
    int32_t object;
    /* Flat surfaces: 1 / depth, and texture coordinates in texels divided by depth. */
    float inverse_depth[3];
    float u[3];
    float v[3];
    /* Curved surfaces: the ray's direction and the camera in local coordinates; clip of l_y. */
    float local[3][3];
    float origin[3];
    float clip[2];
    /* Texture. */
    const uint16_t *pairs; /* of texels, see struct sim_texture */
    int32_t pitch;         /* pairs per row */
    int32_t last_u;        /* the last square's column and row */
    int32_t last_v;
    float max_u; /* the last texel's column and row */
    float max_v;
    float light; /* of texel 1 */
    /* Highlights: the ray's direction in world axes, the lamp, the normal as factors of the local
     * coordinates. */
    float gloss; /* light at its middle from a lamp 1 m away, 0: none */
    int32_t sharpness;
    float world[3][3];
    float lamp[3]; /* from the camera */
    float normal[3][3];
};

struct sim_trace_tile {
    /* Row by row: for each of n_subs rays per pixel 16 x, then 16 y. */
    const float *rays;
    int32_t n_rows;
    int32_t n_subs;
    /* The surfaces, near ones first. */
    const struct sim_trace_surface *const *surfaces;
    int32_t n_surfaces;
    bool is_covered;  /* there is one surface, flat, without a highlight, and it fills the tile */
    float background; /* light where nothing is hit */
};

struct sim_trace_kernels {
    const char *name;
    uint32_t cpu_features;
    /* Adds the light of all rays of each pixel.
     *   sum  n_rows of 16 values, one after another */
    void (*light)(const struct sim_trace_tile *tile, float *sum);
    /* Depth and object per pixel, for tiles of one ray per pixel; 0 and SIM_TRACE_NOTHING where
     * there is nothing. */
    void (*depth)(const struct sim_trace_tile *tile, float *out_depth_m, int32_t *out_object);
};

extern const struct sim_trace_kernels sim_trace_kernels_c;
extern const struct sim_trace_kernels sim_trace_kernels_avx2;
extern const struct sim_trace_kernels sim_trace_kernels_avx512;
extern const struct sim_trace_kernels sim_trace_kernels_neon;

/* The best for these features. */
const struct sim_trace_kernels *sim_trace_pick(uint32_t cpu_features);

#endif
