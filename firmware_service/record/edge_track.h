/* The sync edges of a recording in memory: the host's copy, beside the one in the events.
 * Thread: any. */
#ifndef SHEF_RECORD_EDGE_TRACK_H
#define SHEF_RECORD_EDGE_TRACK_H

#include <stddef.h>

#include "core/error.h"
#include "record/trigger_part.h"

struct shef_edge_track {
    struct shef_edge *edges; /* as they were recorded; owned */
    size_t n;
    char chip[SHEF_EDGE_NAME_BYTES];
    struct shef_edge_line lines[SHEF_EDGE_MAX_LINES];
    uint32_t n_lines;
};

/* Reads all edges.
 * SHEF_ERR_NOT_FOUND: the recording has none. Others as shef_recorded_triggers_open(). */
SHEF_MUST_CHECK enum shef_err shef_edge_track_read(const char *recording,
                                                   struct shef_edge_track *out_edges,
                                                   struct shef_error *err);

/* A zeroed list is allowed. */
void shef_edge_track_free(struct shef_edge_track *edges);

#endif
