/* What goes wrong while a recording plays, and what begins and ends at odd moments. */
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/cpu.h"
#include "core/pfm.h"
#include "played.h"
#include "record/recorded_events.h"
#include "service/playback_internal.h"
#include "support/process.h"
#include "support/support.h"

/* A copy of the recording, to be damaged. Valid until the next call. */
static const char *copy_of_recording(const char *name)
{
    static char path[512];
    char command[1200];

    snprintf(path, sizeof path, "%s", shef_test_temp_path(name));
    snprintf(command, sizeof command, "cp -r '%s' '%s'", played_recording(), path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, system(command), command);
    return path;
}

static struct shef_config config_of(const char *recording)
{
    struct shef_config config = played_config();

    snprintf(config.source.recording, sizeof config.source.recording, "%s", recording);
    return config;
}

static void expect_end_in_failure(struct shef_service *service, const char *sentence)
{
    struct pollfd end = { .fd = shef_service_end_fd(service), .events = POLLIN };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_INT_MESSAGE(1, poll(&end, 1, 60000), "it ends");
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_service_outcome(service, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, sentence), err.text);
    played_expect_accounted(service, 0);
    shef_service_stop(service);
    shef_service_destroy(service);
}

static void test_events_that_cannot_be_read_end_a_looped_playback_with_a_sentence(void)
{
    struct shef_config config = config_of(copy_of_recording("lacking"));
    struct shef_error err = { 0 };
    struct shef_service *service;
    char path[600];

    config.source.loop = true;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_create(&config, &service, &err), err.text);
    /* Between opening and reading. */
    snprintf(path, sizeof path, "%s/events/000000.raw", config.source.recording);
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_start(service, &err), err.text);
    expect_end_in_failure(service, "000000.raw");
}

static void test_whichever_source_fails_the_others_end_too(void)
{
    struct shef_config config = played_config();

    config.source.loop = true;
    for (int pace = 0; pace < 3; pace++) {
        struct shef_service *service;
        struct shef_error err = { 0 };

        config.source.pace = pace;
        service = played_start(&config);
        usleep(50000);
        TEST_ASSERT_FALSE(shef_service_has_ended(service));
        (void)shef_fail(&err, SHEF_ERR_IO, "the disk is gone");
        shef_playback_fail(service->playback, &err);
        expect_end_in_failure(service, "the disk is gone");
    }
}

/* Spoils one byte, so that the block that holds it does not match its checksum. */
static void spoil(const char *recording, const char *part, double where)
{
    char path[600];
    FILE *file;
    long at;
    int byte;

    snprintf(path, sizeof path, "%s/%s", recording, part);
    file = fopen(path, "r+b");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_END));
    at = (long)((double)ftell(file) * where);
    TEST_ASSERT_EQUAL_INT(0, fseek(file, at, SEEK_SET));
    byte = fgetc(file);
    TEST_ASSERT_EQUAL_INT(0, fseek(file, at, SEEK_SET));
    TEST_ASSERT_EQUAL_INT(byte ^ 0x55, fputc(byte ^ 0x55, file));
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static uint64_t events_offline(const char *recording)
{
    static struct shef_event memory[16384];
    struct shef_event_batch batch = { .events = memory, .capacity = 16384 };
    struct shef_recorded_events *events;
    struct shef_error err = { 0 };
    uint64_t n;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recorded_events_open(recording, shef_cpu_features(), &events, &err));
    while (shef_recorded_events_next(events, &batch, &err) == SHEF_OK)
        continue;
    TEST_ASSERT_GREATER_THAN_UINT64(0, shef_recorded_events_damage(events).n_bad_blocks);
    n = shef_recorded_events_stats(events).n_events;
    shef_recorded_events_close(events);
    return n;
}

static void test_behind_a_damaged_block_decoding_goes_on_as_offline(void)
{
    struct shef_config config = config_of(copy_of_recording("spoilt"));
    struct shef_service *service;
    uint64_t n_events;
    json_t *status;

    for (int i = 0; i < 20; i++)
        spoil(config.source.recording, "events/000000.raw", 0.3 + 0.03 * i);
    n_events = events_offline(config.source.recording);
    config.source.loop = true;
    service = played_start(&config);
    /* Also in the second pass. */
    for (;;) {
        status = played_ask(service, "status", NULL);
        TEST_ASSERT_EQUAL_INT64(0, played_number(status, "events.n_violations"));
        if (played_number(status, "frames.n_in") > 2 * PLAYED_FRAMES + 2)
            break;
        json_decref(status);
        usleep(2000);
    }
    json_decref(status);
    shef_service_stop(service);
    shef_service_destroy(service);

    config.source.loop = false;
    service = played_start(&config);
    played_wait(service);
    status = played_ask(service, "status", NULL);
    TEST_ASSERT_EQUAL_INT64((int64_t)n_events, played_number(status, "events.n_events"));
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(20, played_number(status, "events.n_missing_buffers"));
    json_decref(status);
    shef_service_stop(service);
    shef_service_destroy(service);
}

