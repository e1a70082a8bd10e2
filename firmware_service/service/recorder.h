/* Records what the sources bring while it is processed: raw buffers, shared and not copied.
 *
 * Each part of a recording has a thread of normal priority and a ring of its own. A disk that is
 * too slow costs what the rings have no room for, and what would leave the live stream without
 * buffers: that is counted and becomes the recording's verdict. A disk that fails or gets full ends
 * the recording, never the service. */
#ifndef SHEF_SERVICE_RECORDER_H
#define SHEF_SERVICE_RECORDER_H

#include <stdbool.h>
#include <stdint.h>

#include "config/config.h"
#include "core/error.h"
#include "core/frame.h"
#include "core/packets.h"
#include "record/manifest.h"
#include "service/graph.h"
#include "service/pace.h"
#include "service/source.h"
#include "service/wiring.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorder;

/* Fetches both ends of the rings record_...                       Thread: setup.
 *   pace               of the sources, which wait for the disk where no clock counts
 *   utc_minus_host_ns  of the clock by which things arrive */
SHEF_MUST_CHECK enum shef_err shef_recorder_create(
    struct shef_recorder **out_recorder, struct shef_graph *graph, const struct shef_source *source,
    const struct shef_pace *pace, int64_t utc_minus_host_ns, struct shef_error *err);

/* Nothing may be recording any more. NULL is allowed.             Thread: setup. */
void shef_recorder_destroy(struct shef_recorder *recorder);

/* Begins a recording.                                             Thread: control.
 *   folder  to be made, see shef_recording_place()
 *   config  written into it
 * SHEF_ERR_INVALID: one is running, or the folder holds something. Errors of the system: nothing
 * stays behind. */
SHEF_MUST_CHECK enum shef_err shef_recorder_begin(struct shef_recorder *recorder,
                                                  const char *folder,
                                                  const struct shef_config *config,
                                                  struct shef_error *err);

struct shef_recorder_report {
    bool is_on;
    char path[SHEF_CONFIG_PATH_BYTES];
    uint64_t n_bytes; /* written so far */
    uint64_t n_lost;  /* buffers, frames, poses and edges that came and were not written */
    /* Once it has ended: */
    enum shef_verdict verdict;
    char reason[SHEF_ERROR_TEXT_BYTES];
};

/* Ends it: writes what waits, closes the files, says the verdict. Thread: control.
 * SHEF_ERR_INVALID: none is running. SHEF_ERR_TIMEOUT: the disk does not take what waits within
 * some seconds; look_after() goes on with it. What goes wrong now is in the verdict. */
SHEF_MUST_CHECK enum shef_err shef_recorder_end(struct shef_recorder *recorder,
                                                struct shef_recorder_report *out_report,
                                                struct shef_error *err);

/* What is going on now; if none is running, the last one's.       Thread: control. */
void shef_recorder_report(const struct shef_recorder *recorder,
                          struct shef_recorder_report *out_report);

/* To be called about once a second: ends a recording whose disk has failed or is nearly full, and
 * one whose end() ran out of time. Does not wait.                 Thread: control.
 * Returns whether the recording has ended by this call. */
bool shef_recorder_look_after(struct shef_recorder *recorder, const struct shef_config *config,
                              struct shef_recorder_report *out_report);

/* Offer what has just arrived; wait only where no clock counts. Do nothing unless a recording runs.
 * Thread: that source; edges: the one of the frames. */
void shef_recorder_offer_events(struct shef_recorder *recorder, const struct shef_event_item *item);
void shef_recorder_offer_frame(struct shef_recorder *recorder,
                               const struct shef_frame_packet *frame);
void shef_recorder_offer_pose(struct shef_recorder *recorder, shef_host_time arrived,
                              const uint8_t *package, uint32_t n_bytes);
void shef_recorder_offer_edge(struct shef_recorder *recorder, const struct shef_edge *edge);

/* The threads.   context  the recorder */
void shef_recorder_events_thread(void *context);
void shef_recorder_frames_thread(void *context);
void shef_recorder_poses_thread(void *context);
void shef_recorder_triggers_thread(void *context);

/* Lets the threads write what waits and return; they are to be woken and joined.
 * Thread: control. */
void shef_recorder_stop(struct shef_recorder *recorder);

/* Ends a running recording after the threads have been joined, and gives everything back. */
void shef_recorder_finish(struct shef_recorder *recorder);

#ifdef __cplusplus
}
#endif

#endif
