/* What the simulator knows: the folder truth/ of a simulated recording. docs/recording.md describes
 * the files. */
#ifndef SHEF_RECORD_TRUTH_H
#define SHEF_RECORD_TRUTH_H

#include <stdint.h>

#include "calib/rigid.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_TRUTH_FOLDER  "truth"
#define SHEF_TRUTH_VERSION 1

/* The rectified views that maps are given for. */
enum shef_truth_view {
    SHEF_TRUTH_LEFT,  /* of the frame camera: depth/, disparity/, mask/ */
    SHEF_TRUTH_RIGHT, /* of the event camera: right_depth/, right_disparity/, right_mask/ */
    SHEF_TRUTH_VIEWS,
};

/* Bits of a mask. */
#define SHEF_TRUTH_VALID    1u /* the pixel sees something, on its own sensor */
#define SHEF_TRUTH_OCCLUDED 2u /* the other camera does not see that: hidden, or out of view */

/* The tool's pose at an instant. */
struct shef_truth_pose {
    shef_event_time time;
    struct shef_rigid t_world_hand;
};

/* A frame's exposure as it really was. */
struct shef_truth_frame {
    uint64_t number;        /* the camera's */
    shef_event_time rise;   /* of the trigger edge at its beginning */
    shef_event_time middle; /* of the exposure */
    int64_t exposure_ns;
    struct shef_rigid t_world_hand; /* at the middle */
};

/* How a clock ran: its reading is (true_ns - epoch) * (1 + drift_ppm / 1e6) + offset_ns. */
struct shef_truth_clock {
    char name[16]; /* "event", "frame", "robot", "host" */
    int64_t offset_ns;
    double drift_ppm;
};

#define SHEF_TRUTH_MAX_CLOCKS 8

#ifdef __cplusplus
}
#endif

#endif
