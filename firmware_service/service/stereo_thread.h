/* The stereo thread: pairs frames with snapshots, runs the depth chain, hands results on.
 *
 * Frames that arrive before their snapshots wait here, and the other way round. Every frame that
 * comes in leaves as a finished result or is counted as lost, with the reason. */
#ifndef SHEF_SERVICE_STEREO_THREAD_H
#define SHEF_SERVICE_STEREO_THREAD_H

#include "core/error.h"
#include "core/workers.h"
#include "pipeline/depth_chain.h"
#include "publish/result.h"
#include "service/counters.h"
#include "service/graph.h"
#include "service/live.h"
#include "service/pace.h"
#include "service/source.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_stereo_stage;

struct shef_stereo_stage_params {
    const struct shef_config *config; /* kept */
    const struct shef_source *source;
    struct shef_snapshot_pool *snapshots;
    struct shef_workers *workers; /* may be NULL */
    struct shef_graph *graph;     /* fetches its ends of frames, snapshots, poses and results */
    struct shef_pace *pace;
    struct shef_live *live;
    struct shef_counters *counters;
    _Atomic(struct shef_result *) *newest; /* where the newest result is left for pictures */
    int64_t utc_minus_mono_ns;
    int64_t session_id;
};

/* Allocates everything but the results.                           Thread: setup.
 * SHEF_ERR_INVALID: a calibration that makes no stereo pair. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_stereo_stage_create(
    const struct shef_stereo_stage_params *params, struct shef_stereo_stage **out_stage,
    struct shef_error *err);

/* NULL is allowed.                                                Thread: setup. */
void shef_stereo_stage_destroy(struct shef_stereo_stage *stage);

/* What its results say of themselves.                             Thread: any. */
void shef_stereo_stage_identity(const struct shef_stereo_stage *stage, int64_t *out_session_id,
                                uint8_t out_calib_id[SHEF_CALIB_ID_BYTES]);

struct shef_depth_geometry shef_stereo_stage_geometry(const struct shef_stereo_stage *stage);

/* Where results come from; before the thread starts.              Thread: setup. */
void shef_stereo_stage_set_results(struct shef_stereo_stage *stage,
                                   struct shef_result_pool *results);

/* The thread: until the pace says stop.
 *   context  the stage */
void shef_stereo_thread(void *context);

/* Gives back what it holds and what waits in its rings, after the thread has ended.
 *                                                                 Thread: setup. */
void shef_stereo_stage_empty(struct shef_stereo_stage *stage);

#ifdef __cplusplus
}
#endif

#endif
