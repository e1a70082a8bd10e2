#include "calib/rectification.h"

static const struct shef_rectification ideal = {
    .width_px = 640,
    .height_px = 480,
    .f_px = 555.0, /* Wang 2021: the event camera's focal length */
    .cx_px = 319.5,
    .cy_px = 239.5,
    .sensor_width_px = 640,
    .sensor_height_px = 480,
    .camera = { .fx_px = 555.0, .fy_px = 555.0, .cx_px = 319.5, .cy_px = 239.5 },
    .r_camera_rectified = { 1, 0, 0, 0, 1, 0, 0, 0, 1 },
};

struct shef_rectification shef_rectification_wide(void)
{
    return ideal;
}

struct shef_rectification shef_rectification_paper(void)
{
    struct shef_rectification paper = ideal;

    paper.f_px = 1301.0; /* Wang 2021: the frame camera's focal length */
    return paper;
}

static bool is_side(int32_t side_px, int32_t max_px)
{
    return side_px >= 1 && side_px <= max_px;
}

enum shef_err shef_rectification_check(const struct shef_rectification *rectification,
                                       struct shef_error *err)
{
    const struct shef_rectification *r = rectification;

    if (!is_side(r->width_px, SHEF_PROFILE_MAX_SIDE_PX) ||
        !is_side(r->height_px, SHEF_PROFILE_MAX_SIDE_PX) ||
        !is_side(r->sensor_width_px, SHEF_SENSOR_MAX_SIDE_PX) ||
        !is_side(r->sensor_height_px, SHEF_SENSOR_MAX_SIDE_PX))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification of a %d x %d px sensor to %d x %d px: sides must be 1 to "
                         "%d on the sensor and 1 to %d in the profile",
                         r->sensor_width_px, r->sensor_height_px, r->width_px, r->height_px,
                         SHEF_SENSOR_MAX_SIDE_PX, SHEF_PROFILE_MAX_SIDE_PX);
    if (!(r->f_px >= 1.0 && r->camera.fx_px >= 1.0 && r->camera.fy_px >= 1.0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification with focal lengths %g (profile), %g and %g px (camera): "
                         "they must be 1 or more",
                         r->f_px, r->camera.fx_px, r->camera.fy_px);
    return SHEF_OK;
}

bool shef_rectification_project(const struct shef_rectification *rectification, double x_px,
                                double y_px, double *out_x_px, double *out_y_px)
{
    const double *r = rectification->r_camera_rectified;
    const double u = (x_px - rectification->cx_px) / rectification->f_px;
    const double v = (y_px - rectification->cy_px) / rectification->f_px;
    const double direction[3] = {
        r[0] * u + r[1] * v + r[2],
        r[3] * u + r[4] * v + r[5],
        r[6] * u + r[7] * v + r[8],
    };

    return shef_camera_project(&rectification->camera, direction, out_x_px, out_y_px);
}

bool shef_rectification_unproject(const struct shef_rectification *rectification,
                                  double sensor_x_px, double sensor_y_px, double *out_x_px,
                                  double *out_y_px)
{
    const double *r = rectification->r_camera_rectified;
    double ray[3];

    if (!shef_camera_unproject(&rectification->camera, sensor_x_px, sensor_y_px, ray))
        return false;

    const double x = r[0] * ray[0] + r[3] * ray[1] + r[6] * ray[2];
    const double y = r[1] * ray[0] + r[4] * ray[1] + r[7] * ray[2];
    const double z = r[2] * ray[0] + r[5] * ray[1] + r[8] * ray[2];

    if (!(z > 0.0))
        return false;
    *out_x_px = rectification->cx_px + rectification->f_px * (x / z);
    *out_y_px = rectification->cy_px + rectification->f_px * (y / z);
    return true;
}
