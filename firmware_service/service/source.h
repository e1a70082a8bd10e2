/* A recording as the service plays it: opened, checked, and what is known of it beforehand.
 *
 * Opening reads indexes, poses and the first events, allocates all buffers, and refuses what cannot
 * be played.
 * Thread: setup; the parts belong to the threads of the sources once these run. */
#ifndef SHEF_SERVICE_SOURCE_H
#define SHEF_SERVICE_SOURCE_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/calibration.h"
#include "codecs/raw_header.h"
#include "config/config.h"
#include "core/error.h"
#include "core/pool.h"
#include "pipeline/frame_rectify.h"
#include "record/edge_track.h"
#include "record/pose_track.h"
#include "record/recorded_clock.h"
#include "record/recorded_frames.h"
#include "record/replay.h"
#include "service/first_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Frames that wait for their snapshots, in the stereo thread's hands: at the start 8 until their
 * delays show which trigger is whose, then 2, as the last event that counts for a frame comes 25 ms
 * after its middle at most. */
#define SHEF_SOURCE_FRAMES_HELD 12

/* Buffers for frames, of 3 MB each: those above, one being read, and three on their way, which at
 * 54 frames/s cover 55 ms; a frame that waits for 30 ms is left out anyway. Once the triggers are
 * known, ten more are there for the recorder: 185 ms of a disk that stands still. */
#define SHEF_SOURCE_FRAMES (SHEF_SOURCE_FRAMES_HELD + 4)

/* What is known of the frame camera; "" where nothing is. */
struct shef_source_camera {
    char vendor[64];
    char model[64];
    char serial[64];
};

struct shef_source {
    char path[SHEF_CONFIG_PATH_BYTES];
    struct shef_calibration calibration;
    char calibration_path[SHEF_CONFIG_PATH_BYTES + 32];
    uint8_t session[16];
    int64_t session_id;
    int64_t utc_minus_host_ns;
    /* Events. */
    struct shef_replay *events;
    struct shef_recorded_clock clock;
    struct shef_raw_header event_camera;
    /* Frames. */
    struct shef_recorded_frames *frames;
    struct shef_source_camera frame_camera;
    struct shef_pool *frame_pool;
    enum shef_frame_pixels pixels;
    uint32_t n_frames;
    struct shef_first_pair first_pair; /* in the first pass */
    uint64_t numbers_per_pass;         /* by how much the camera's numbers grow with every pass */
    /* Poses; none: n is 0. */
    struct shef_pose_track poses;
    /* Sync edges; none: n is 0. */
    struct shef_edge_track edges;
    uint32_t edges_per_pass; /* by how much the kernel's numbers grow with every pass */
    /* The whole recording. */
    shef_host_time begins; /* the first arrival of anything */
    int64_t length_ns;     /* from there to the last arrival */
    int64_t pass_ns;       /* from pass to pass when looped */
    int64_t tail_ns;       /* between two passes event time goes on for so long without events */
    char warning[SHEF_ERROR_TEXT_BYTES]; /* what is odd about it; "" if nothing is */
};

/* Opens a recording.
 *   calibration_path  "": the recording's own
 * SHEF_ERR_NOT_FOUND: no recording there, or it lacks events, frames or a calibration.
 * SHEF_ERR_INVALID: a calibration of another size. SHEF_ERR_UNSUPPORTED, and those of reading. */
SHEF_MUST_CHECK enum shef_err shef_source_open(const char *path, const char *calibration_path,
                                               struct shef_source **out_source,
                                               struct shef_error *err);

/* Whether open() would succeed, but for its memory: opens and closes without its buffers. For who
 * must not stop what is playing for something that cannot be played. */
SHEF_MUST_CHECK enum shef_err shef_source_check(const char *path, const char *calibration_path,
                                                struct shef_error *err);

/* Every buffer must have been given back. NULL is allowed. */
void shef_source_close(struct shef_source *source);

/* Host time of an instant of the events' clock, in the recording's first pass. */
static inline shef_host_time shef_source_host(const struct shef_source *source,
                                              shef_event_time event)
{
    return shef_recorded_clock_host(&source->clock, event);
}

#ifdef __cplusplus
}
#endif

#endif
