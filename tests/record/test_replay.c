#include "record/replay.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/file.h"
#include "core/pool.h"
#include "recordings.h"

static struct shef_test_random random_source;
static struct sensor_stream stream;
static struct shef_manual_clock manual;
static struct shef_replay *replay;
static struct shef_error err;
static char folder[4200];
static struct seen seen;

void tearDown(void)
{
    shef_replay_destroy(replay);
    replay = NULL;
    sensor_stream_free(&stream);
    seen_free(&seen);
}

/* Buffers come one each millisecond, see record_stream(). */
static void make_recording(enum shef_evt_format format)
{
    static int n_made;
    struct shef_event_recorder_config config;
    char name[32];

    random_source = shef_test_random_start();
    snprintf(name, sizeof name, "replayed%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    stream = sensor_stream_make(format, (9 << 24) - 5000, 3000, 10, &random_source);
    config = recording_config(&stream);
    config.segment_bytes = 3000;
    record_stream(folder, &stream, &config, 600, 0, &random_source);
}

static void create(enum shef_replay_pace pace, uint32_t n_buffers)
{
    const struct shef_replay_config config = { pace, &manual.clock, n_buffers };

    shef_manual_clock_init(&manual, (shef_host_time){ 777 });
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_replay_create(folder, &config, &replay, &err),
                              err.text);
}

static void decode(struct shef_evt_decoder *decoder, const struct shef_buffer *buffer)
{
    static struct shef_event events[1000];
    struct shef_event_batch batch = { .events = events, .capacity = 1000 };

    for (size_t at = 0; at < buffer->used_bytes;) {
        shef_event_batch_clear(&batch);
        at += shef_evt_decode(decoder, buffer->data + at, buffer->used_bytes - at, &batch);
        seen_add(&seen, &batch);
    }
}

static struct shef_evt_decoder start_decoder(void)
{
    const struct shef_event_part *part = shef_replay_part(replay);
    struct shef_evt_decoder decoder;

    shef_evt_init(&decoder, part->format, part->width_px, part->height_px, 0, shef_cpu_features());
    TEST_ASSERT_EQUAL(SHEF_OK, shef_evt_restore(&decoder, shef_replay_start_state(replay), &err));
    return decoder;
}

static void test_fast_replay_gives_the_sensors_bytes_and_the_recordings_times(void)
{
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT3 };

    for (int i = 0; i < 2; i++) {
        struct shef_raw_packet packet;
        struct shef_evt_decoder decoder;
        size_t n_bytes = 0;
        uint64_t n_packets = 0;
        enum shef_err code;

        make_recording(formats[i]);
        create(SHEF_REPLAY_FAST, 4);
        decoder = start_decoder();
        while ((code = shef_replay_take(replay, &packet, &err)) == SHEF_OK) {
            TEST_ASSERT_EQUAL_UINT64(n_packets, packet.number);
            TEST_ASSERT_EQUAL_INT64(5000 + (int64_t)n_packets * SHEF_NS_PER_MS, packet.arrived.ns);
            TEST_ASSERT_EQUAL_UINT32(0, packet.n_lost_before);
            TEST_ASSERT_EQUAL_MEMORY(stream.bytes + n_bytes, packet.buffer->data,
                                     packet.buffer->used_bytes);
            decode(&decoder, packet.buffer);
            n_bytes += packet.buffer->used_bytes;
            n_packets++;
            shef_buffer_give(packet.buffer);
        }
        TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, code);
        TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_replay_take(replay, &packet, &err));
        TEST_ASSERT_EQUAL_size_t(stream.n_bytes, n_bytes);
        seen_expect_same(&stream.seen, &seen);
        tearDown();
    }
}

/* The first part of the stream is recorded, then all of it once more as if the source had been
 * played again from its start, an hour later; both from the middle of the source's first run. */
#define SHIFT_US INT64_C(3600000000)

