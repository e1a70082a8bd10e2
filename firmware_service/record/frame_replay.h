/* Plays the frame part of a recording as if the camera were there: the same frames again.
 *
 * Buffers come from a pool, are shared through rings, and return when the last holder gives them
 * back. What is missing or damaged in the recording is counted like frames that a camera has lost.
 * Reads the disk; after create() nothing is allocated. Paces as record/replay.h; give both the same
 * zero, so that frames and events keep their distance. */
#ifndef SHEF_RECORD_FRAME_REPLAY_H
#define SHEF_RECORD_FRAME_REPLAY_H

#include <stdint.h>

#include "core/error.h"
#include "core/frame.h"
#include "record/frame_part.h"
#include "record/recorded_frames.h"
#include "record/replay_pacer.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_frame_replay;

/* Opens a recording and allocates.                                Thread: setup.
 * As shef_recorded_frames_open(). */
SHEF_MUST_CHECK enum shef_err shef_frame_replay_create(const char *path,
                                                       const struct shef_replay_config *config,
                                                       struct shef_frame_replay **out_replay,
                                                       struct shef_error *err);

/* Lends the next frame once it is due.                            Thread: source.
 *   out_packet  times are those of the recording
 * SHEF_ERR_TIMEOUT: not yet; due() says when.
 * SHEF_ERR_FULL: no buffer is free; nothing is lost, call again when one was given back.
 * SHEF_ERR_EMPTY: that was all. SHEF_ERR_IO: reading failed. */
SHEF_MUST_CHECK enum shef_err shef_frame_replay_take(struct shef_frame_replay *replay,
                                                     struct shef_frame_packet *out_packet,
                                                     struct shef_error *err);

/* When the next frame is due, after take() has said SHEF_ERR_TIMEOUT at recorded pace.
 *                                                                 Thread: source. */
shef_host_time shef_frame_replay_due(const struct shef_frame_replay *replay);

/* Allows n_frames more at stepped pace.                           Thread: any. */
void shef_frame_replay_step(struct shef_frame_replay *replay, uint32_t n_frames);

/* By how much the last frame was late at recorded pace, in ns.    Thread: source. */
int64_t shef_frame_replay_late_ns(const struct shef_frame_replay *replay);

/* Every buffer must have been given back. NULL is allowed.        Thread: setup. */
void shef_frame_replay_destroy(struct shef_frame_replay *replay);

#ifdef __cplusplus
}
#endif

#endif
