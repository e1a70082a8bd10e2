/* Writes the trigger part of a recording: the host's copy of the sync edges.
 *
 * Edges that are known to be lost, by the caller or by the kernel's count, make the recording's
 * verdict. Blocks on disk; between start() and stop() nothing is allocated. Thread: one, not a
 * streaming one. */
#ifndef SHEF_RECORD_TRIGGER_RECORDER_H
#define SHEF_RECORD_TRIGGER_RECORDER_H

#include <stdint.h>

#include "core/error.h"
#include "record/part_recorder.h"
#include "record/trigger_part.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_trigger_recorder;

struct shef_trigger_recorder_config {
    const char *chip;                   /* "gpiochip0"; not kept */
    const struct shef_edge_line *lines; /* n_lines, at most SHEF_EDGE_MAX_LINES; not kept */
    uint32_t n_lines;
    struct shef_segment_limits limits;
};

/* Makes the part.
 *   recording  kept; the manifest's section is the recorder's to write until stop()
 * SHEF_ERR_INVALID: too many lines. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_trigger_recorder_start(
    struct shef_recording_writer *recording, const struct shef_trigger_recorder_config *config,
    struct shef_trigger_recorder **out_recorder, struct shef_error *err);

/* Records a run of edges as they were read, 0 or more.
 *   arrived        when they were read
 *   n_lost_before  edges that are known to be lost before the first of them
 * After an error, which becomes the recording's verdict, only stop() may follow. */
SHEF_MUST_CHECK enum shef_err shef_trigger_recorder_write(struct shef_trigger_recorder *recorder,
                                                          const struct shef_edge *edges,
                                                          uint32_t n_edges, shef_host_time arrived,
                                                          uint32_t n_lost_before,
                                                          struct shef_error *err);

/* Closes the files and says the verdict. Frees the recorder.
 * Returns what went wrong here; an error of write() is not repeated. */
SHEF_MUST_CHECK enum shef_err shef_trigger_recorder_stop(struct shef_trigger_recorder *recorder,
                                                         struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