static void record_again(enum shef_evt_format format, size_t from, size_t to)
{
    static struct shef_recording_writer recording;
    static struct shef_event events[1000];
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    struct shef_event_batch batch = { .events = events, .capacity = 1000 };
    struct shef_event_recorder_config config;
    struct shef_event_recorder *recorder;
    struct shef_evt_decoder decoder;
    uint8_t start[SHEF_EVT_STATE_BYTES];
    uint8_t state[SHEF_EVT_STATE_BYTES];

    stream = sensor_stream_make(format, (9 << 24) - 5000, 3000, 10, &random_source);
    config = recording_config(&stream);
    TEST_ASSERT_TRUE(to < stream.n_bytes);
    shef_evt_init(&decoder, format, stream.camera.width_px, stream.camera.height_px, config.near_us,
                  shef_cpu_features());
    shef_evt_save(&decoder, start);
    for (size_t at = 0; at < from;) {
        shef_event_batch_clear(&batch);
        at += shef_evt_decode(&decoder, stream.bytes + at, from - at, &batch);
    }
    shef_evt_save(&decoder, state);
    config.near_us = 0;
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(&recording, folder, &writer_config, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_start(&recording, &config, &recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_restart(recorder, state, 0, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_write(recorder, stream.bytes + from,
                                                         (uint32_t)(to - from),
                                                         (shef_host_time){ 1000 }, 0, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_restart(recorder, start, SHIFT_US, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_event_recorder_write(recorder, stream.bytes, (uint32_t)stream.n_bytes,
                                                (shef_host_time){ 2000 }, 0, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_stop(recorder, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_VERDICT_CLEAN, recording.manifest.verdict,
                              recording.manifest.reason);
    TEST_ASSERT_EQUAL_INT64(stream.seen.items[stream.seen.n - 1].t_us + SHIFT_US,
                            recording.manifest.events.last_us);
    TEST_ASSERT_EQUAL_UINT32(2, recording.manifest.events.n_segments);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
}

static void replay_decoded(void)
{
    struct shef_evt_decoder decoder;
    struct shef_raw_packet packet;
    const uint8_t *state;
    bool follows;

    create(SHEF_REPLAY_FAST, 4);
    decoder = start_decoder();
    while (shef_replay_take(replay, &packet, &err) == SHEF_OK) {
        state = shef_replay_state(replay, &follows);
        if (!follows)
            TEST_ASSERT_EQUAL(SHEF_OK, shef_evt_restore(&decoder, state, &err));
        decode(&decoder, packet.buffer);
        shef_buffer_give(packet.buffer);
    }
}

static void test_a_source_played_again_goes_on_in_time(void)
{
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT3 };

    for (int i = 0; i < 3; i++) {
        struct replayed replayed;
        size_t n_first;

        random_source = shef_test_random_start();
        snprintf(folder, sizeof folder, "%s",
                 shef_test_temp_path((const char *[]){ "again0", "again1", "again2" }[i]));
        record_again(formats[i], 2008, 6400);
        replay_decoded();
        replayed = read_recording(folder);
        TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, replayed.code);
        seen_expect_same(&replayed.seen, &seen);

        TEST_ASSERT_GREATER_THAN_size_t(stream.seen.n + 100, seen.n);
        n_first = seen.n - stream.seen.n;
        for (size_t k = 0; k < stream.seen.n; k++) {
            struct seen_item item = stream.seen.items[k];

            item.t_us += SHIFT_US;
            TEST_ASSERT_TRUE(seen_same(&item, &seen.items[n_first + k]));
        }
        seen.n = n_first;
        TEST_ASSERT_TRUE(seen_is_subsequence(&seen, &stream.seen));
        replayed_free(&replayed);
        tearDown();
    }
}

static void test_recorded_pace_keeps_the_pauses(void)
{
    struct shef_raw_packet packet;

    make_recording(SHEF_EVT2);
    create(SHEF_REPLAY_RECORDED, 4);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &packet, &err));
    shef_buffer_give(packet.buffer);
    for (int i = 1; i < 6; i++) {
        TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
        TEST_ASSERT_EQUAL_INT64(777 + i * SHEF_NS_PER_MS, shef_replay_due(replay).ns);
        shef_manual_clock_advance(&manual, SHEF_NS_PER_MS - 1);
        TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
        shef_manual_clock_advance(&manual, 1);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &packet, &err));
        TEST_ASSERT_EQUAL_UINT64(i, packet.number);
        TEST_ASSERT_EQUAL_INT64(0, shef_replay_late_ns(replay));
        shef_buffer_give(packet.buffer);
    }
}

