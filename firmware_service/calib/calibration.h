/* What is known about one rig: both cameras, where they are, the robot's hand, delays.
 *
 * Every value comes with its standard deviation; 0 means: taken as exact. Frames and clocks are
 * those of docs/recording.md: C the raw frame camera, H the robot's tool. */
#ifndef SHEF_CALIB_CALIBRATION_H
#define SHEF_CALIB_CALIBRATION_H

#include <stdint.h>

#include "calib/camera_model.h"
#include "calib/rigid.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CALIBRATION_ID_BYTES   65 /* SHA-256 in hexadecimal */
#define SHEF_CALIBRATION_NAME_BYTES 16

struct shef_calibrated_camera {
    int32_t width_px; /* 1..4096 */
    int32_t height_px;
    struct shef_camera_model model;
    struct shef_camera_model sigma; /* of each parameter */
};

struct shef_rigid_sigma {
    double rotation_rad; /* about any axis */
    double position_m;   /* along any axis */
};

struct shef_calibrated_delay {
    int64_t ns;
    int64_t sigma_ns;
};

struct shef_calibration {
    char id[SHEF_CALIBRATION_ID_BYTES];        /* of the content below; "" if not yet known */
    char profile[SHEF_CALIBRATION_NAME_BYTES]; /* "wide" or "paper": how it is meant to be used */
    struct shef_calibrated_camera frame;
    struct shef_calibrated_camera event;
    struct shef_rigid t_event_frame; /* its t_m is about (-0.06544, 0, 0) */
    struct shef_rigid_sigma t_event_frame_sigma;
    struct shef_rigid t_hand_frame; /* T_H_C */
    struct shef_rigid_sigma t_hand_frame_sigma;
    double tcp_offset[6]; /* flange to H as the controller has it: m, rotation vector in rad */
    double tcp_offset_sigma[6];
    struct shef_calibrated_delay frame_delay; /* true mid-exposure after that of the trigger */
    struct shef_calibrated_delay event_delay; /* an event's time after the change of light */
    struct shef_calibrated_delay robot_delay; /* a pose's soonest arrival after it was true */
};

#ifdef __cplusplus
}
#endif

#endif
