#include "shefsim/surface.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void sim_surface_point(const struct sim_surface *surface, const double local[3],
                       double out_point[3])
{
    for (int i = 0; i < 3; i++)
        out_point[i] = surface->centre[i] + local[0] * surface->axis[0][i] +
                       local[1] * surface->axis[1][i] + local[2] * surface->axis[2][i];
}

void sim_surface_local(const struct sim_surface *surface, const double point[3],
                       double out_local[3])
{
    double from_centre[3];

    for (int i = 0; i < 3; i++)
        from_centre[i] = point[i] - surface->centre[i];
    for (int i = 0; i < 3; i++)
        out_local[i] = dot(from_centre, surface->axis[i]) / dot(surface->axis[i], surface->axis[i]);
}

void sim_surface_normal(const struct sim_surface *surface, const double local[3],
                        double out_normal[3])
{
    double weight[3] = { 0, 0, 1 };

    if (surface->kind == SIM_SURFACE_ELLIPSOID || surface->kind == SIM_SURFACE_CYLINDER) {
        weight[0] = local[0];
        weight[1] = surface->kind == SIM_SURFACE_ELLIPSOID ? local[1] : 0;
        weight[2] = local[2];
    }
    for (int i = 0; i < 3; i++)
        out_normal[i] = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            out_normal[i] +=
                weight[k] * surface->axis[k][i] / dot(surface->axis[k], surface->axis[k]);

    const double length = sqrt(dot(out_normal, out_normal));

    for (int i = 0; i < 3; i++)
        out_normal[i] /= length;
}

void sim_surface_cut(struct sim_surface *surface, int along, struct sim_surface *out_second)
{
    struct sim_surface second = *surface;

    for (int i = 0; i < 3; i++) {
        const double half = surface->axis[along][i] / 2;

        surface->axis[along][i] = second.axis[along][i] = half;
        surface->centre[i] -= half;
        second.centre[i] += half;
    }
    surface->part_size[along] = second.part_size[along] = surface->part_size[along] / 2;
    second.part_start[along] += second.part_size[along];
    *out_second = second;
}

static void cylinder_at(double u, double v, double out_local[3])
{
    double turn = 4 * (u - floor(u));
    const double x = turn < 2 ? 1 - turn : turn - 3;
    const double z = turn < 2 ? 1 - fabs(x) : fabs(x) - 1;
    const double length = sqrt(x * x + z * z);

    out_local[0] = x / length;
    out_local[1] = 2 * v - 1;
    out_local[2] = z / length;
}

static void ellipsoid_at(double u, double v, double out_local[3])
{
    double x = 2 * u - 1;
    double z = 2 * v - 1;

    /* Over an edge of the square one comes back in over the same edge, mirrored at its middle. */
    if (fabs(x) > 1) {
        x = (x > 0 ? 2 : -2) - x;
        z = -z;
    }
    if (fabs(z) > 1) {
        z = (z > 0 ? 2 : -2) - z;
        x = -x;
    }

    const double y = fabs(x) + fabs(z) - 1;

    if (y > 0) {
        const double folded_x = (1 - fabs(z)) * (x < 0 ? -1 : 1);

        z = (1 - fabs(x)) * (z < 0 ? -1 : 1);
        x = folded_x;
    }

    const double length = sqrt(x * x + y * y + z * z);

    out_local[0] = x / length;
    out_local[1] = y / length;
    out_local[2] = z / length;
}

void sim_surface_at(const struct sim_surface *surface, double u, double v, double out_local[3])
{
    switch (surface->kind) {
    case SIM_SURFACE_QUAD:
    case SIM_SURFACE_DISC:
        out_local[0] = 2 * u - 1;
        out_local[1] = 2 * v - 1;
        out_local[2] = 0;
        return;
    case SIM_SURFACE_CYLINDER:
        cylinder_at(u, v, out_local);
        return;
    case SIM_SURFACE_ELLIPSOID:
        ellipsoid_at(u, v, out_local);
        return;
    }
}
