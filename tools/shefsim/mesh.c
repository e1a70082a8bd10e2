#include "shefsim/mesh.h"

#include <math.h>
#include <stdlib.h>

#include "shefsim/scene_internal.h"

#define MAX_VERTICES 50000000
#define BELOW_CLIP   1e-6

/* A surface's grid. */
struct grid {
    const struct sim_surface *surface;
    int32_t n_columns; /* vertices */
    int32_t n_rows;
};

static double length_of(const double axis[3])
{
    return sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
}

static int32_t n_steps(double extent_m, double spacing_m)
{
    const int32_t n = (int32_t)ceil(extent_m / spacing_m);

    return n < 1 ? 1 : n;
}

static struct grid grid_of(const struct sim_surface *s, double spacing_m)
{
    const double x = 2 * length_of(s->axis[0]);
    const double y = 2 * length_of(s->axis[1]);
    const double z = 2 * length_of(s->axis[2]);
    struct grid grid = { .surface = s };

    if (s->kind == SIM_SURFACE_ELLIPSOID) {
        /* From pole to pole over two sides of the unfolded octahedron. */
        grid.n_columns = 2 * n_steps(x + y, spacing_m) + 1;
        grid.n_rows = 2 * n_steps(z + y, spacing_m) + 1;
    } else if (s->kind == SIM_SURFACE_CYLINDER) {
        grid.n_columns = 4 * n_steps((x + z) / 2, spacing_m) + 1;
        grid.n_rows = n_steps(y, spacing_m) + 1;
    } else {
        grid.n_columns = n_steps(x, spacing_m) + 1;
        grid.n_rows = n_steps(y, spacing_m) + 1;
    }
    return grid;
}

/* A disc's grid is a square's, its rings of equal distance from the edge made circles. */
static void round_off(double local[3])
{
    const double reach = fmax(fabs(local[0]), fabs(local[1]));
    const double distance = sqrt(local[0] * local[0] + local[1] * local[1]);

    if (distance > 0) {
        local[0] *= reach / distance;
        local[1] *= reach / distance;
    }
}

/* What the clip leaves out of an ellipsoid is put on its rim. */
static void put_on_rim(const struct sim_surface *s, double local[3])
{
    const double distance = sqrt(local[0] * local[0] + local[2] * local[2]);
    const double rim = sqrt(1 - s->clip[0] * s->clip[0]);

    if (local[1] >= s->clip[0])
        return;
    local[1] = s->clip[0];
    local[0] = distance > 0 ? local[0] / distance * rim : rim;
    local[2] = distance > 0 ? local[2] / distance * rim : 0;
}

static double light_at(const struct sim_surface *s, double u, double v)
{
    const struct sim_texture *t = &s->texture;
    /* An ellipsoid's texture has a texel more all around. */
    const int32_t margin = s->kind == SIM_SURFACE_ELLIPSOID ? 1 : 0;
    const int32_t x = margin + (int32_t)(u * (t->width - 1 - 2 * margin) + .5);
    const int32_t y = margin + (int32_t)(v * (t->height - 1 - 2 * margin) + .5);
    const double root = t->scale * (double)(t->pairs[(int64_t)y * (t->width + 1) + x] & 255);

    return root * root;
}

static uint8_t shade(double light)
{
    const double value = 255 * sqrt(light) + .5;

    return value < 255 ? (uint8_t)value : 255;
}

static void place(const struct grid *grid, int32_t column, int32_t row, const float tint[3],
                  struct sim_vertex *out)
{
    const struct sim_surface *s = grid->surface;
    double u = (double)column / (grid->n_columns - 1);
    double v = (double)row / (grid->n_rows - 1);
    double local[3];
    double point[3];
    double light;

    sim_surface_at(s, u, v, local);
    if (s->kind == SIM_SURFACE_DISC) {
        round_off(local);
        u = (local[0] + 1) / 2;
        v = (local[1] + 1) / 2;
    }
    if (s->kind == SIM_SURFACE_ELLIPSOID)
        put_on_rim(s, local);
    light = light_at(s, u, v);
    sim_surface_point(s, local, point);
    *out = (struct sim_vertex){
        .x_m = (float)point[0],
        .y_m = (float)point[1],
        .z_m = (float)point[2],
        .colour = { shade(light * tint[0]), shade(light * tint[1]), shade(light * tint[2]) },
    };
}

