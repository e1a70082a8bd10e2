/* Reads the trigger part of a recording, edge by edge. Damaged blocks are left out and counted.
 * Blocks on reading. Thread: one per reader. */
#ifndef SHEF_RECORD_RECORDED_TRIGGERS_H
#define SHEF_RECORD_RECORDED_TRIGGERS_H

#include <stdbool.h>

#include "core/error.h"
#include "record/block_reader.h"
#include "record/trigger_part.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorded_triggers;

/* Opens a recording's triggers.
 * SHEF_ERR_NOT_FOUND: it has no trigger part. SHEF_ERR_EMPTY: nothing was recorded.
 * SHEF_ERR_FORMAT: no readable index. SHEF_ERR_UNSUPPORTED: of a later version.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_triggers_open(
    const char *path, struct shef_recorded_triggers **out_triggers, struct shef_error *err);

/* Reads the next edge.
 *   out_follows  whether no edge is missing between the one before and this; may be NULL
 * SHEF_ERR_EMPTY: there are no more. Errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_triggers_next(struct shef_recorded_triggers *triggers,
                                                          struct shef_edge *out_edge,
                                                          bool *out_follows,
                                                          struct shef_error *err);

/* Whose lines they are: "gpiochip0"; "" if it is not said. Valid until close(). */
const char *shef_recorded_triggers_chip(const struct shef_recorded_triggers *triggers);

/* The i-th line that was watched. Returns false behind the last. */
bool shef_recorded_triggers_line(const struct shef_recorded_triggers *triggers, int i,
                                 struct shef_edge_line *out_line);

/* What was found so far; complete after SHEF_ERR_EMPTY. */
const struct shef_damage *shef_recorded_triggers_damage(
    const struct shef_recorded_triggers *triggers);

/* The i-th note, NULL behind the last. They come with the end. */
const char *shef_recorded_triggers_note(const struct shef_recorded_triggers *triggers, int i);

/* NULL is allowed. */
void shef_recorded_triggers_close(struct shef_recorded_triggers *triggers);

#ifdef __cplusplus
}
#endif

#endif
