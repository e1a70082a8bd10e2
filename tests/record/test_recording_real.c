/* Real sensor streams, recorded and read back. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "codecs/event_reader.h"
#include "core/cpu.h"
#include "core/file.h"
#include "recordings.h"

/* Loads a RAW sample as the stream that its sensor sent. */
static struct sensor_stream load(const char *name)
{
    static struct shef_event events[4096];
    struct shef_event_batch batch = { .events = events, .capacity = 4096 };
    struct sensor_stream stream = { .bytes = NULL };
    struct shef_event_reader *reader;
    struct shef_error err = { .text = "" };
    char path[4200];
    size_t n_bytes;

    snprintf(path, sizeof path, "%s/%s", shef_test_data("events"), name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_reader_open(path, shef_cpu_features(), &reader, &err));
    stream.camera = shef_event_reader_info(reader)->raw;
    while (shef_event_reader_next(reader, &batch, &err) == SHEF_OK)
        seen_add(&stream.seen, &batch);
    shef_event_reader_close(reader);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 28, &stream.bytes, &n_bytes, &err));
    stream.n_bytes = n_bytes - stream.camera.n_bytes;
    memmove(stream.bytes, stream.bytes + stream.camera.n_bytes, stream.n_bytes);
    return stream;
}

static void test_real_streams_come_back_event_by_event(void)
{
    static const char *const names[] = { "evt2_sample.raw", "evt3_sample.raw" };

    SHEF_TEST_NEEDS_DATA("events");

    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 2; i++) {
        struct sensor_stream stream = load(names[i]);
        struct shef_event_recorder_config config = recording_config(&stream);
        struct replayed replayed;

        config.near_us = 0;
        config.segment_bytes = 200000;
        record_stream(shef_test_temp_path(names[i]), &stream, &config, 20000, 0, &random);
        replayed = read_recording(shef_test_temp_path(names[i]));
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
        TEST_ASSERT_TRUE(stream.seen.n > 200000);
        seen_expect_same(&stream.seen, &replayed.seen);
        TEST_ASSERT_EQUAL_STRING("", replayed.notes);
        replayed_free(&replayed);
        sensor_stream_free(&stream);
    }
}

static void test_a_damaged_block_of_a_real_stream_costs_its_events_and_no_others(void)
{
    static const char *const names[] = { "evt2_sample.raw", "evt3_sample.raw" };

    SHEF_TEST_NEEDS_DATA("events");

    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 2; i++) {
        struct sensor_stream stream = load(names[i]);
        struct shef_event_recorder_config config = recording_config(&stream);
        struct replayed replayed;
        char name[64];
        char folder[4200];
        char path[4300];
        uint8_t *bytes;
        size_t n_bytes;

        snprintf(name, sizeof name, "damaged_%s", names[i]);
        snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
        config.near_us = 0;
        record_stream(folder, &stream, &config, 20000, 0, &random);
        snprintf(path, sizeof path, "%s/events/000000.raw", folder);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 28, &bytes, &n_bytes, NULL));
        bytes[n_bytes / 3] ^= 0x10;
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, NULL));
        free(bytes);
        replayed = read_recording(folder);
        TEST_ASSERT_EQUAL_UINT64(1, replayed.damage.n_bad_blocks);
        TEST_ASSERT_TRUE(replayed.seen.n < stream.seen.n);
        TEST_ASSERT_TRUE(replayed.seen.n > stream.seen.n - 20000);
        TEST_ASSERT_TRUE(seen_is_subsequence(&replayed.seen, &stream.seen));
        replayed_free(&replayed);
        sensor_stream_free(&stream);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_real_streams_come_back_event_by_event);
    RUN_TEST(test_a_damaged_block_of_a_real_stream_costs_its_events_and_no_others);
    return UNITY_END();
}
