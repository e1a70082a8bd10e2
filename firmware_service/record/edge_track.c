#include "record/edge_track.h"

#include <stdio.h>
#include <stdlib.h>

#include "record/recorded_triggers.h"

static enum shef_err add(struct shef_edge_track *track, size_t *capacity,
                         const struct shef_edge *edge, struct shef_error *err)
{
    if (track->n == *capacity) {
        const size_t n = *capacity > 0 ? 2 * *capacity : 1024;
        struct shef_edge *more = reallocarray(track->edges, n, sizeof *more);

        if (!more)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "sync edges: no memory for %zu of them", n);
        track->edges = more;
        *capacity = n;
    }
    track->edges[track->n++] = *edge;
    return SHEF_OK;
}

enum shef_err shef_edge_track_read(const char *recording, struct shef_edge_track *out_edges,
                                   struct shef_error *err)
{
    struct shef_recorded_triggers *reader;
    struct shef_edge_track track = { 0 };
    struct shef_edge edge;
    size_t capacity = 0;
    enum shef_err code = shef_recorded_triggers_open(recording, &reader, err);

    if (code == SHEF_ERR_EMPTY)
        return shef_fail(err, SHEF_ERR_NOT_FOUND, "'%s' has no sync edges", recording);
    if (code != SHEF_OK)
        return code;
    snprintf(track.chip, sizeof track.chip, "%s", shef_recorded_triggers_chip(reader));
    while (track.n_lines < SHEF_EDGE_MAX_LINES &&
           shef_recorded_triggers_line(reader, (int)track.n_lines, &track.lines[track.n_lines]))
        track.n_lines++;
    while (code == SHEF_OK &&
           (code = shef_recorded_triggers_next(reader, &edge, NULL, err)) == SHEF_OK)
        code = add(&track, &capacity, &edge, err);
    shef_recorded_triggers_close(reader);
    if (code == SHEF_ERR_EMPTY)
        code = track.n > 0
                   ? SHEF_OK
                   : shef_fail(err, SHEF_ERR_NOT_FOUND, "'%s' has no sync edges", recording);
    if (code == SHEF_OK)
        *out_edges = track;
    else
        shef_edge_track_free(&track);
    return code;
}

void shef_edge_track_free(struct shef_edge_track *edges)
{
    free(edges->edges);
    *edges = (struct shef_edge_track){ 0 };
}