/* Whether a grid point is part of the surface: a bowl has no upper half. */
static bool is_there(const struct grid *grid, int32_t column, int32_t row)
{
    double local[3];

    if (grid->surface->kind != SIM_SURFACE_ELLIPSOID)
        return true;
    sim_surface_at(grid->surface, (double)column / (grid->n_columns - 1),
                   (double)row / (grid->n_rows - 1), local);
    return local[1] >= grid->surface->clip[0] - BELOW_CLIP;
}

static void add(struct sim_mesh *mesh, int32_t a, int32_t b, int32_t c)
{
    int32_t *triangle = mesh->triangles[mesh->n_triangles++];

    triangle[0] = a;
    triangle[1] = b;
    triangle[2] = c;
}

/* Adds a surface's vertices, and the triangles between those that are part of it. */
static void add_surface(struct sim_mesh *mesh, const struct grid *grid, const float tint[3])
{
    const int32_t first = mesh->n_vertices;
    /* Around a cylinder, then down it, is the other way round than on all others. */
    const bool flips = grid->surface->kind == SIM_SURFACE_CYLINDER;

    for (int32_t y = 0; y < grid->n_rows; y++)
        for (int32_t x = 0; x < grid->n_columns; x++)
            place(grid, x, y, tint, &mesh->vertices[mesh->n_vertices++]);
    for (int32_t y = 0; y + 1 < grid->n_rows; y++)
        for (int32_t x = 0; x + 1 < grid->n_columns; x++) {
            const int32_t a = first + y * grid->n_columns + x;
            const int32_t b = a + 1;
            const int32_t c = a + grid->n_columns;
            const int32_t d = c + 1;

            if (!is_there(grid, x, y) || !is_there(grid, x + 1, y) || !is_there(grid, x, y + 1) ||
                !is_there(grid, x + 1, y + 1))
                continue;
            add(mesh, a, flips ? c : b, flips ? b : c);
            add(mesh, b, flips ? c : d, flips ? d : c);
        }
}

enum shef_err sim_mesh_create(struct sim_mesh *out_mesh, const struct sim_scene *scene,
                              double spacing_m, struct shef_error *err)
{
    struct sim_mesh mesh = { 0 };
    int64_t n = 0;

    if (!(spacing_m >= 0.002 && spacing_m <= 1))
        return shef_fail(err, SHEF_ERR_INVALID, "mesh with vertices %g m apart: 0.002 to 1 m",
                         spacing_m);
    for (int32_t i = 0; i < scene->n_surfaces; i++) {
        const struct grid grid = grid_of(&scene->surfaces[i], spacing_m);

        n += (int64_t)grid.n_columns * grid.n_rows;
    }
    if (n > MAX_VERTICES)
        return shef_fail(
            err, SHEF_ERR_INVALID,
            "mesh of %lld vertices: more than %d are too many; ask for a wider spacing",
            (long long)n, MAX_VERTICES);
    mesh.vertices = malloc((size_t)n * sizeof *mesh.vertices);
    mesh.triangles = malloc(2 * (size_t)n * sizeof *mesh.triangles);
    if (!mesh.vertices || !mesh.triangles) {
        sim_mesh_destroy(&mesh);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "mesh of %lld vertices: out of memory",
                         (long long)n);
    }
    for (int32_t i = 0; i < scene->n_surfaces; i++) {
        const struct grid grid = grid_of(&scene->surfaces[i], spacing_m);
        float tint[3];

        sim_scene_object_tint(scene, scene->surfaces[i].object, tint);
        add_surface(&mesh, &grid, tint);
    }
    *out_mesh = mesh;
    return SHEF_OK;
}

void sim_mesh_destroy(struct sim_mesh *mesh)
{
    free(mesh->vertices);
    free(mesh->triangles);
    *mesh = (struct sim_mesh){ 0 };
}
