/* A numbered pool of snapshots: one thread fills them, others borrow them by number.
 *
 * A finished snapshot never changes while somebody holds it. The writer reuses the oldest one that
 * nobody holds; if all are held or being filled, the new one is lost and counted. No locks. */
#ifndef SHEF_PIPELINE_SNAPSHOT_POOL_H
#define SHEF_PIPELINE_SNAPSHOT_POOL_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The rising edge was lost: mid is where one was due. */
#define SHEF_SNAPSHOT_PREDICTED (1u << 0)
/* Its edge came after events newer than the read-out: they are in it. */
#define SHEF_SNAPSHOT_LATE_TRIGGER (1u << 1)
/* The falling edge was lost: exposure is assumed. */
#define SHEF_SNAPSHOT_NO_FALL (1u << 2)

/* So many can be filled at once: each for 25 ms at most, so at 120 frames/s three overlap. */
#define SHEF_SNAPSHOT_MAX_FILLING 4

/* What the events say about one frame, on the sensor's own pixels. Values are in 1/256 contrast
 * step. Images have SHEF_WARP_PAD_BYTES readable behind them. */
struct shef_snapshot {
    uint64_t number;
    shef_event_time rise;
    shef_event_time mid; /* mid-exposure, as used */
    int64_t exposure_ns; /* seen, or assumed where SHEF_SNAPSHOT_NO_FALL */
    int64_t t_err_ns;    /* bound of how far mid is from the true middle */
    uint32_t flags;      /* SHEF_SNAPSHOT_... */
    uint32_t epoch;      /* of the filter: only snapshots of one epoch have sums to compare */
    uint64_t n_events;   /* applied before mid, since the filter started */
    struct shef_image_i16 values; /* of the filter: the edges at mid */
    struct shef_image_i16 sums;   /* running sums at mid, modulo 2^16 */
};

struct shef_snapshot_pool;

/* Allocates all snapshots.                                        Thread: setup.
 *   n_snapshots  4..64
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_snapshot_pool_create(struct shef_snapshot_pool **out_pool,
                                                        int32_t n_snapshots, int32_t width_px,
                                                        int32_t height_px, struct shef_error *err);

/* All must have been given back. NULL is allowed.                 Thread: setup. */
void shef_snapshot_pool_destroy(struct shef_snapshot_pool *pool);

/* A snapshot to fill, with a scratch image for as long as it is filled. Thread: the writer.
 * NULL: none is free, or SHEF_SNAPSHOT_MAX_FILLING are being filled; counted. */
struct shef_snapshot *shef_snapshot_pool_begin(struct shef_snapshot_pool *pool,
                                               struct shef_image_i16 *out_scratch);

/* Makes a filled snapshot available under its number, which must be higher than all before it
 * that were published.                                            Thread: the writer. */
void shef_snapshot_pool_publish(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot);

/* Drops a snapshot that was begun.                                Thread: the writer. */
void shef_snapshot_pool_cancel(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot);

/* Borrows a snapshot for reading until give().                    Thread: any.
 * SHEF_ERR_EMPTY: not published yet. SHEF_ERR_GONE: reused since, or never taken. */
SHEF_MUST_CHECK enum shef_err shef_snapshot_pool_take(struct shef_snapshot_pool *pool,
                                                      uint64_t number,
                                                      const struct shef_snapshot **out_snapshot);

/* Gives it back.                                                  Thread: any. */
void shef_snapshot_pool_give(struct shef_snapshot_pool *pool, const struct shef_snapshot *snapshot);

/* The number after the newest published one; 0: none yet.         Thread: any. */
uint64_t shef_snapshot_pool_end(const struct shef_snapshot_pool *pool);

/* How many were lost for want of a free one.                      Thread: any. */
uint64_t shef_snapshot_pool_lost_count(const struct shef_snapshot_pool *pool);

#ifdef __cplusplus
}
#endif

#endif
