/* Meshes as PLY files. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "shefsim/mesh.h"

#define HEADER_BYTES   400
#define VERTEX_BYTES   15
#define TRIANGLE_BYTES 13

static uint8_t *put_u32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        *to++ = (uint8_t)(value >> (8 * i));
    return to;
}

static uint8_t *put_float(uint8_t *to, float value)
{
    uint32_t bits;

    memcpy(&bits, &value, sizeof bits);
    return put_u32(to, bits);
}

static uint8_t *put_vertex(uint8_t *to, const struct sim_vertex *vertex)
{
    to = put_float(to, vertex->x_m);
    to = put_float(to, vertex->y_m);
    to = put_float(to, vertex->z_m);
    *to++ = vertex->colour.red;
    *to++ = vertex->colour.green;
    *to++ = vertex->colour.blue;
    return to;
}

enum shef_err sim_ply_write(const char *path, const struct sim_mesh *mesh, bool with_triangles,
                            struct shef_error *err)
{
    const int32_t n_triangles = with_triangles ? mesh->n_triangles : 0;
    char faces[100] = "";
    char *bytes = malloc(HEADER_BYTES + (size_t)mesh->n_vertices * VERTEX_BYTES +
                         (size_t)n_triangles * TRIANGLE_BYTES);
    enum shef_err code;
    uint8_t *to;
    int n;

    if (!bytes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    if (with_triangles)
        snprintf(faces, sizeof faces, "element face %d\nproperty list uchar int vertex_indices\n",
                 n_triangles);
    n = snprintf(bytes, HEADER_BYTES,
                 "ply\nformat binary_little_endian 1.0\ncomment x right, y down, z forward, in m\n"
                 "element vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                 "property uchar red\nproperty uchar green\nproperty uchar blue\n%send_header\n",
                 mesh->n_vertices, faces);
    to = (uint8_t *)bytes + n;
    for (int32_t i = 0; i < mesh->n_vertices; i++)
        to = put_vertex(to, &mesh->vertices[i]);
    for (int32_t i = 0; i < n_triangles; i++) {
        *to++ = 3;
        for (int k = 0; k < 3; k++)
            to = put_u32(to, (uint32_t)mesh->triangles[i][k]);
    }
    code = shef_file_replace(path, bytes, (size_t)(to - (uint8_t *)bytes), err);
    free(bytes);
    return code;
}
