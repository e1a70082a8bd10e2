/* Wakes one waiting thread from any other: an eventfd with names.
 *
 * Signals add up until the next wait, so none is lost between looking at a ring and going to
 * sleep. The consumer waits, then drains everything there is. Never allocates after init. */
#ifndef SHEF_CORE_WAKE_H
#define SHEF_CORE_WAKE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_wake {
    int fd; /* readable when signalled, for poll and epoll; -1: none */
};

/* Opens it, not signalled.                                        Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_wake_init(struct shef_wake *wake, struct shef_error *err);

/* Closes it; nobody may wait any more. A second call, or { .fd = -1 }, does nothing. */
void shef_wake_deinit(struct shef_wake *wake);

/* Ends the current wait, or the next one. Does not block.         Thread: any. */
void shef_wake_signal(struct shef_wake *wake);

/* Sleeps until a signal or the time-out.                          Thread: the one that waits.
 *   timeout_ms  0: only looks; negative: forever
 * True: signalled; all signals so far are used up. */
bool shef_wake_wait(struct shef_wake *wake, int32_t timeout_ms);

#ifdef __cplusplus
}
#endif

#endif
