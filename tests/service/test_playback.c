/* A recording through the whole service, in process. */
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "played.h"
#include "service/playback_internal.h"
#include "support/process.h"
#include "support/support.h"

static void read_log(const char *path, uint8_t **out_bytes, size_t *out_n_bytes)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_file_read(path, (size_t)1 << 30, out_bytes, out_n_bytes, &err), err.text);
}

static void test_stepped_playback_publishes_the_same_bytes_every_time(void)
{
    struct shef_config config = played_config();
    uint8_t *bytes[2];
    size_t n_bytes[2];

    for (int i = 0; i < 2; i++) {
        char path[256];

        snprintf(path, sizeof path, "%s", shef_test_temp_path(i == 0 ? "a.log" : "b.log"));
        snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", path);
        /* Nor do they depend on how many threads share the work. */
        config.depth.workers = 1 + i;
        played_whole(&config);
        read_log(path, &bytes[i], &n_bytes[i]);
        unlink(path);
    }
    TEST_ASSERT_GREATER_THAN_size_t(PLAYED_FRAMES * (size_t)10000, n_bytes[0]);
    TEST_ASSERT_EQUAL_size_t(n_bytes[0], n_bytes[1]);
    TEST_ASSERT_EQUAL_MEMORY(bytes[0], bytes[1], n_bytes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

/* Compares a result with what `sheftool run` wrote. */
static void expect_offline(const struct shef_result *result, const char *folder)
{
    struct shef_image_f32 offline;
    struct shef_error err = { 0 };
    char path[1024];
    int64_t n_depths = 0;

    snprintf(path, sizeof path, "%s/disparity/%llu.pfm", folder, (unsigned long long)result->seq);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pfm_read(path, &offline, &err), err.text);
    TEST_ASSERT_EQUAL_INT32(result->disparity.width_px, offline.width_px);
    TEST_ASSERT_EQUAL_INT32(result->disparity.height_px, offline.height_px);
    for (int32_t y = 0; y < offline.height_px; y++) {
        const float *expected = shef_row_f32(offline, y);
        const float *got = shef_row_f32(result->disparity, y);

        TEST_ASSERT_EQUAL_MEMORY(expected, got, (size_t)offline.width_px * sizeof *got);
        for (int32_t x = 0; x < offline.width_px; x++)
            n_depths += got[x] > 0;
    }
    TEST_ASSERT_GREATER_THAN_INT64(1000, n_depths);
    shef_image_destroy_f32(&offline);
}

/* Other modes, and what is on the wire: test_published_depth.c. */
static void test_stepped_disparity_is_what_sheftool_writes(void)
{
    static const char mode[] = "graded";
    static struct shef_test_process sheftool;
    struct shef_config config = played_config();
    struct shef_service *service;
    struct shef_result *result;
    char folder[512];

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(mode));
    shef_test_process_run(&sheftool, "sheftool", NULL, "run %s --out %s --mode %s",
                          played_recording(), folder, mode);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sheftool.status, sheftool.err);
    snprintf(config.depth.mode, sizeof config.depth.mode, "%s", mode);
    service = played_start(&config);
    played_wait(service);
    result = shef_playback_newest(service->playback);
    TEST_ASSERT_NOT_NULL(result);
    expect_offline(result, folder);
    shef_result_give(result);
    shef_service_stop(service);
    shef_service_destroy(service);
}

static void test_at_the_end_every_frame_is_accounted_for(void)
{
    static const int paces[] = { SHEF_PACE_STEPPED, SHEF_PACE_FAST, SHEF_PACE_RECORDED };
    struct shef_config config = played_config();

    for (int i = 0; i < 3; i++) {
        struct shef_service *service;
        json_t *status;

        config.source.pace = paces[i];
        service = played_start(&config);
        played_wait(service);
        played_expect_accounted(service, 0);
        status = played_ask(service, "status", NULL);
        TEST_ASSERT_EQUAL_STRING("ended", json_string_value(json_object_get(status, "state")));
        TEST_ASSERT_EQUAL_INT64(PLAYED_FRAMES, played_number(status, "frames.n_in"));
        /* Without a clock nothing is shed; the events of the last frame end too soon for it. */
        if (paces[i] != SHEF_PACE_RECORDED)
            TEST_ASSERT_GREATER_OR_EQUAL_INT64(PLAYED_FRAMES - 2,
                                               played_number(status, "frames.n_published"));
        json_decref(status);
        shef_service_stop(service);
        shef_service_destroy(service);
    }
}

static void test_a_looped_recording_goes_on_without_losing_a_frame(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    int64_t n_in = 0;

    config.source.loop = true;
    config.source.pace = SHEF_PACE_STEPPED;
    service = played_start(&config);
    while (n_in < 3 * PLAYED_FRAMES) {
        json_t *status = played_ask(service, "status", NULL);

        n_in = played_number(status, "frames.n_in");
        TEST_ASSERT_EQUAL_INT64(0, played_number(status, "frames.n_lost"));
        TEST_ASSERT_EQUAL_INT64(0, played_number(status, "events.n_violations"));
        json_decref(status);
        usleep(2000);
    }
    shef_service_stop(service);
    played_expect_accounted(service, 0);
    shef_service_destroy(service);
}

