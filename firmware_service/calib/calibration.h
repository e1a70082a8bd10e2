/* What is known about one rig: both cameras, where they are, the robot's hand, delays; and its
 * file, calibration.yaml.
 *
 * Every value comes with its standard deviation; 0 means: taken as exact. C is the raw frame
 * camera, H the robot's tool as the controller reports it. A calibration is named by its id, a hash
 * of its values, so that results can say which one they were made with. config/
 * calibration.example.yaml shows the file. Thread: any. */
#ifndef SHEF_CALIB_CALIBRATION_H
#define SHEF_CALIB_CALIBRATION_H

#include <stddef.h>
#include <stdint.h>

#include "calib/camera_model.h"
#include "calib/rigid.h"
#include "core/error.h"
#include "core/sha256.h"

#ifdef __cplusplus
extern "C" {
#endif

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
    char id[SHEF_SHA256_TEXT_BYTES]; /* of the values below, by identify(); "" if not yet known */
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

/* The rig of Wang 2021, put together perfectly: frame camera 2048 x 1536 px, f 1301 px; event
 * camera 640 x 480 px, f 555 px, 65.44 mm to the right; no distortion, no delays, the frame camera
 * in the tool's axes. For simulations and examples; its id is set. */
struct shef_calibration shef_calibration_paper_rig(void);

/* Sets the id.
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_calibration_identify(struct shef_calibration *calibration,
                                                        struct shef_error *err);

/* Reads a file.
 * SHEF_ERR_FORMAT: a key is missing, unknown or has a value that cannot be, or the file's id is not
 * that of its values; the sentence names file, line and key. SHEF_ERR_UNSUPPORTED: of a later
 * version. Errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_calibration_read(const char *path,
                                                    struct shef_calibration *out_calibration,
                                                    struct shef_error *err);

/* The same for bytes in memory.
 *   name  of the file, for sentences */
SHEF_MUST_CHECK enum shef_err shef_calibration_parse(const char *name, const uint8_t *bytes,
                                                     size_t n_bytes,
                                                     struct shef_calibration *out_calibration,
                                                     struct shef_error *err);

/* Writes a file that reads back exactly, with the id of the values, whatever id says; see
 * shef_file_replace().
 * SHEF_ERR_INVALID: values that read() would refuse; nothing is written. */
SHEF_MUST_CHECK enum shef_err shef_calibration_write(const char *path,
                                                     const struct shef_calibration *calibration,
                                                     struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
