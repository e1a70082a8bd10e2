/* Snapshots of the filter at the middle of each frame's exposure, scheduled by the event stream.
 *
 * Takes the decoded batches, runs the filter (and learns hot pixels) and stops it exactly where
 * event time passes an instant that matters. Events after the instant are never in a snapshot,
 * though they sit in the same batch, and a snapshot depends on the stream alone: not on how it was
 * cut into batches, nor on when the frame arrives.
 *
 * Where edges are at mid-exposure
 *   The filter's memory of 1 / cutoff trails behind a moving edge: up to 1.1 px at f 555 px and
 *   0.35 m/s, to the other side on the way back. Three ways to read it:
 *     AT_MID    at mid-exposure, with the trail: as published
 *     LATE      1 / cutoff later: the trail's centre of gravity is where the edge was, but its
 *               shape is lopsided, which still moves what a correlation finds by 0.2 px at 0.35 m/s
 *     CENTRED   at mid-exposure, plus the events of the next 3 / cutoff (25 ms) with weights that
 *               fall as the past's do: a trail on both sides, the same in both directions. Default.
 *               It also correlates better, as it has seen twice the events.
 *   What the events' threshold adds is a constant along the image flow: shef_warp_shift_set().
 *   test_event_edges_motion measures all this.
 *
 * After create() nothing allocates, locks or logs.
 * Thread: one feeds, any number take and give. Time: event time. */
#ifndef SHEF_PIPELINE_SNAPSHOT_H
#define SHEF_PIPELINE_SNAPSHOT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/packets.h"
#include "pipeline/filter.h"
#include "pipeline/hot_pixels.h"
#include "pipeline/snapshot_pool.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_snapshot_read {
    SHEF_SNAPSHOT_AT_MID,
    SHEF_SNAPSHOT_LATE,
    SHEF_SNAPSHOT_CENTRED,
};

struct shef_snapshot_params {
    enum shef_snapshot_read read;
    int32_t n_steps;         /* of the centred read-out, 1..4: until 0.5, 1.1, 2 or 3 / cutoff;
                              * fewer give it sooner but less symmetric */
    int32_t n_snapshots;     /* in the pool, 4..64 */
    int32_t channel;         /* trigger input that carries the exposure signal, 0..31 */
    bool is_inverted;        /* the signal is low during the exposure */
    int64_t exposure_ns;     /* assumed until seen, 0..1 s */
    int64_t exposure_err_ns; /* how wrong that may be, 0..1 s */
    int64_t delay_ns;        /* an exposure, as the events show it, is this much later than the
                              * trigger input says: delays of both cameras, +-100 ms */
    int32_t max_predicted;   /* lost triggers in a row that are made up for, 0..1000 */
};

/* CENTRED with 4 steps, 8 snapshots, channel 0, 5 ms of exposure give or take 5, no delay, 4 lost
 * triggers. */
struct shef_snapshot_params shef_snapshot_default_params(void);

struct shef_snapshots;

/* Allocates the pool.                                             Thread: setup.
 *   filter  kept and used until destroy(), as is
 *   hot     the same; NULL: hot pixels are not learnt and the filter's mask stays as it is
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_snapshots_create(struct shef_snapshots **out_snapshots,
                                                    struct shef_filter *filter,
                                                    struct shef_hot_pixels *hot,
                                                    const struct shef_snapshot_params *params,
                                                    struct shef_error *err);

/* Leaves filter and hot pixels to their owner. NULL is allowed.   Thread: setup. */
void shef_snapshots_destroy(struct shef_snapshots *snapshots);

/* Applies a batch and takes the snapshots that fall due.          Thread: the feeder.
 * Returns how many were published. */
uint32_t shef_snapshots_feed(struct shef_snapshots *snapshots,
                             const struct shef_event_batch *batch);

/* The finished snapshots.                                         Thread: any, see there. */
struct shef_snapshot_pool *shef_snapshots_pool(struct shef_snapshots *snapshots);

struct shef_snapshot_stats {
    uint64_t n_triggers; /* edges on the channel */
    uint64_t n_published;
    uint64_t n_lost;      /* no free snapshot in the pool, or too many at once */
    uint64_t n_predicted; /* published, but their trigger was lost */
    uint64_t n_late;      /* published, but their trigger came too late */
    uint64_t n_dropped;   /* time jumped back before they were complete */
    uint64_t n_irregular; /* intervals between triggers that broke their rhythm */
    int64_t period_ns;    /* of the triggers; 0: not regular */
    int64_t exposure_ns;  /* the latest */
};

/* Thread: the feeder. */
struct shef_snapshot_stats shef_snapshots_stats(const struct shef_snapshots *snapshots);

#ifdef __cplusplus
}
#endif

#endif
