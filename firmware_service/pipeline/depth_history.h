/* The last frames, rectified, with their snapshots' running sums: what temporal pairs are made of.
 *
 * Memory is allocated once. Thread: one at a time. */
#ifndef SHEF_PIPELINE_DEPTH_HISTORY_H
#define SHEF_PIPELINE_DEPTH_HISTORY_H

#include <stdbool.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/snapshot_pool.h"

#define SHEF_DEPTH_HISTORY 14 /* frames, the current one included: 12 mm at 0.05 m/s and 54 Hz */

struct depth_past {
    bool is_set;
    int64_t number;
    shef_event_time mid;
    uint32_t epoch;               /* of the filter's sums */
    uint64_t n_events;            /* applied before mid */
    struct shef_image_u8 picture; /* rectified */
    struct shef_image_i16 sums;   /* SHEF_WARP_PAD_BYTES readable behind them */
};

struct shef_depth_history {
    struct depth_past at[SHEF_DEPTH_HISTORY];
    int32_t newest;
    size_t memory_bytes;
};

/* Sizes of the profile and of the event sensor. SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err depth_history_create(struct shef_depth_history *out_history,
                                                   int32_t width_px, int32_t height_px,
                                                   int32_t sensor_width_px,
                                                   int32_t sensor_height_px,
                                                   struct shef_error *err);

/* A zeroed history is allowed. */
void depth_history_destroy(struct shef_depth_history *history);

/* Forgets all frames. */
void depth_history_clear(struct shef_depth_history *history);

/* Takes a frame in, in the place of the oldest; its picture is for the caller to fill. */
struct depth_past *depth_history_add(struct shef_depth_history *history, int64_t number,
                                     const struct shef_snapshot *snapshot);

/* The frame before the newest; NULL: there is none. */
const struct depth_past *depth_history_before(const struct shef_depth_history *history);

/* Whether there is room for more frames that can be compared with the newest. */
bool depth_history_grows(const struct shef_depth_history *history);

/* The earlier frame whose distance in time from the newest is nearest to span_ns.
 * NULL: there is none whose sums can be compared. */
const struct depth_past *depth_history_find(const struct shef_depth_history *history,
                                            int64_t span_ns);

/* The same by the number of events between the two. */
const struct depth_past *depth_history_find_events(const struct shef_depth_history *history,
                                                   uint64_t n_events);

#endif
