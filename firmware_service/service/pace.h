/* When a source's next item may go: in real time, or in lockstep with the rest of the service.
 *
 * At recorded pace an item goes when it is due by the clock: as long after the start as it once
 * arrived. At stepped pace the sources take turns in the order in which their items once arrived,
 * and each item waits until everybody has done with the one before. At fast pace they take turns
 * too, but a few items may be under way.
 *
 * Everybody who gets an item out of another one tells begun() before handing it on, and done() when
 * it has been dealt with. No locks, no allocation. */
#ifndef SHEF_SERVICE_PACE_H
#define SHEF_SERVICE_PACE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "config/config.h"
#include "core/clock.h"
#include "core/wake.h"

#ifdef __cplusplus
extern "C" {
#endif

/* In this order where two items arrived at the same time. */
enum shef_pace_source { SHEF_PACE_POSES, SHEF_PACE_FRAMES, SHEF_PACE_EVENTS, SHEF_PACE_SOURCES };

struct shef_pace {
    /* Set by init. */
    enum shef_config_pace kind;
    const struct shef_clock *clock;
    int32_t max_under_way;
    struct shef_wake *wakes[SHEF_PACE_SOURCES]; /* set by whoever starts the threads */
    /* Set before the threads start: what to add to recorded arrival times; 0 unless recorded. */
    int64_t host_shift_ns;
    /* Each source writes its own; INT64_MIN: not yet known, INT64_MAX: ended. */
    _Atomic int64_t next_ns[SHEF_PACE_SOURCES];
    /* The same; it has nothing to do: it waits for the clock, or has ended. */
    _Atomic bool is_idle[SHEF_PACE_SOURCES];
    _Atomic int32_t n_under_way;
    _Atomic bool is_stopping;
};

/* Thread: setup. */
void shef_pace_init(struct shef_pace *pace, enum shef_config_pace kind,
                    const struct shef_clock *clock);

static inline bool shef_pace_is_live(const struct shef_pace *pace)
{
    return pace->kind == SHEF_PACE_RECORDED;
}

/* Waits until an item may go.                                     Thread: that source.
 *   arrived  by the recording's host clock, passes counted in
 * False: the service stops. */
bool shef_pace_wait(struct shef_pace *pace, enum shef_pace_source source, shef_host_time arrived);

/* The item has gone, or was dropped; the source looks for its next one. Thread: that source. */
void shef_pace_went(struct shef_pace *pace, enum shef_pace_source source);

/* This source has no more items.                                  Thread: that source. */
void shef_pace_ended(struct shef_pace *pace, enum shef_pace_source source);

/* An item more is under way, or one less.                         Thread: any. */
void shef_pace_begun(struct shef_pace *pace);
void shef_pace_done(struct shef_pace *pace);

/* How many are.                                                   Thread: any. */
int32_t shef_pace_under_way(const struct shef_pace *pace);

/* Whether a source waits for the clock or has ended, for watchdogs. A source that waits for its
 * turn is not idle: somebody has to give it the turn.             Thread: any. */
bool shef_pace_is_idle(const struct shef_pace *pace, enum shef_pace_source source);

/* Makes every wait() return false.                                Thread: control. */
void shef_pace_stop(struct shef_pace *pace);

bool shef_pace_is_stopping(const struct shef_pace *pace);

#ifdef __cplusplus
}
#endif

#endif
