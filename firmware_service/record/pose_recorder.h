/* Writes the pose part of a recording: the robot's RTDE data packages as they came.
 *
 * Packages that are known to be lost, by the caller or because the controller's time jumped, make
 * the recording's verdict. Blocks on disk; between start() and stop() nothing is allocated.
 * Thread: one, not a streaming one. */
#ifndef SHEF_RECORD_POSE_RECORDER_H
#define SHEF_RECORD_POSE_RECORDER_H

#include <stdint.h>

#include "core/error.h"
#include "core/time.h"
#include "record/part_recorder.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_pose_recorder;

struct shef_pose_recorder_config {
    uint32_t protocol_version; /* 1 or 2 */
    const char *recipe;        /* names with commas between, "timestamp" among them; not kept */
    const char *types;         /* as the controller answered; not kept */
    double frequency_hz;       /* at which packages come */
    const char *controller;    /* for people: "URControl 3.15.8"; NULL: unknown; not kept */
    struct shef_segment_limits limits;
};

/* Version 2, timestamp, pose and speed of the tool, 125 Hz, usual segments. */
struct shef_pose_recorder_config shef_pose_recorder_default_config(void);

/* Makes the part.
 *   recording  kept; the manifest's section is the recorder's to write until stop()
 * SHEF_ERR_INVALID: a recipe that cannot be, or has no DOUBLE timestamp, or no positive frequency.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_pose_recorder_start(
    struct shef_recording_writer *recording, const struct shef_pose_recorder_config *config,
    struct shef_pose_recorder **out_recorder, struct shef_error *err);

/* Records one data package, its header included.
 *   n_lost_before  packages that are known to be lost between the last one and this
 * SHEF_ERR_INVALID: no package of the recipe; nothing was recorded, others may follow. After any
 * other error, which becomes the recording's verdict, only stop() may follow. */
SHEF_MUST_CHECK enum shef_err shef_pose_recorder_write(struct shef_pose_recorder *recorder,
                                                       const uint8_t *package, uint32_t n_bytes,
                                                       shef_host_time arrived,
                                                       uint32_t n_lost_before,
                                                       struct shef_error *err);

/* Closes the files and says the verdict. Frees the recorder.
 * Returns what went wrong here; an error of write() is not repeated. */
SHEF_MUST_CHECK enum shef_err shef_pose_recorder_stop(struct shef_pose_recorder *recorder,
                                                      struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
