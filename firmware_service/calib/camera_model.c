#include "calib/camera_model.h"

#include <math.h>

#define MAX_STEPS    60
#define TOLERANCE_PX 1e-9

/* How the distorted radius grows with the ideal one. */
static double growth_at(const double *k, double r2)
{
    return 1 + r2 * (3 * k[0] + r2 * (5 * k[1] + r2 * 7 * k[4]));
}

/* Whether the distorted radius has grown all the way from the middle to here. */
static bool is_before_fold(const double *k, double r2)
{
    if (!(growth_at(k, r2) > 0.0))
        return false;

    /* The growth's extremes in between: 3 k1 + 10 k2 r2 + 21 k3 r2^2 = 0. */
    const double a = 21 * k[4];
    const double half_b = 5 * k[1];
    const double c = 3 * k[0];
    const double square = half_b * half_b - a * c;

    if (square < 0.0)
        return true;

    const double q = -(half_b + (half_b < 0 ? -sqrt(square) : sqrt(square)));
    const double extremes[2] = { a != 0.0 ? q / a : -1.0, q != 0.0 ? c / q : -1.0 };

    for (int i = 0; i < 2; i++)
        if (extremes[i] > 0.0 && extremes[i] < r2 && growth_at(k, extremes[i]) <= 0.0)
            return false;
    return true;
}

static void distort(const double *k, double x, double y, double *out_x, double *out_y)
{
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));

    *out_x = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    *out_y = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
}

bool shef_camera_project(const struct shef_camera_model *camera, const double direction[3],
                         double *out_x_px, double *out_y_px)
{
    if (!(direction[2] > 0.0))
        return false;

    const double x = direction[0] / direction[2];
    const double y = direction[1] / direction[2];
    double bent_x;
    double bent_y;

    if (!is_before_fold(camera->distortion, x * x + y * y))
        return false;
    distort(camera->distortion, x, y, &bent_x, &bent_y);
    *out_x_px = camera->cx_px + camera->fx_px * bent_x;
    *out_y_px = camera->cy_px + camera->fy_px * bent_y;
    return true;
}

struct newton {
    double x, y;           /* where we are */
    double miss_x, miss_y; /* how far its image is from the one that is looked for */
    double miss2;
};

static bool try_point(const double *k, double x, double y, double target_x, double target_y,
                      struct newton *out_at)
{
    struct newton at = { .x = x, .y = y };

    if (!is_before_fold(k, x * x + y * y))
        return false;
    distort(k, x, y, &at.miss_x, &at.miss_y);
    at.miss_x = target_x - at.miss_x;
    at.miss_y = target_y - at.miss_y;
    at.miss2 = at.miss_x * at.miss_x + at.miss_y * at.miss_y;
    *out_at = at;
    return true;
}

/* The full step, or as much of it as brings the image nearer. */
static bool step(const double *k, double target_x, double target_y, struct newton *at)
{
    const double x = at->x;
    const double y = at->y;
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    const double slope =
        2 * (k[0] + r2 * (2 * k[1] + r2 * 3 * k[4])); /* d(radial)/d(x) = x slope */
    const double xx = radial + x * x * slope + 2 * k[2] * y + 6 * k[3] * x;
    const double xy = x * y * slope + 2 * k[2] * x + 2 * k[3] * y; /* the same both ways */
    const double yy = radial + y * y * slope + 6 * k[2] * y + 2 * k[3] * x;
    const double det = xx * yy - xy * xy;

    if (!(det > 0.0))
        return false;

    const double step_x = (yy * at->miss_x - xy * at->miss_y) / det;
    const double step_y = (xx * at->miss_y - xy * at->miss_x) / det;

    for (double part = 1; part > 1e-6; part /= 2) {
        struct newton next;

        if (try_point(k, x + part * step_x, y + part * step_y, target_x, target_y, &next) &&
            next.miss2 < at->miss2) {
            *at = next;
            return true;
        }
    }
    return false;
}

bool shef_camera_unproject(const struct shef_camera_model *camera, double x_px, double y_px,
                           double out_direction[3])
{
    const double *k = camera->distortion;
    const double target_x = (x_px - camera->cx_px) / camera->fx_px;
    const double target_y = (y_px - camera->cy_px) / camera->fy_px;
    const double f_px = camera->fx_px > camera->fy_px ? camera->fx_px : camera->fy_px;
    struct newton at;

    /* A lens that folds back before the undistorted place is approached from the middle. */
    if (!try_point(k, target_x, target_y, target_x, target_y, &at) &&
        !try_point(k, 0, 0, target_x, target_y, &at))
        return false;
    for (int i = 0; i < MAX_STEPS && at.miss2 > 0.0; i++)
        if (!step(k, target_x, target_y, &at))
            break;
    if (!(at.miss2 * f_px * f_px <= TOLERANCE_PX * TOLERANCE_PX))
        return false;
    out_direction[0] = at.x;
    out_direction[1] = at.y;
    out_direction[2] = 1;
    return true;
}
