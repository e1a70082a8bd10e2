/* One side of a rectified pair: where each pixel of a profile lies on a raw sensor.
 *
 * Both sides of a pair share the profile; x runs along the baseline, y down, z forward; pixel
 * centres at integer coordinates. Pure functions. Thread: any. */
#ifndef SHEF_CALIB_RECTIFICATION_H
#define SHEF_CALIB_RECTIFICATION_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/camera_model.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_PROFILE_MAX_SIDE_PX 2048
#define SHEF_SENSOR_MAX_SIDE_PX  4096

/* The profile both sides share, and this side's raw camera. */
struct shef_rectification {
    /* The profile. */
    int32_t width_px; /* 1..SHEF_PROFILE_MAX_SIDE_PX */
    int32_t height_px;
    double f_px;
    double cx_px, cy_px;
    /* The raw camera. */
    int32_t sensor_width_px; /* 1..SHEF_SENSOR_MAX_SIDE_PX */
    int32_t sensor_height_px;
    struct shef_camera_model camera;
    double r_camera_rectified[9]; /* turns rectified directions into the camera's, row by row */
};

/* The profiles `wide` (f 555 px, the whole event view) and `paper` (f 1301 px, the crop of the
 * authors' data), 640 x 480, on an ideal, aligned 640 x 480 sensor of f 555 px. A calibration
 * replaces the camera and the rotation. */
struct shef_rectification shef_rectification_wide(void);
struct shef_rectification shef_rectification_paper(void);

struct shef_calibration;

/* Both sides of a rig in a profile: left is the frame camera, right the event camera.
 *   profile         "wide" or "paper"
 *   out_baseline_m  between the cameras' centres; disparity is f_px * baseline_m / Z
 * The rectified axes R have their origin in the frame camera's centre: T_C_R is the left side's
 * r_camera_rectified without a translation. Their z lies between both optical axes.
 * SHEF_ERR_INVALID: no such profile, or cameras that are no stereo pair: the event camera less than
 * 1 mm or more than 1 m away, not to the right, or axes more than 30 degrees apart. */
SHEF_MUST_CHECK enum shef_err shef_rectification_pair(const struct shef_calibration *calibration,
                                                      const char *profile,
                                                      struct shef_rectification *out_left,
                                                      struct shef_rectification *out_right,
                                                      double *out_baseline_m,
                                                      struct shef_error *err);

/* Whether sizes and focal lengths are in range.
 * SHEF_ERR_INVALID with a sentence if not. */
SHEF_MUST_CHECK enum shef_err shef_rectification_check(
    const struct shef_rectification *rectification, struct shef_error *err);

/* Where a rectified pixel lies on the sensor, in its pixels.
 * Returns false where the lens model sees nothing: behind the camera, or past the radius at which
 * its distortion would fold back. */
bool shef_rectification_project(const struct shef_rectification *rectification, double x_px,
                                double y_px, double *out_x_px, double *out_y_px);

/* The inverse: where a pixel of the sensor lies in the rectified view.
 * Returns false if the lens model sees nothing there, or it lies behind the rectified view. */
bool shef_rectification_unproject(const struct shef_rectification *rectification,
                                  double sensor_x_px, double sensor_y_px, double *out_x_px,
                                  double *out_y_px);

#ifdef __cplusplus
}
#endif

#endif
