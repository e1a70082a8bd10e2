#include "service/wiring.h"

/* A buffer of events covers a few ms at most; a frame period at 54 fps is 18.5 ms. */
static const struct shef_graph_thread_row threads[] = {
    { "events", SHEF_THREAD_EVENTS, "the next buffer's time", 2 },
    { "frames", SHEF_THREAD_FRAMES, "the next frame's time", 18 },
    { "poses", SHEF_THREAD_POSES, "the next pose's time", 8 },
    { "filter", SHEF_THREAD_FILTER, "raw_events", 5 },
    { "stereo", SHEF_THREAD_STEREO, "frames, snapshots, poses", 18 },
    { "publisher", SHEF_THREAD_PUBLISHER, "results", 18 },
    { "record_events", SHEF_THREAD_RECORDER, "record_events", 0 },
    { "record_frames", SHEF_THREAD_RECORDER, "record_frames", 0 },
    { "record_poses", SHEF_THREAD_RECORDER, "record_poses", 0 },
    { "record_triggers", SHEF_THREAD_RECORDER, "record_triggers", 0 },
    /* Last: not there where the stereo thread works alone. */
    { "workers", SHEF_THREAD_WORKERS, "stereo", 18 },
};

static const struct shef_graph_ring_row rings[] = {
    { "raw_events", "events", "filter", SHEF_RING_EVENTS, sizeof(struct shef_event_item) },
    { "frames", "frames", "stereo", SHEF_RING_FRAMES, sizeof(struct shef_frame_item) },
    { "poses", "poses", "stereo", SHEF_RING_POSES, sizeof(struct shef_pose_item) },
    { "snapshots", "filter", "stereo", SHEF_RING_SNAPSHOTS, sizeof(struct shef_snapshot_item) },
    { "results", "stereo", "publisher", SHEF_RING_RESULTS, sizeof(struct shef_result_item) },
    { "record_events", "events", "record_events", SHEF_RING_RECORD_EVENTS,
      sizeof(struct shef_recorded_event_item) },
    { "record_frames", "frames", "record_frames", SHEF_RING_RECORD_FRAMES,
      sizeof(struct shef_recorded_frame_item) },
    { "record_poses", "poses", "record_poses", SHEF_RING_RECORD_POSES,
      sizeof(struct shef_recorded_pose_item) },
    { "record_triggers", "frames", "record_triggers", SHEF_RING_RECORD_TRIGGERS,
      sizeof(struct shef_recorded_edge_item) },
};

enum shef_err shef_wiring_create(const struct shef_config *config, struct shef_graph **out_graph,
                                 struct shef_error *err)
{
    const int n_threads = (int)(sizeof threads / sizeof threads[0]) - (config->depth.workers < 2);

    return shef_graph_create(threads, n_threads, rings, sizeof rings / sizeof rings[0], config,
                             out_graph, err);
}
