#include "recordings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "codecs/evt_encode.h"
#include "core/cpu.h"

#define WIDTH_PX  64
#define HEIGHT_PX 48

static void add_item(struct seen *seen, struct seen_item item)
{
    if (seen->n == seen->capacity) {
        seen->capacity = seen->capacity ? 2 * seen->capacity : 1024;
        seen->items = reallocarray(seen->items, seen->capacity, sizeof *seen->items);
        TEST_ASSERT_NOT_NULL(seen->items);
    }
    seen->items[seen->n++] = item;
}

void seen_add(struct seen *seen, const struct shef_event_batch *batch)
{
    uint32_t k = 0;

    for (uint32_t i = 0; i <= batch->n_events; i++) {
        for (; k < batch->n_triggers && batch->triggers[k].n_before == i; k++)
            add_item(seen, (struct seen_item){ batch->triggers[k].t_us, batch->triggers[k].channel,
                                               UINT16_MAX, batch->triggers[k].rising });
        if (i < batch->n_events)
            add_item(seen,
                     (struct seen_item){ shef_event_batch_time_us(batch, i), batch->events[i].x_px,
                                         shef_event_y_px(batch->events[i]),
                                         shef_event_is_on(batch->events[i]) });
    }
    TEST_ASSERT_EQUAL_UINT32(batch->n_triggers, k);
}

void seen_free(struct seen *seen)
{
    free(seen->items);
    *seen = (struct seen){ 0 };
}

bool seen_same(const struct seen_item *a, const struct seen_item *b)
{
    return a->t_us == b->t_us && a->x_px == b->x_px && a->y_px == b->y_px && a->on == b->on;
}

size_t seen_common_prefix(const struct seen *a, const struct seen *b)
{
    size_t n = 0;

    while (n < a->n && n < b->n && seen_same(&a->items[n], &b->items[n]))
        n++;
    return n;
}

void seen_expect_same(const struct seen *expected, const struct seen *actual)
{
    const size_t n = seen_common_prefix(expected, actual);

    if (n < expected->n && n < actual->n) {
        char text[160];

        snprintf(text, sizeof text, "item %zu is (%lld us, %u, %u), expected (%lld us, %u, %u)", n,
                 (long long)actual->items[n].t_us, actual->items[n].x_px, actual->items[n].y_px,
                 (long long)expected->items[n].t_us, expected->items[n].x_px,
                 expected->items[n].y_px);
        TEST_FAIL_MESSAGE(text);
    }
    TEST_ASSERT_EQUAL_size_t(expected->n, actual->n);
}

bool seen_is_subsequence(const struct seen *part, const struct seen *whole)
{
    size_t k = 0;

    for (size_t i = 0; i < part->n; i++, k++) {
        while (k < whole->n && !seen_same(&part->items[i], &whole->items[k]))
            k++;
        if (k == whole->n)
            return false;
    }
    return true;
}

/* Encodes a batch at the stream's end. */
static void encode(struct sensor_stream *stream, struct shef_evt_encoder *encoder,
                   const struct shef_event_batch *batch)
{
    enum shef_err code;

    do {
        uint8_t room[4096];
        size_t n_bytes;

        code = shef_evt_encode(encoder, batch, room, sizeof room, &n_bytes);
        TEST_ASSERT_TRUE(code == SHEF_OK || code == SHEF_ERR_FULL);
        stream->bytes = realloc(stream->bytes, stream->n_bytes + n_bytes + 1);
        TEST_ASSERT_NOT_NULL(stream->bytes);
        memcpy(stream->bytes + stream->n_bytes, room, n_bytes);
        stream->n_bytes += n_bytes;
    } while (code == SHEF_ERR_FULL);
}

struct sensor_stream sensor_stream_make(enum shef_evt_format format, int64_t start_us,
                                        int32_t n_events, int32_t mean_gap_us,
                                        struct shef_test_random *random)
{
    struct sensor_stream stream = {
        .camera = { .format = format,
                    .size = SHEF_RAW_SIZE_GIVEN,
                    .width_px = WIDTH_PX,
                    .height_px = HEIGHT_PX,
                    .system_id = 28,
                    .serial = "00001234" },
    };
    struct shef_event events[64];
    struct shef_event_batch batch = { .events = events, .capacity = 64 };
    struct shef_evt_encoder encoder;
    int64_t t_us = start_us;

