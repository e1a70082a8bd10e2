/* A pinhole camera with the lens of Brown 1971, parameters as OpenCV has them.
 *
 * Camera axes: x right, y down, z forward; pixel centres at integer coordinates. Only + - * / and
 * sqrt are used: the same input gives the same bytes on every machine. Pure functions.
 * Thread: any. */
#ifndef SHEF_CALIB_CAMERA_MODEL_H
#define SHEF_CALIB_CAMERA_MODEL_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

struct shef_camera_model {
    double fx_px, fy_px;
    double cx_px, cy_px;
    double distortion[5]; /* k1, k2, p1, p2, k3 */
};

/* Where a point or direction in camera axes is seen, in pixels.
 * Returns false where the lens model sees nothing: behind the camera, or past the radius at which
 * its distortion would fold back. */
bool shef_camera_project(const struct shef_camera_model *camera, const double direction[3],
                         double *out_x_px, double *out_y_px);

/* The inverse: the direction, with z = 1, that is seen there, by Newton's iteration to within
 * 1e-9 px.
 * Returns false where nothing is seen: the distortion folds back before it reaches that pixel. */
bool shef_camera_unproject(const struct shef_camera_model *camera, double x_px, double y_px,
                           double out_direction[3]);

#ifdef __cplusplus
}
#endif

#endif
