/* Surfaces: the exact shapes that objects are made of.
 *
 * A point of a surface has local coordinates l with X = centre + sum of l_i axis_i; the axes are
 * perpendicular and as long as half of the surface's extent. */
#ifndef SHEFSIM_SURFACE_H
#define SHEFSIM_SURFACE_H

#include <stdbool.h>
#include <stdint.h>

enum sim_surface_kind {
    SIM_SURFACE_QUAD,      /* l_x, l_y within +-1, l_z = 0; its outside is where l_z > 0 */
    SIM_SURFACE_DISC,      /* the same, and l_x^2 + l_y^2 <= 1 */
    SIM_SURFACE_ELLIPSOID, /* |l| = 1, l_y within the clip */
    SIM_SURFACE_CYLINDER,  /* l_x^2 + l_z^2 = 1, l_y within the clip */
};

/* Light per unit of texture: see texture.h. */
struct sim_texture {
    /* height rows of width + 1 pairs: a texel and, in the upper byte, the one below it */
    uint16_t *pairs;
    uint16_t *inverse; /* of blinking surfaces: the other phase; else NULL */
    int32_t width;     /* squares between four texels; texels are one more */
    int32_t height;
    float scale; /* light = (scale * texel)^2 */
};

struct sim_surface {
    enum sim_surface_kind kind;
    int32_t object;
    double centre[3];
    double axis[3][3];
    double clip[2];    /* of l_y, of curved surfaces */
    bool one_sided;    /* part of a closed body: seen from outside only */
    double gloss;      /* reflectance of the highlight at its middle, 0: none */
    int32_t sharpness; /* the highlight is cos^(2^sharpness) of the half angle */
    /* Flat surfaces may be parts of a larger one, so that each has texels of its own size: what
     * part of it, in texture coordinates. */
    double part_start[2];
    double part_size[2]; /* 1 for a whole surface */
    uint64_t seed;       /* of the pattern */
    struct sim_texture texture;
};

/* X = centre + sum of l_i axis_i. */
void sim_surface_point(const struct sim_surface *surface, const double local[3],
                       double out_point[3]);

/* The outward normal there, of length 1. */
void sim_surface_normal(const struct sim_surface *surface, const double local[3],
                        double out_normal[3]);

/* The local coordinates of a world point. */
void sim_surface_local(const struct sim_surface *surface, const double point[3],
                       double out_local[3]);

/* Cuts a quadrilateral in two along local x (0) or y (1): out_second becomes the half of the
 * larger coordinates, surface the other. */
void sim_surface_cut(struct sim_surface *surface, int along, struct sim_surface *out_second);

/* Texture coordinates run over [0, 1] in both directions. Flat: l_x and l_y. Cylinder: around the
 * axis by |l_x| + |l_z| = 1 instead of an angle, and l_y. Ellipsoid: the octahedron |x| + |y| +
 * |z| = 1 unfolded, its upper half (l_y < 0) in the middle. Coordinates a little outside wrap. */
void sim_surface_at(const struct sim_surface *surface, double u, double v, double out_local[3]);

#endif