    shef_evt_encoder_init(&encoder, format, SHEF_EVT_TICKS_SENSOR, WIDTH_PX, HEIGHT_PX);
    while (n_events > 0) {
        shef_event_batch_clear(&batch);
        batch.base_us = t_us;
        for (int32_t i = 0; i < 50 && n_events > 0; i++, n_events--) {
            t_us += shef_test_random_range(random, 0, 2 * mean_gap_us);
            if (shef_test_random_range(random, 0, 99) == 0)
                batch.triggers[batch.n_triggers++] = (struct shef_trigger){
                    .t_us = t_us, .n_before = batch.n_events, .rising = i % 2 == 0
                };
            else
                batch.events[batch.n_events++] = shef_event_make(
                    (uint32_t)(t_us - batch.base_us),
                    (uint32_t)shef_test_random_range(random, 0, WIDTH_PX - 1),
                    (uint32_t)shef_test_random_range(random, 0, HEIGHT_PX - 1), i % 3 == 0);
        }
        batch.reached_us = t_us;
        encode(&stream, &encoder, &batch);
        seen_add(&stream.seen, &batch);
    }
    return stream;
}

void sensor_stream_free(struct sensor_stream *stream)
{
    free(stream->bytes);
    seen_free(&stream->seen);
    *stream = (struct sensor_stream){ .bytes = NULL };
}

struct shef_event_recorder_config recording_config(const struct sensor_stream *stream)
{
    struct shef_event_recorder_config config = shef_event_recorder_default_config(&stream->camera);

    config.near_us = stream->seen.n > 0 ? stream->seen.items[0].t_us : 0;
    config.sync_ns = 0;
    return config;
}

void record_stream(const char *folder, const struct sensor_stream *stream,
                   const struct shef_event_recorder_config *config, uint32_t max_buffer_bytes,
                   uint32_t n_stop, struct shef_test_random *random)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config recording_writer_config = { .software = "test" };
    struct shef_event_recorder *recorder;
    struct shef_error err;
    shef_host_time now = { 5000 };
    uint32_t n_buffers = 0;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recording_writer_create(&recording, folder, &recording_writer_config, &err),
        err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_recorder_start(&recording, config, &recorder, &err), err.text);
    for (size_t at = 0; at < stream->n_bytes && (n_stop == 0 || n_buffers < n_stop); n_buffers++) {
        const size_t n_left = stream->n_bytes - at;
        size_t n = (size_t)shef_test_random_range(random, 1, (int32_t)max_buffer_bytes);

        n = n < n_left ? n : n_left;
        TEST_ASSERT_EQUAL_MESSAGE(
            SHEF_OK,
            shef_event_recorder_write(recorder, stream->bytes + at, (uint32_t)n, now, 0, &err),
            err.text);
        now = shef_host_time_add(now, SHEF_NS_PER_MS);
        at += n;
    }
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_recorder_stop(recorder, &err), err.text);
    if (n_stop > 0)
        shef_manifest_free(&recording.manifest);
    else
        TEST_ASSERT_EQUAL_MESSAGE(
            SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err), err.text);
}

struct replayed read_recording(const char *folder)
{
    static struct shef_event events[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = 200 };
    struct replayed replayed = { .code = SHEF_OK };
    struct shef_recorded_events *reader;
    struct shef_error err = { 0 };

    replayed.code = shef_recorded_events_open(folder, shef_cpu_features(), &reader, &err);
    if (replayed.code == SHEF_OK) {
        while ((replayed.code = shef_recorded_events_next(reader, &batch, &err)) == SHEF_OK)
            seen_add(&replayed.seen, &batch);
        replayed.stats = shef_recorded_events_stats(reader);
        replayed.damage = shef_recorded_events_damage(reader);
        for (int i = 0; shef_recorded_events_note(reader, i); i++) {
            strcat(replayed.notes, shef_recorded_events_note(reader, i));
            strcat(replayed.notes, "\n");
        }
        shef_recorded_events_close(reader);
    }
    snprintf(replayed.error, sizeof replayed.error, "%s", err.text);
    return replayed;
}

void replayed_free(struct replayed *replayed)
{
    seen_free(&replayed->seen);
}
