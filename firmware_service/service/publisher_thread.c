/* The thread that publishes: results from the ring, and what the publisher does between them.
 *
 * When publishing takes longer than frames come, readers get fewer frames, not older ones. */
#include "service/playback_internal.h"

static int32_t ms_to_next_tick(const struct shef_playback *playback)
{
    shef_host_time next;
    int64_t left_ns;

    if (!shef_publisher_next_tick(playback->publisher, &next))
        return -1;
    left_ns = shef_host_time_since(next, shef_clock_now(playback->pace.clock));
    return left_ns > 0 ? (int32_t)(left_ns / SHEF_NS_PER_MS + 1) : 0;
}

/* A finished frame may wait for the publisher as long as a complete one for the chain. */
static bool is_stale(const struct shef_playback *playback, const struct shef_result_item *item)
{
    const int32_t after_ms = shef_live_get(&playback->live->shed_after_ms[SHEF_SHED_FRAME]);

    return shef_pace_is_live(&playback->pace) &&
           shef_host_time_since(shef_clock_now(playback->pace.clock), item->finished) >
               after_ms * SHEF_NS_PER_MS;
}

void shef_playback_publish(struct shef_playback *playback, struct shef_result *result)
{
    /* A bit for each kind of work, in the order of the levels. */
    for (int i = 0; i < SHEF_SHED_FRAME; i++)
        shef_count(&playback->counters.n_shed[i], result->shed_bits >> i & 1);
    shef_publisher_result(playback->publisher, result);
}

static void use_result(struct shef_playback *playback, const struct shef_result_item *item)
{
    if (is_stale(playback, item)) {
        shef_count(&playback->counters.n_results_stale, 1);
        shef_result_give(item->result);
    } else {
        shef_playback_publish(playback, item->result);
    }
    shef_count(&playback->counters.n_results_done, 1);
}

/* Everything that came in has gone out. */
static void end(struct shef_playback *playback)
{
    /* Acquire: the failure's sentence becomes visible with the flag. */
    const bool has_failed = atomic_load_explicit(&playback->has_failed, memory_order_acquire);

    /* Release: the same for whoever reads the state. */
    atomic_store_explicit(&playback->state, has_failed ? SHEF_PLAYBACK_FAILED : SHEF_PLAYBACK_ENDED,
                          memory_order_release);
    shef_wake_signal(playback->end_wake);
}

void shef_publisher_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *wake = shef_graph_wake(playback->graph, "publisher");
    struct shef_result_item item;

    while (!shef_pace_is_stopping(&playback->pace)) {
        shef_wake_wait(wake, ms_to_next_tick(playback));
        while (shef_link_pop(playback->results_in, &item) == SHEF_OK) {
            if (item.result)
                use_result(playback, &item);
            shef_pace_done(&playback->pace);
            if (!item.result)
                end(playback);
        }
        shef_publisher_tick(playback->publisher);
    }
}
