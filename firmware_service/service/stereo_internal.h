/* What the two halves of the stereo thread share: waiting and pairing, and work on a pair. */
#ifndef SHEF_SERVICE_STEREO_INTERNAL_H
#define SHEF_SERVICE_STEREO_INTERNAL_H

#include <stdbool.h>

#include "pipeline/pairing.h"
#include "service/shed.h"
#include "service/stereo_thread.h"
#include "service/wiring.h"

#define SHEF_STEREO_FRAMES    SHEF_SOURCE_FRAMES
#define SHEF_STEREO_SNAPSHOTS 10
#define SHEF_STEREO_POSES     128

struct shef_held_frame {
    bool is_held;
    bool is_early; /* of a pass whose snapshots have not begun: not yet given to the pairing */
    struct shef_frame_item item;
};

struct shef_stereo_stage {
    /* Set by create. */
    struct shef_stereo_stage_params params;
    struct shef_link *frames_in;
    struct shef_link *snapshots_in;
    struct shef_link *poses_in;
    struct shef_link *results_out;
    struct shef_wake *wake;
    struct shef_depth_chain *chain;
    struct shef_depth_geometry geometry;
    struct shef_result_pool *results;
    uint8_t calib_id[SHEF_CALIB_ID_BYTES];
    /* The stereo thread's. */
    struct shef_pairing pairing;
    shef_host_time locked_at; /* when the first pair was decided: the frames before had to wait */
    uint32_t pass;
    uint64_t n_skipped_before; /* snapshots without a frame, in earlier passes */
    struct shef_held_frame frames[SHEF_STEREO_FRAMES];
    struct shef_snapshot_item snapshots[SHEF_STEREO_SNAPSHOTS]; /* by number */
    int32_t n_snapshots;
    struct shef_tracked_pose poses[2 * SHEF_STEREO_POSES]; /* the newest last */
    size_t n_poses;
    struct shef_shed shed;
    shef_host_time newest_arrival; /* of anything: the time at paces without a clock */
    bool frames_ended;
    bool events_ended;
};

/* Host time of an instant of the events' clock in a pass, by the service's clock if it is live. */
shef_host_time shef_stereo_host(const struct shef_stereo_stage *stage, shef_event_time event,
                                uint32_t pass);

/* Works on a frame and its snapshot; the frame's buffer stays the caller's. */
void shef_stereo_process(struct shef_stereo_stage *stage, const struct shef_frame_item *frame,
                         const struct shef_snapshot_item *snapshot,
                         const struct shef_pairing_result *pairing);

#endif
