/* The host clock, handed to whoever needs it, so that tests neither wait nor race.
 *
 * Time-outs and state machines take a `const struct shef_clock *`; main programs hand in
 * shef_clock_monotonic(), tests a manual clock that moves only when told to. */
#ifndef SHEF_CORE_CLOCK_H
#define SHEF_CORE_CLOCK_H

#include <stdatomic.h>
#include <stdint.h>

#include "core/time.h"

struct shef_clock {
    shef_host_time (*now)(const struct shef_clock *clock);
};

/* The time now.                                                   Thread: any. */
static inline shef_host_time shef_clock_now(const struct shef_clock *clock)
{
    return clock->now(clock);
}

/* CLOCK_MONOTONIC: never steps back, stands still while the computer sleeps. */
const struct shef_clock *shef_clock_monotonic(void);

/* A clock that stands still until it is moved. Hand &manual.clock to the code under test. */
struct shef_manual_clock {
    struct shef_clock clock;
    _Atomic int64_t now_ns;
};

void shef_manual_clock_init(struct shef_manual_clock *manual, shef_host_time start);

/* Moves the clock forward.                                        Thread: any.
 *   duration_ns  0 or more */
void shef_manual_clock_advance(struct shef_manual_clock *manual, int64_t duration_ns);

#endif
