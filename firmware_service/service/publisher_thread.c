/* The thread that publishes: results from the ring, and what the publisher does between them. */
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
                shef_publisher_result(playback->publisher, item.result);
            shef_count(&playback->counters.n_results_done, item.result != NULL);
            shef_pace_done(&playback->pace);
            if (!item.result)
                end(playback);
        }
        shef_publisher_tick(playback->publisher);
    }
}
