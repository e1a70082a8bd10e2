/* A scene as triangles, for other programs.
 *
 * Every surface is a grid of vertices, each with its colour in the scene's light: what the cameras
 * see, highlights left out. Sides of bodies that no camera near the path sees are left out too. */
#ifndef SHEFSIM_MESH_H
#define SHEFSIM_MESH_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "shefsim/scene.h"

struct sim_vertex {
    float x_m, y_m, z_m; /* world axes */
    struct shef_rgb8 colour;
    uint8_t padding;
};

struct sim_mesh {
    struct sim_vertex *vertices;
    int32_t n_vertices;
    int32_t (*triangles)[3]; /* vertices, counted from 0, counter-clockwise from outside */
    int32_t n_triangles;
};

/*   spacing_m  between neighbouring vertices, at most; 0.002..1
 * SHEF_ERR_INVALID: spacing out of range, or more than 50 million vertices. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_mesh_create(struct sim_mesh *out_mesh,
                                              const struct sim_scene *scene, double spacing_m,
                                              struct shef_error *err);

/* A zeroed mesh is allowed. */
void sim_mesh_destroy(struct sim_mesh *mesh);

/* Writes a binary little-endian PLY file: vertices with x y z (float) and red green blue (uchar),
 * then, if asked for, the triangles. See shef_file_replace() for what a failure leaves behind. */
SHEF_MUST_CHECK enum shef_err sim_ply_write(const char *path, const struct sim_mesh *mesh,
                                            bool with_triangles, struct shef_error *err);

#endif
