/* A source while it plays: all threads, rings and pools from the recording to the publisher.
 *
 * create() allocates everything; from start() to stop() the streaming threads allocate nothing.
 * At the recording's end the threads stay, with nothing to do, so that the last state can be looked
 * at; stop() ends them at any time. Thread: control, unless noted. */
#ifndef SHEF_SERVICE_PLAYBACK_H
#define SHEF_SERVICE_PLAYBACK_H

#include <stdbool.h>

#include "config/config.h"
#include "core/error.h"
#include "core/wake.h"
#include "publish/publisher.h"
#include "service/counters.h"
#include "service/graph.h"
#include "service/live.h"
#include "service/source.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_playback;
struct shef_recorder;

struct shef_playback_params {
    const struct shef_config *config; /* its source.recording is played; copied */
    struct shef_live *live;           /* kept */
    struct shef_wake *end_wake;       /* signalled when the source has ended; kept */
};

enum shef_playback_state {
    SHEF_PLAYBACK_PLAYING,
    SHEF_PLAYBACK_ENDED,
    SHEF_PLAYBACK_FAILED,
};

/* Opens the recording and allocates. Errors are those of shef_source_open() and of each part. */
SHEF_MUST_CHECK enum shef_err shef_playback_create(const struct shef_playback_params *params,
                                                   struct shef_playback **out_playback,
                                                   struct shef_error *err);

/* Starts the threads, sinks first. On failure none runs. */
SHEF_MUST_CHECK enum shef_err shef_playback_start(struct shef_playback *playback,
                                                  struct shef_error *err);

/* Ends the work in hand and joins the threads, sources first. */
void shef_playback_stop(struct shef_playback *playback);

/* Frees a stopped playback. NULL is allowed. */
void shef_playback_destroy(struct shef_playback *playback);

enum shef_playback_state shef_playback_state(const struct shef_playback *playback);

/* Why it failed; SHEF_OK if it has not. */
enum shef_err shef_playback_outcome(const struct shef_playback *playback, struct shef_error *err);

/* What is behind it, for reports. */
const struct shef_source *shef_playback_source(const struct shef_playback *playback);
const struct shef_counters *shef_playback_counters(const struct shef_playback *playback);
struct shef_graph *shef_playback_graph(const struct shef_playback *playback);
const struct shef_publisher *shef_playback_publisher(const struct shef_playback *playback);
struct shef_recorder *shef_playback_recorder(struct shef_playback *playback);

/* How far the events have come, from the start of the present pass. */
double shef_playback_position_s(const struct shef_playback *playback);

/* Borrows the newest result until shef_result_give(). NULL: there is none. */
struct shef_result *shef_playback_newest(struct shef_playback *playback);

/* Hands changed outputs on to the publisher. */
void shef_playback_apply(struct shef_playback *playback);

/* Grows whenever the service is seen to work: asked regularly, it grows unless a stage that has
 * something to do has done nothing since it was asked last. */
uint64_t shef_playback_progress(struct shef_playback *playback);

#ifdef __cplusplus
}
#endif

#endif
