/* One reader for whatever holds events: RAW and DAT files, and recordings. Thread: main. */
#ifndef SHEFTOOL_EVENTS_SOURCE_H
#define SHEFTOOL_EVENTS_SOURCE_H

#include <stdbool.h>
#include <stdint.h>

#include "codecs/event_reader.h"
#include "core/error.h"
#include "record/recorded_events.h"

#define SHEF_EVENTS_BATCH 16384 /* events, the usual capacity */

enum shef_events_kind {
    SHEF_EVENTS_RAW,
    SHEF_EVENTS_DAT,
    SHEF_EVENTS_RECORDING,
};

struct shef_events_info {
    enum shef_events_kind kind;
    enum shef_evt_format format; /* not of a DAT file */
    bool size_known;
    uint32_t width_px; /* the largest possible where it is not known */
    uint32_t height_px;
    struct shef_raw_header camera; /* what is known of it; of a DAT file only the date */
};

struct shef_events_source;

/* Opens a path by what is there: a folder must be a recording.
 *   features  instruction sets to use, usually shef_cpu_features() */
SHEF_MUST_CHECK enum shef_err shef_events_source_open(const char *path, uint32_t features,
                                                      struct shef_events_source **out_source,
                                                      struct shef_error *err);

const struct shef_events_info *shef_events_source_info(const struct shef_events_source *source);

/* Clears the batch and fills it with at least one event or trigger.
 * SHEF_ERR_EMPTY: that was all. SHEF_ERR_IO: reading failed. SHEF_ERR_GONE: stopped by a
 * signal. */
SHEF_MUST_CHECK enum shef_err shef_events_source_next(struct shef_events_source *source,
                                                      struct shef_event_batch *batch,
                                                      struct shef_error *err);

struct shef_evt_stats shef_events_source_stats(const struct shef_events_source *source);

/* How much has been used, 0..1; 0 where that cannot be told. */
double shef_events_source_progress(const struct shef_events_source *source);

/* The i-th note, NULL behind the last; complete after SHEF_ERR_EMPTY. */
const char *shef_events_source_note(const struct shef_events_source *source, int i);

/* Writes the notes to standard error, a line each. */
void shef_events_source_print_notes(const struct shef_events_source *source);

/* NULL if it is a file. */
const struct shef_recorded_events *shef_events_source_recorded(
    const struct shef_events_source *source);

/* NULL is allowed. */
void shef_events_source_close(struct shef_events_source *source);

/* The size that the source tells, or where it tells none, the smallest that all its events fit
 * into, for which path is opened again and read.
 * SHEF_ERR_INVALID: there is none, and no events either, or the path is a pipe. */
SHEF_MUST_CHECK enum shef_err shef_events_source_size(const struct shef_events_source *source,
                                                      const char *path, uint32_t *out_width_px,
                                                      uint32_t *out_height_px,
                                                      struct shef_error *err);

#endif
