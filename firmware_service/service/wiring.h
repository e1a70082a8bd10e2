/* Which threads the service has while a source runs, and which rings join them.
 *
 *   events --raw_events--> filter --snapshots--> stereo --results--> publisher
 *   frames --frames--------------------------->    ^
 *   poses  --poses---------------------------->    |
 *   events, frames, poses --record_...--> one recorder each; the frames' thread brings the sync
 *   edges, too
 *
 * What lies on the rings refers to buffers of pools; whoever pops an item holds what it refers to
 * and gives it back. Thread: setup. */
#ifndef SHEF_SERVICE_WIRING_H
#define SHEF_SERVICE_WIRING_H

#include <stdbool.h>
#include <stdint.h>

#include "codecs/evt.h"
#include "core/frame.h"
#include "core/packets.h"
#include "core/time.h"
#include "pipeline/snapshot_pool.h"
#include "publish/result.h"
#include "record/pose_track.h"
#include "record/trigger_part.h"
#include "service/graph.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_RING_EVENTS    64
#define SHEF_RING_FRAMES    8
#define SHEF_RING_POSES     32
#define SHEF_RING_SNAPSHOTS 8
#define SHEF_RING_RESULTS   8

/* The rings of recorders: a disk may stand still for this many items. */
#define SHEF_RING_RECORD_EVENTS   256
#define SHEF_RING_RECORD_FRAMES   32
#define SHEF_RING_RECORD_POSES    128
#define SHEF_RING_RECORD_TRIGGERS 128

/* A looped recording is played in passes, counted from 0. Times go on from pass to pass. */
struct shef_event_item {
    struct shef_raw_packet raw; /* buffer NULL: no bytes, see the next two */
    bool has_ended;             /* nothing follows */
    int64_t reached_us;         /* event time has come as far as this without an event */
    uint32_t pass;
    bool follows;          /* nothing is missing before it; otherwise decoding starts anew */
    int64_t time_shift_us; /* to be added to what is decoded */
    uint8_t state[SHEF_EVT_STATE_BYTES]; /* with which it starts then */
};

struct shef_frame_item {
    struct shef_frame_packet frame; /* buffer NULL: the source has ended */
    uint32_t pass;
    shef_host_time complete; /* when it had arrived as a whole, by the clock; 0: no clock counts */
};

struct shef_pose_item {
    bool is_end;
    struct shef_tracked_pose pose;
};

struct shef_snapshot_item {
    const struct shef_snapshot *snapshot; /* borrowed from its pool; NULL: the events have ended */
    uint32_t pass;
    shef_host_time arrived; /* of the buffer that completed it */
    shef_host_time ready;   /* when it was finished, by the clock */
};

struct shef_result_item {
    struct shef_result *result; /* NULL: there will be no more */
    shef_host_time finished;    /* by the clock */
};

#define SHEF_POSE_PACKAGE_BYTES 512

/* What goes to the recorders: the item, which recording of this source it belongs to, counted from
 * 1, and how many before it found no room. */
struct shef_recorded_event_item {
    struct shef_event_item item;
    uint32_t recording;
};

struct shef_recorded_frame_item {
    struct shef_frame_packet frame;
    uint32_t recording;
    uint32_t n_lost_before;
};

struct shef_recorded_pose_item {
    shef_host_time arrived;
    uint32_t recording;
    uint32_t n_lost_before;
    uint32_t n_bytes;
    uint8_t bytes[SHEF_POSE_PACKAGE_BYTES];
};

struct shef_recorded_edge_item {
    struct shef_edge edge;
    uint32_t recording;
    uint32_t n_lost_before;
};

/* The tables of the service, see graph.h. */
SHEF_MUST_CHECK enum shef_err shef_wiring_create(const struct shef_config *config,
                                                 struct shef_graph **out_graph,
                                                 struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