static void test_no_frame_waits_for_others_not_even_the_first_ones_of_a_pass(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    int64_t n_in = 0;

    config.source.loop = true;
    service = played_start(&config);
    while (n_in < 3 * PLAYED_FRAMES) {
        json_t *status = played_ask(service, "status", NULL);

        n_in = played_number(status, "frames.n_in");
        /* One that waits for its snapshot, one in hand. */
        TEST_ASSERT_LESS_OR_EQUAL_INT64(2, played_number(status, "frames.n_under_way"));
        TEST_ASSERT_EQUAL_INT64(0, played_number(status, "frames.n_lost"));
        TEST_ASSERT_EQUAL_INT64(0, played_number(status, "frames.n_ambiguous"));
        json_decref(status);
        usleep(500);
    }
    shef_service_stop(service);
    shef_service_destroy(service);
}

/* Plays one pass live, the next one being ten minutes away. Returns how many frames were not
 * paired with a snapshot in time. */
static int64_t unpaired_in_a_lone_pass(const char *recording)
{
    struct shef_config config = config_of(recording);
    struct shef_error err = { 0 };
    struct shef_service *service;
    int64_t n_unpaired = 0;
    int64_t n_done = 0;

    config.source.loop = true;
    config.source.pace = SHEF_PACE_RECORDED;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_create(&config, &service, &err), err.text);
    service->playback->source->pass_ns += 600 * SHEF_NS_PER_S;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_start(service, &err), err.text);
    for (int i = 0; i < 12000 && n_done < PLAYED_FRAMES; i++) {
        json_t *status = played_ask(service, "status", NULL);

        n_done =
            played_number(status, "frames.n_published") + played_number(status, "frames.n_lost");
        n_unpaired = played_number(status, "frames.lost_by.no_pair");
        json_decref(status);
        usleep(5000);
    }
    TEST_ASSERT_EQUAL_INT64(PLAYED_FRAMES, n_done);
    shef_service_stop(service);
    shef_service_destroy(service);
    return n_unpaired;
}

static void test_the_last_frames_of_a_pass_need_not_wait_for_the_next_one(void)
{
    const char *recording = copy_of_recording("early");
    int64_t n_unpaired = 1;

    char path[600];
    struct stat whole;

    /* The events end before the last frame's snapshot is complete. */
    snprintf(path, sizeof path, "%s/events/000000.raw", recording);
    TEST_ASSERT_EQUAL_INT(0, stat(path, &whole));
    TEST_ASSERT_EQUAL_INT(0, truncate(path, whole.st_size * 88 / 100));
    /* A frame waits 100 ms for its snapshot; a computer that is busy elsewhere may need longer. */
    for (int i = 0; i < 10 && n_unpaired > 0; i++)
        n_unpaired = unpaired_in_a_lone_pass(recording);
    TEST_ASSERT_EQUAL_INT64(0, n_unpaired);
}

static void test_the_first_pair_is_found_also_where_the_first_frame_was_lost(void)
{
    struct shef_config config = config_of(copy_of_recording("late"));
    struct shef_source *whole, *damaged;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_source_open(played_recording(), "", &whole, &err));
    TEST_ASSERT_TRUE(whole->first_pair.is_known);
    TEST_ASSERT_FALSE(whole->first_pair.is_ambiguous);
    TEST_ASSERT_EQUAL_INT64(shef_recorded_frames_info(whole->frames, 0)->time.ns,
                            whole->first_pair.pair.camera.ns);

    /* The index's first record: behind its header. */
    spoil(config.source.recording, "frames/000000.idx", 0.19);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_source_open(config.source.recording, "", &damaged, &err), err.text);
    TEST_ASSERT_LESS_THAN_UINT32(whole->n_frames, damaged->n_frames);
    TEST_ASSERT_TRUE(damaged->first_pair.is_known);
    TEST_ASSERT_INT64_WITHIN(
        100000, whole->first_pair.pair.event.ns - whole->first_pair.pair.camera.ns,
        damaged->first_pair.pair.event.ns - damaged->first_pair.pair.camera.ns);
    shef_source_close(damaged);
    shef_source_close(whole);
}