static void test_a_late_consumer_gets_everything_and_is_told_how_late(void)
{
    struct shef_raw_packet packet;

    make_recording(SHEF_EVT2);
    create(SHEF_REPLAY_RECORDED, 4);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &packet, &err));
    shef_buffer_give(packet.buffer);
    shef_manual_clock_advance(&manual, 4 * SHEF_NS_PER_MS + 300);
    for (int i = 1; i <= 4; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &packet, &err));
        TEST_ASSERT_EQUAL_UINT64(i, packet.number);
        TEST_ASSERT_EQUAL_INT64((4 - i) * SHEF_NS_PER_MS + 300, shef_replay_late_ns(replay));
        shef_buffer_give(packet.buffer);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
}

static void test_stepped_replay_moves_only_when_told_to(void)
{
    struct shef_raw_packet packet;
    uint64_t n_packets = 0;

    make_recording(SHEF_EVT2);
    create(SHEF_REPLAY_STEPPED, 4);
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
    shef_manual_clock_advance(&manual, 100 * SHEF_NS_PER_S);
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
    shef_replay_step(replay, 2);
    shef_replay_step(replay, 1);
    while (shef_replay_take(replay, &packet, &err) == SHEF_OK) {
        n_packets++;
        shef_buffer_give(packet.buffer);
    }
    TEST_ASSERT_EQUAL_UINT64(3, n_packets);
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_replay_take(replay, &packet, &err));
}

static void test_an_empty_pool_delays_and_loses_nothing(void)
{
    struct shef_raw_packet held[2];
    struct shef_raw_packet packet;

    make_recording(SHEF_EVT2);
    create(SHEF_REPLAY_FAST, 2);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &held[0], &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &held[1], &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_replay_take(replay, &packet, &err));
    shef_buffer_share(held[0].buffer);
    shef_buffer_give(held[0].buffer);
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_replay_take(replay, &packet, &err));
    shef_buffer_give(held[0].buffer);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_replay_take(replay, &packet, &err));
    TEST_ASSERT_EQUAL_UINT64(2, packet.number);
    shef_buffer_give(packet.buffer);
    shef_buffer_give(held[1].buffer);
}

static void test_damaged_blocks_count_as_lost_buffers(void)
{
    struct shef_raw_packet packet;
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;
    uint64_t n_lost = 0;

    make_recording(SHEF_EVT2);
    snprintf(path, sizeof path, "%s/events/000001.raw", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, &err));
    bytes[n_bytes / 2] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, &err));
    free(bytes);
    create(SHEF_REPLAY_FAST, 1);
    while (shef_replay_take(replay, &packet, &err) == SHEF_OK) {
        n_lost += packet.n_lost_before;
        shef_buffer_give(packet.buffer);
    }
    TEST_ASSERT_EQUAL_UINT64(1, n_lost);
    TEST_ASSERT_EQUAL_UINT64(1, shef_replay_damage(replay)->n_bad_blocks);
}

static void test_a_recording_without_events_cannot_be_replayed(void)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    const struct shef_replay_config config = { SHEF_REPLAY_FAST, NULL, 2 };
    struct shef_event_recorder_config events;
    struct shef_event_recorder *recorder;

    make_recording(SHEF_EVT2);
    events = recording_config(&stream);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("empty"));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(&recording, folder, &writer_config, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_start(&recording, &events, &recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_stop(recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_replay_create(folder, &config, &replay, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "holds no events"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_fast_replay_gives_the_sensors_bytes_and_the_recordings_times);
    RUN_TEST(test_a_source_played_again_goes_on_in_time);
    RUN_TEST(test_recorded_pace_keeps_the_pauses);
    RUN_TEST(test_a_late_consumer_gets_everything_and_is_told_how_late);
    RUN_TEST(test_stepped_replay_moves_only_when_told_to);
    RUN_TEST(test_an_empty_pool_delays_and_loses_nothing);
    RUN_TEST(test_damaged_blocks_count_as_lost_buffers);
    RUN_TEST(test_a_recording_without_events_cannot_be_replayed);
    return UNITY_END();
}