static void test_a_slow_chain_sheds_work_and_says_so(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    json_t *status;

    config.source.pace = SHEF_PACE_RECORDED;
    config.source.loop = true;
    config.lcm.dense = true;
    config.lcm.cloud = true;
    config.lcm.grid = SHEF_GRID_FULL;
    service = played_start(&config);
    /* Slower than the frames come, whatever is left out. */
    atomic_store(&service->live.drag_us, 60000);
    do {
        usleep(20000);
        status = played_ask(service, "status", NULL);
        if (played_number(status, "frames.n_in") >= 8 * PLAYED_FRAMES &&
            played_number(status, "frames.n_published") > 0)
            break;
        json_decref(status);
    } while (true);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(PLAYED_FRAMES, played_number(status, "frames.n_lost"));
#ifndef __SANITIZE_THREAD__
    /* Under the sanitizer frames get lost earlier, for want of buffers. */
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(10, played_number(status, "frames.lost_by.shed"));
    TEST_ASSERT_GREATER_THAN_INT64(0, played_number(status, "frames.shed_by.dense"));
#endif
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(played_number(status, "frames.shed_by.range"),
                                       played_number(status, "frames.shed_by.full_grid"));
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(played_number(status, "frames.shed_by.full_grid"),
                                       played_number(status, "frames.shed_by.cloud"));
    json_decref(status);
    shef_service_stop(service);
    played_expect_accounted(service, 0);
    shef_service_destroy(service);
}

/* Reads a pipe, once it is told to, until it is told to end. */
struct reader {
    pthread_t thread;
    int fd;
    _Atomic bool is_reading;
    _Atomic bool is_ending;
};

static void *read_pipe(void *context)
{
    struct reader *reader = context;
    static char bytes[1 << 16];

    while (!reader->is_ending)
        if (!reader->is_reading || read(reader->fd, bytes, sizeof bytes) <= 0)
            usleep(1000);
    return NULL;
}

static uint64_t count_of(const shef_counter *counter, uint64_t at_least)
{
    for (int i = 0; i < 12000 && shef_counter_get(counter) < at_least; i++)
        usleep(5000);
    return shef_counter_get(counter);
}

static void test_after_a_pause_of_the_network_readers_get_new_frames_instead_of_old_ones(void)
{
    struct shef_config config = played_config();
    const char *path = shef_test_temp_path("pipe");
    struct reader reader = { 0 };
    const struct shef_counters *counters;
    struct shef_service *service;
    uint64_t n_done;

    /* The log is a pipe. Nobody reads it, so that the publisher stands still. */
    TEST_ASSERT_EQUAL_INT(0, mkfifo(path, 0600));
    reader.fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, reader.fd);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&reader.thread, NULL, read_pipe, &reader));
    snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", path);
    config.source.pace = SHEF_PACE_RECORDED;
    config.source.loop = true;
    service = played_start(&config);
    counters = shef_playback_counters(service->playback);

    /* The ring is full when the first frame is lost; four periods later all that is in it is old.
     */
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(4, count_of(&counters->n_lost[SHEF_LOSS_NO_RESULT], 4));
    TEST_ASSERT_EQUAL_UINT64(0, shef_counter_get(&counters->n_results_stale));
    n_done = shef_counter_get(&counters->n_results_done);
    atomic_store(&reader.is_reading, true);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(SHEF_RING_RESULTS,
                                        count_of(&counters->n_results_stale, SHEF_RING_RESULTS));
    TEST_ASSERT_GREATER_THAN_UINT64(
        n_done + 2 * SHEF_RING_RESULTS,
        count_of(&counters->n_results_done, n_done + 2 * SHEF_RING_RESULTS + 1));

    shef_service_stop(service);
    played_expect_accounted(service, 0);
    shef_service_destroy(service);
    atomic_store(&reader.is_ending, true);
    pthread_join(reader.thread, NULL);
    close(reader.fd);
    unlink(path);
}

static void test_stopping_in_the_middle_gives_everything_back(void)
{
    struct shef_config config = played_config();

    config.source.loop = true;
    for (int i = 0; i < 3; i++) {
        struct shef_service *service;

        config.source.pace = i;
        service = played_start(&config);
        usleep(100000);
        shef_service_stop(service);
        played_expect_accounted(service, 0);
        /* Pools assert that nothing is out. */
        shef_service_destroy(service);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stepped_playback_publishes_the_same_bytes_every_time);
    RUN_TEST(test_stepped_disparity_is_what_sheftool_writes);
    RUN_TEST(test_at_the_end_every_frame_is_accounted_for);
    RUN_TEST(test_a_looped_recording_goes_on_without_losing_a_frame);
    RUN_TEST(test_a_slow_chain_sheds_work_and_says_so);
    RUN_TEST(test_after_a_pause_of_the_network_readers_get_new_frames_instead_of_old_ones);
    RUN_TEST(test_stopping_in_the_middle_gives_everything_back);
    return UNITY_END();
}