static void test_another_source_has_not_ended_because_the_one_before_had(void)
{
    struct shef_config config = played_config();
    struct shef_service *service = played_start(&config);
    struct pollfd end = { .fd = shef_service_end_fd(service), .events = POLLIN };
    char arguments[700];

    played_wait(service);
    TEST_ASSERT_TRUE(shef_service_has_ended(service));
    snprintf(arguments, sizeof arguments, "{\"recording\": \"%s\", \"loop\": true}",
             played_recording());
    json_decref(played_ask(service, "play", arguments));
    TEST_ASSERT_FALSE(shef_service_has_ended(service));
    TEST_ASSERT_EQUAL_INT(0, poll(&end, 1, 0));
    shef_service_stop(service);
    shef_service_destroy(service);
}

static void test_a_path_without_a_recording_leaves_what_plays_alone(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    const struct shef_playback *playback;

    config.source.loop = true;
    service = played_start(&config);
    playback = service->playback;
    TEST_ASSERT_NOT_NULL(strstr(
        played_refusal(service, "play", "{\"recording\": \"/there/is/none\"}"), "/there/is/none"));
    TEST_ASSERT_EQUAL_PTR(playback, service->playback);
    TEST_ASSERT_TRUE(service->is_running);
    shef_service_stop(service);
    shef_service_destroy(service);
}

/* Nothing has been started: every source seems to hang. */
static void test_sources_that_do_nothing_are_no_progress(void)
{
    static const int paces[] = { SHEF_PACE_RECORDED, SHEF_PACE_STEPPED };
    struct shef_config config = played_config();

    for (int i = 0; i < 2; i++) {
        struct shef_service *service;
        struct shef_error err = { 0 };
        uint64_t n_steps;

        config.source.pace = paces[i];
        TEST_ASSERT_EQUAL(SHEF_OK, shef_service_create(&config, &service, &err));
        n_steps = shef_playback_progress(service->playback);
        TEST_ASSERT_EQUAL_UINT64(n_steps, shef_playback_progress(service->playback));
        /* A step of one of them. With a clock none may hang, without one they take turns. */
        shef_count(&service->playback->counters.n_frames_in, 1);
        TEST_ASSERT_EQUAL_UINT64(n_steps + (paces[i] == SHEF_PACE_STEPPED),
                                 shef_playback_progress(service->playback));
        shef_service_destroy(service);
    }
}

/* With everything shed, a frame says what it lacks of what was asked for. */
static uint32_t bits_of_a_late_frame(struct shef_config *config)
{
    struct shef_service *service;
    uint32_t bits = 0;

    config->source.pace = SHEF_PACE_RECORDED;
    config->source.loop = true;
    config->shed.dense_ms = 0;
    config->shed.cloud_ms = 0;
    config->shed.full_grid_ms = 0;
    config->shed.range_ms = 0;
    config->shed.frame_ms = 1000;
    service = played_start(config);
    while (bits == 0) {
        struct shef_result *result = shef_playback_newest(service->playback);

        if (result) {
            bits = result->shed_bits;
            shef_result_give(result);
        }
        usleep(2000);
    }
    shef_service_stop(service);
    shef_service_destroy(service);
    return bits;
}

static void test_a_frame_says_what_was_left_out_of_what_was_asked_for(void)
{
    struct shef_config config = played_config();

    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_RANGE, bits_of_a_late_frame(&config));
    config.lcm.dense = true;
    config.lcm.cloud = true;
    config.lcm.grid = SHEF_GRID_FULL;
    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE | SHEF_RESULT_SHED_CLOUD |
                                SHEF_RESULT_SHED_FULL_GRID | SHEF_RESULT_SHED_RANGE,
                            bits_of_a_late_frame(&config));
    /* The paper's search knows neither half a range nor a dense image. */
    snprintf(config.depth.mode, sizeof config.depth.mode, "paper-ds");
    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_CLOUD | SHEF_RESULT_SHED_FULL_GRID,
                            bits_of_a_late_frame(&config));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_events_that_cannot_be_read_end_a_looped_playback_with_a_sentence);
    RUN_TEST(test_whichever_source_fails_the_others_end_too);
    RUN_TEST(test_behind_a_damaged_block_decoding_goes_on_as_offline);
    RUN_TEST(test_no_frame_waits_for_others_not_even_the_first_ones_of_a_pass);
    RUN_TEST(test_the_last_frames_of_a_pass_need_not_wait_for_the_next_one);
    RUN_TEST(test_the_first_pair_is_found_also_where_the_first_frame_was_lost);
    RUN_TEST(test_another_source_has_not_ended_because_the_one_before_had);
    RUN_TEST(test_a_path_without_a_recording_leaves_what_plays_alone);
    RUN_TEST(test_sources_that_do_nothing_are_no_progress);
    RUN_TEST(test_a_frame_says_what_was_left_out_of_what_was_asked_for);
    return UNITY_END();
}
