/* Reads the event part of a recording as batches, like an event file.
 *
 * Where blocks are missing or damaged the decoder goes on from the state that the next block's
 * record keeps: what comes out are the events that were recorded, or none. What is odd becomes a
 * note, one sentence each. Blocks on reading. Thread: one per reader. */
#ifndef SHEF_RECORD_RECORDED_EVENTS_H
#define SHEF_RECORD_RECORDED_EVENTS_H

#include "codecs/evt.h"
#include "core/error.h"
#include "core/packets.h"
#include "record/block_reader.h"
#include "record/event_part.h"
#include "record/recording.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorded_events;

/* A place where something is missing. */
struct shef_recorded_gap {
    int64_t from_us; /* event time reached before it */
    int64_t to_us;   /* of the first event or trigger after it */
    uint64_t n_missing_blocks;
    uint32_t n_lost_buffers;
};

#define SHEF_RECORDED_MAX_GAPS 256

/* Opens a recording.
 *   features    instruction sets to use, usually shef_cpu_features()
 * SHEF_ERR_FORMAT: not a recording, or no segment of it has a readable index.
 * SHEF_ERR_NOT_FOUND: it has no event part. SHEF_ERR_UNSUPPORTED, SHEF_ERR_NO_MEMORY, errors of
 * the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_events_open(const char *path, uint32_t features,
                                                        struct shef_recorded_events **out_events,
                                                        struct shef_error *err);

/* Clears the batch and fills it with what comes next: at least one event or trigger.
 * SHEF_ERR_EMPTY: there is no more. SHEF_ERR_IO: reading failed. */
SHEF_MUST_CHECK enum shef_err shef_recorded_events_next(struct shef_recorded_events *events,
                                                        struct shef_event_batch *batch,
                                                        struct shef_error *err);

/* NULL: nothing was ever recorded, there is not even a segment. */
const struct shef_event_part *shef_recorded_events_part(const struct shef_recorded_events *events);

const struct shef_recording *shef_recorded_events_recording(
    const struct shef_recorded_events *events);

struct shef_evt_stats shef_recorded_events_stats(const struct shef_recorded_events *events);

/* What was found so far; complete after SHEF_ERR_EMPTY. */
struct shef_damage shef_recorded_events_damage(const struct shef_recorded_events *events);

/* The i-th gap, NULL behind the last. */
const struct shef_recorded_gap *shef_recorded_events_gap(const struct shef_recorded_events *events,
                                                         uint32_t i);

/* How much has been used, 0..1. */
double shef_recorded_events_progress(const struct shef_recorded_events *events);

/* The i-th note, NULL behind the last. Some come only with the end. */
const char *shef_recorded_events_note(const struct shef_recorded_events *events, int i);

/* NULL is allowed. */
void shef_recorded_events_close(struct shef_recorded_events *events);

#ifdef __cplusplus
}
#endif

#endif
