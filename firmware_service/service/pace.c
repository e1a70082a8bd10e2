#include "service/pace.h"

#include <poll.h>
#include <time.h>

/* So many items keep every stage busy at fast pace, and no ring full. */
#define MAX_UNDER_WAY_FAST 4

void shef_pace_init(struct shef_pace *pace, enum shef_config_pace kind,
                    const struct shef_clock *clock)
{
    *pace = (struct shef_pace){
        .kind = kind,
        .clock = clock,
        .max_under_way = kind == SHEF_PACE_FAST ? MAX_UNDER_WAY_FAST : 0,
    };
    for (int i = 0; i < SHEF_PACE_SOURCES; i++)
        atomic_init(&pace->next_ns[i], INT64_MIN);
}

bool shef_pace_is_stopping(const struct shef_pace *pace)
{
    /* Relaxed: a wake-up follows; until then it does not matter. */
    return atomic_load_explicit(&pace->is_stopping, memory_order_relaxed);
}

static void wake_sources(struct shef_pace *pace)
{
    for (int i = 0; i < SHEF_PACE_SOURCES; i++)
        if (pace->wakes[i])
            shef_wake_signal(pace->wakes[i]);
}

/* Whether all others have shown a later item. Sequentially consistent, as is everything about
 * turns: a source that sees nothing under way must also see who has gone before. */
static bool has_turn(struct shef_pace *pace, enum shef_pace_source source, int64_t own_ns)
{
    for (int i = 0; i < SHEF_PACE_SOURCES; i++) {
        const int64_t other_ns = atomic_load(&pace->next_ns[i]);

        if (i != (int)source && (other_ns < own_ns || (other_ns == own_ns && i < (int)source)))
            return false;
    }
    return atomic_load(&pace->n_under_way) <= pace->max_under_way;
}

/* Sleeps until signalled or until the due time, to the clock's precision. */
static void sleep_until(struct shef_pace *pace, struct shef_wake *wake, shef_host_time due)
{
    const int64_t left_ns = shef_host_time_since(due, shef_clock_now(pace->clock));
    const struct timespec left = { left_ns / SHEF_NS_PER_S, left_ns % SHEF_NS_PER_S };
    struct pollfd watched = { .fd = wake->fd, .events = POLLIN };

    if (left_ns > 0 && ppoll(&watched, 1, &left, NULL) > 0)
        shef_wake_wait(wake, 0);
}

/* Relaxed: for watchdogs; it orders nothing. */
static void set_idle(struct shef_pace *pace, enum shef_pace_source source, bool is_idle)
{
    atomic_store_explicit(&pace->is_idle[source], is_idle, memory_order_relaxed);
}

bool shef_pace_wait(struct shef_pace *pace, enum shef_pace_source source, shef_host_time arrived)
{
    struct shef_wake *wake = pace->wakes[source];

    if (shef_pace_is_live(pace)) {
        const shef_host_time due = shef_host_time_add(arrived, pace->host_shift_ns);

        set_idle(pace, source, true);
        while (!shef_pace_is_stopping(pace) &&
               shef_host_time_before(shef_clock_now(pace->clock), due))
            sleep_until(pace, wake, due);
        set_idle(pace, source, false);
        return !shef_pace_is_stopping(pace);
    }
    atomic_store(&pace->next_ns[source], arrived.ns);
    wake_sources(pace);
    while (!shef_pace_is_stopping(pace) && !has_turn(pace, source, arrived.ns))
        shef_wake_wait(wake, -1);
    return !shef_pace_is_stopping(pace);
}

void shef_pace_went(struct shef_pace *pace, enum shef_pace_source source)
{
    if (!shef_pace_is_live(pace))
        atomic_store(&pace->next_ns[source], INT64_MIN);
}

void shef_pace_ended(struct shef_pace *pace, enum shef_pace_source source)
{
    set_idle(pace, source, true);
    if (shef_pace_is_live(pace))
        return;
    atomic_store(&pace->next_ns[source], INT64_MAX);
    wake_sources(pace);
}

void shef_pace_begun(struct shef_pace *pace)
{
    atomic_fetch_add(&pace->n_under_way, 1);
}

void shef_pace_done(struct shef_pace *pace)
{
    const int32_t n_before = atomic_fetch_sub(&pace->n_under_way, 1);

    if (!shef_pace_is_live(pace) && n_before - 1 <= pace->max_under_way)
        wake_sources(pace);
}

int32_t shef_pace_under_way(const struct shef_pace *pace)
{
    return atomic_load(&pace->n_under_way);
}

bool shef_pace_is_idle(const struct shef_pace *pace, enum shef_pace_source source)
{
    return atomic_load_explicit(&pace->is_idle[source], memory_order_relaxed);
}

void shef_pace_stop(struct shef_pace *pace)
{
    atomic_store(&pace->is_stopping, true);
    wake_sources(pace);
}
