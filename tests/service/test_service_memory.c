/* Nothing is allocated while a recording plays. */
#include <pthread.h>
#include <string.h>
#include <unistd.h>

#include "played.h"
#include "support/alloc_watch.h"
#include "support/support.h"

static void wait_for_frames(struct shef_service *service, uint64_t n)
{
    const struct shef_counters *counters = shef_playback_counters(service->playback);

    while (shef_counter_get(&counters->n_results_done) < n)
        usleep(5000);
}

static void test_streaming_threads_allocate_nothing_after_the_start(void)
{
    static const char *const pipeline[] = { "filter", "stereo", "workers" };
    static const char *const streaming[] = { "events", "frames", "poses", "publisher" };
    struct shef_config config;
    struct shef_service *service;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    config = played_config();
    config.source.loop = true;
    service = played_start(&config);
    wait_for_frames(service, 10);
    shef_alloc_watch_start();
    /* Several passes, so that starting again is among it. */
    wait_for_frames(service, 10 + 4 * PLAYED_FRAMES);
    shef_alloc_watch_stop();
    shef_service_stop(service);
    shef_service_destroy(service);
    shef_alloc_watch_print(stdout);
    for (size_t i = 0; i < sizeof pipeline / sizeof pipeline[0]; i++)
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, shef_alloc_watch_calls(pipeline[i], false),
                                         pipeline[i]);
    for (size_t i = 0; i < sizeof streaming / sizeof streaming[0]; i++)
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, shef_alloc_watch_calls(streaming[i], true),
                                         streaming[i]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_streaming_threads_allocate_nothing_after_the_start);
    return UNITY_END();
}
