/* The filter thread: decodes raw buffers, runs the filter, takes snapshots at the frames' triggers.
 *
 * Finished snapshots are borrowed from their pool and handed to the stereo thread, which gives them
 * back. */
#ifndef SHEF_SERVICE_FILTER_THREAD_H
#define SHEF_SERVICE_FILTER_THREAD_H

#include "core/error.h"
#include "service/counters.h"
#include "service/graph.h"
#include "service/pace.h"
#include "service/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Snapshots in the pool, of 1.2 MB each: 10 that the stereo thread holds until the first frames'
 * delays show whose they are, 2 in the making, and 6 on their way, which at 54 frames/s cover
 * 110 ms; a frame that waits for 30 ms is left out anyway. */
#define SHEF_FILTER_SNAPSHOTS 18

struct shef_filter_stage;

struct shef_filter_stage_params {
    const struct shef_source *source;
    struct shef_graph *graph; /* fetches its ends of raw_events and snapshots */
    struct shef_pace *pace;
    struct shef_counters *counters;
    int32_t look_ahead; /* n_steps of struct shef_snapshot_params */
};

/* Allocates everything.                                           Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_filter_stage_create(
    const struct shef_filter_stage_params *params, struct shef_filter_stage **out_stage,
    struct shef_error *err);

/* All snapshots must have been given back. NULL is allowed.       Thread: setup. */
void shef_filter_stage_destroy(struct shef_filter_stage *stage);

/* Of what the snapshots are.                                      Thread: any. */
struct shef_snapshot_pool *shef_filter_stage_pool(struct shef_filter_stage *stage);

/* The thread: until the pace says stop.
 *   context  the stage */
void shef_filter_thread(void *context);

/* Gives back what waits in the ring of a thread that has ended.   Thread: setup. */
void shef_filter_stage_empty(struct shef_filter_stage *stage);

#ifdef __cplusplus
}
#endif

#endif
