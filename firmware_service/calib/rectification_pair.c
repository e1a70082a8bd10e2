#include <math.h>
#include <string.h>

#include "calib/calibration.h"
#include "calib/rectification.h"

#define MIN_BASELINE_M 0.001
#define MAX_BASELINE_M 1.0
#define COS_30_DEG     0.86602540378443865

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalize(double v[3])
{
    const double length = sqrt(dot(v, v));

    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static enum shef_err find_profile(const char *name, struct shef_rectification *out_profile,
                                  struct shef_error *err)
{
    if (strcmp(name, "wide") == 0)
        *out_profile = shef_rectification_wide();
    else if (strcmp(name, "paper") == 0)
        *out_profile = shef_rectification_paper();
    else
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification profile '%s': there are 'wide' and 'paper'", name);
    return SHEF_OK;
}

/* The rectified axes in frame camera coordinates. */
static enum shef_err find_axes(const struct shef_rigid *t_event_frame, double out_axes[3][3],
                               double *out_baseline_m, struct shef_error *err)
{
    const struct shef_rigid t_frame_event = shef_rigid_invert(t_event_frame);
    const double event_axis[3] = { t_frame_event.r[2], t_frame_event.r[5], t_frame_event.r[8] };
    const double *centre = t_frame_event.t_m;
    const double baseline_m = sqrt(dot(centre, centre));
    double x[3] = { centre[0], centre[1], centre[2] };
    double y[3];
    double z[3] = { event_axis[0], event_axis[1], event_axis[2] + 1 };

    if (!(baseline_m >= MIN_BASELINE_M && baseline_m <= MAX_BASELINE_M))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification: the event camera is %g m from the frame camera; a stereo "
                         "pair has 0.001 to 1 m; check T_event_frame in the calibration",
                         baseline_m);
    normalize(x);
    if (!(x[0] >= COS_30_DEG))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification: the event camera is at (%g, %g, %g) m from the frame "
                         "camera, but must be to its right (+x, within 30 degrees); check "
                         "T_event_frame in the calibration",
                         centre[0], centre[1], centre[2]);
    if (!(event_axis[2] >= COS_30_DEG))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification: the optical axes are more than 30 degrees apart; check "
                         "T_event_frame in the calibration");
    cross(z, x, y);
    normalize(y);
    cross(x, y, z);
    memcpy(out_axes[0], x, sizeof x);
    memcpy(out_axes[1], y, sizeof y);
    memcpy(out_axes[2], z, sizeof z);
    *out_baseline_m = baseline_m;
    return SHEF_OK;
}

static struct shef_rectification side_of(const struct shef_rectification *profile,
                                         const struct shef_calibrated_camera *camera,
                                         const struct shef_rigid *t_camera_rectified)
{
    struct shef_rectification side = *profile;

    side.sensor_width_px = camera->width_px;
    side.sensor_height_px = camera->height_px;
    side.camera = camera->model;
    memcpy(side.r_camera_rectified, t_camera_rectified->r, sizeof side.r_camera_rectified);
    return side;
}

enum shef_err shef_rectification_pair(const struct shef_calibration *calibration,
                                      const char *profile, struct shef_rectification *out_left,
                                      struct shef_rectification *out_right, double *out_baseline_m,
                                      struct shef_error *err)
{
    struct shef_rectification shared;
    struct shef_rigid t_frame_rectified = shef_rigid_identity();
    double axes[3][3] = { 0 };
    double baseline_m = 0;
    enum shef_err code = find_profile(profile, &shared, err);

    if (code != SHEF_OK)
        return code;
    code = find_axes(&calibration->t_event_frame, axes, &baseline_m, err);
    if (code != SHEF_OK)
        return code;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            t_frame_rectified.r[i * 3 + j] = axes[j][i];

    const struct shef_rigid t_event_rectified =
        shef_rigid_compose(&calibration->t_event_frame, &t_frame_rectified);
    const struct shef_rectification left =
        side_of(&shared, &calibration->frame, &t_frame_rectified);
    const struct shef_rectification right =
        side_of(&shared, &calibration->event, &t_event_rectified);

    code = shef_rectification_check(&left, err);
    if (code == SHEF_OK)
        code = shef_rectification_check(&right, err);
    if (code != SHEF_OK)
        return code;
    *out_left = left;
    *out_right = right;
    *out_baseline_m = baseline_m;
    return SHEF_OK;
}
