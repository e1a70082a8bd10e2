#include "core/clock.h"

#include <assert.h>
#include <stddef.h>
#include <time.h>

static shef_host_time monotonic_now(const struct shef_clock *clock)
{
    struct timespec now;

    (void)clock;
    /* Cannot fail: the clock exists on every Linux and the address is ours. */
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (shef_host_time){ now.tv_sec * SHEF_NS_PER_S + now.tv_nsec };
}

const struct shef_clock *shef_clock_monotonic(void)
{
    static const struct shef_clock monotonic = { monotonic_now };

    return &monotonic;
}

static shef_host_time manual_now(const struct shef_clock *clock)
{
    const struct shef_manual_clock *manual =
        (const struct shef_manual_clock *)((const char *)clock -
                                           offsetof(struct shef_manual_clock, clock));

    /* Acquire, with the release in advance(): who sees the new time sees what came before it. */
    return (shef_host_time){ atomic_load_explicit(&manual->now_ns, memory_order_acquire) };
}

void shef_manual_clock_init(struct shef_manual_clock *manual, shef_host_time start)
{
    manual->clock.now = manual_now;
    atomic_init(&manual->now_ns, start.ns);
}

void shef_manual_clock_advance(struct shef_manual_clock *manual, int64_t duration_ns)
{
    assert(duration_ns >= 0);
    /* Release: see manual_now(). */
    atomic_fetch_add_explicit(&manual->now_ns, duration_ns, memory_order_release);
}
