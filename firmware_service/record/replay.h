/* Plays the event part of a recording as if the sensor were there: the same buffers again.
 *
 * Buffers come from a pool, are shared through rings, and return when the last holder gives them
 * back. Nothing is decoded here. What is missing in the recording is counted like buffers that a
 * device has lost. Reads the disk; after create() nothing is allocated. */
#ifndef SHEF_RECORD_REPLAY_H
#define SHEF_RECORD_REPLAY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/packets.h"
#include "record/block_reader.h"
#include "record/event_part.h"
#include "record/replay_pacer.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_replay;

/* Opens a recording and allocates.                                Thread: setup.
 * SHEF_ERR_EMPTY: nothing was ever recorded. Otherwise as shef_recorded_events_open(). */
SHEF_MUST_CHECK enum shef_err shef_replay_create(const char *path,
                                                 const struct shef_replay_config *config,
                                                 struct shef_replay **out_replay,
                                                 struct shef_error *err);

/* How to decode the buffers. */
const struct shef_event_part *shef_replay_part(const struct shef_replay *replay);

/* Where the first buffer's decoding starts: for shef_evt_restore(), so that times are those of
 * the recording. */
const uint8_t *shef_replay_start_state(const struct shef_replay *replay);

/* Lends the next buffer once it is due.                           Thread: source.
 *   out_packet  times are those of the recording
 * SHEF_ERR_TIMEOUT: not yet; due() says when.
 * SHEF_ERR_FULL: no buffer is free; nothing is lost, call again when one was given back.
 * SHEF_ERR_EMPTY: that was all. SHEF_ERR_IO: reading failed. */
SHEF_MUST_CHECK enum shef_err shef_replay_take(struct shef_replay *replay,
                                               struct shef_raw_packet *out_packet,
                                               struct shef_error *err);

/* How decoding stands at the start of the buffer that take() lent last, for shef_evt_restore().
 *   out_follows  whether nothing is missing between the one before and this; false for the first
 *                of a segment, too, where the source may have begun anew. Thread: source. */
const uint8_t *shef_replay_state(const struct shef_replay *replay, bool *out_follows);

/* When the next buffer is due, after take() has said SHEF_ERR_TIMEOUT; for stepped pace it is
 * whenever step() is called, and the time has no meaning.         Thread: source. */
shef_host_time shef_replay_due(const struct shef_replay *replay);

/* Allows n_buffers more at stepped pace.                          Thread: any. */
void shef_replay_step(struct shef_replay *replay, uint32_t n_buffers);

/* By how much the last buffer was late at recorded pace, in ns. Thread: source. */
int64_t shef_replay_late_ns(const struct shef_replay *replay);

/* What was found so far; complete after SHEF_ERR_EMPTY.           Thread: source. */
const struct shef_damage *shef_replay_damage(const struct shef_replay *replay);

/* Plays from the start again, after take() has said SHEF_ERR_EMPTY: numbers and permissions go on,
 * decoding starts anew from the start state. Allocates nothing.   Thread: source. */
void shef_replay_rewind(struct shef_replay *replay);

/* Every buffer must have been given back. NULL is allowed.        Thread: setup. */
void shef_replay_destroy(struct shef_replay *replay);

#ifdef __cplusplus
}
#endif

#endif
