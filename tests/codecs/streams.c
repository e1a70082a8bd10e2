#include "streams.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"

static void *grow(void *items, size_t *capacity, size_t n_needed, size_t item_bytes)
{
    if (n_needed <= *capacity)
        return items;
    *capacity = n_needed * 2 + 64;
    items = realloc(items, *capacity * item_bytes);
    TEST_ASSERT_NOT_NULL(items);
    return items;
}

void stream_put(struct stream *stream, const void *bytes, size_t n_bytes)
{
    if (n_bytes == 0)
        return;
    stream->bytes = grow(stream->bytes, &stream->capacity, stream->n_bytes + n_bytes, 1);
    memcpy(stream->bytes + stream->n_bytes, bytes, n_bytes);
    stream->n_bytes += n_bytes;
}

void stream_free(struct stream *stream)
{
    free(stream->bytes);
    *stream = (struct stream){ 0 };
}

void evt2_word(struct stream *stream, uint32_t word)
{
    stream_put(stream, &word, sizeof word);
}

void evt2_high(struct stream *stream, uint32_t value)
{
    evt2_word(stream, 0x80000000u | value);
}

void evt2_event(struct stream *stream, uint32_t low_us, uint32_t x_px, uint32_t y_px, bool on)
{
    evt2_word(stream, (uint32_t)on << 28 | low_us << 22 | x_px << 11 | y_px);
}

void evt2_trigger(struct stream *stream, uint32_t low_us, uint32_t channel, bool rising)
{
    evt2_word(stream, 0xa0000000u | low_us << 22 | channel << 8 | rising);
}

void evt21_word(struct stream *stream, uint64_t word)
{
    stream_put(stream, &word, sizeof word);
}

void evt21_high(struct stream *stream, uint32_t value)
{
    evt21_word(stream, (uint64_t)(0x80000000u | value) << 32);
}

void evt21_events(struct stream *stream, uint32_t low_us, uint32_t x_px, uint32_t y_px, bool on,
                  uint32_t valid)
{
    evt21_word(stream,
               (uint64_t)((uint32_t)on << 28 | low_us << 22 | x_px << 11 | y_px) << 32 | valid);
}

void evt3_word(struct stream *stream, uint32_t type, uint32_t value)
{
    const uint16_t word = (uint16_t)(type << 12 | value);

    stream_put(stream, &word, sizeof word);
}

void decoded_free(struct decoded *decoded)
{
    free(decoded->events);
    free(decoded->triggers);
    *decoded = (struct decoded){ 0 };
}

static void add_event(struct decoded *decoded, struct timed_event event)
{
    decoded->events = grow(decoded->events, &decoded->events_capacity, decoded->n_events + 1,
                           sizeof *decoded->events);
    decoded->events[decoded->n_events++] = event;
}

static void add_trigger(struct decoded *decoded, struct shef_trigger trigger)
{
    decoded->triggers = grow(decoded->triggers, &decoded->triggers_capacity,
                             decoded->n_triggers + 1, sizeof *decoded->triggers);
    decoded->triggers[decoded->n_triggers++] = trigger;
}

void decoded_add(struct decoded *decoded, const struct shef_event_batch *batch)
{
    for (uint32_t i = 0; i < batch->n_triggers; i++) {
        struct shef_trigger trigger = batch->triggers[i];

        TEST_ASSERT_TRUE(trigger.n_before <= batch->n_events);
        trigger.n_before += (uint32_t)decoded->n_events;
        add_trigger(decoded, trigger);
    }
    for (uint32_t i = 0; i < batch->n_events; i++)
        add_event(decoded,
                  (struct timed_event){ shef_event_batch_time_us(batch, i), batch->events[i].x_px,
                                        shef_event_y_px(batch->events[i]),
                                        shef_event_is_on(batch->events[i]) });
}

struct decoded decode_all(struct decoding decoding, const uint8_t *bytes, size_t n_bytes)
{
    const uint32_t capacity = decoding.batch_events ? decoding.batch_events : 4096;
    const uint32_t features =
        decoding.isa ? shef_cpu_features_of(decoding.isa) : shef_cpu_features();
    struct shef_event_batch batch = { .events = calloc(capacity, sizeof *batch.events),
                                      .capacity = capacity };
    struct decoded decoded = { 0 };
    struct shef_evt_decoder decoder;
    size_t at = 0;

    TEST_ASSERT_NOT_NULL(batch.events);
    shef_evt_init(&decoder, decoding.format, decoding.width_px ? decoding.width_px : 2048,
                  decoding.height_px ? decoding.height_px : 2048, decoding.near_us, features);
    while (at < n_bytes) {
        size_t n_slice = decoding.slice_bytes ? decoding.slice_bytes : n_bytes;

        if (decoding.random)
            n_slice = (size_t)shef_test_random_range(decoding.random, 1, (int32_t)n_slice);
        if (n_slice > n_bytes - at)
            n_slice = n_bytes - at;
        /* A copy of its own, so that a sanitizer sees reads beyond the slice. */
        uint8_t *const slice = malloc(n_slice);
        size_t n_taken = 0;

        TEST_ASSERT_NOT_NULL(slice);
        memcpy(slice, bytes + at, n_slice);
        while (n_taken < n_slice) {
            const size_t n = shef_evt_decode(&decoder, slice + n_taken, n_slice - n_taken, &batch);

            n_taken += n;
            if (n_taken < n_slice) {
                TEST_ASSERT_TRUE_MESSAGE(n > 0 || batch.n_events > 0 || batch.n_triggers > 0,
                                         "the decoder neither takes nor gives");
                decoded_add(&decoded, &batch);
                shef_event_batch_clear(&batch);
            }
        }
        free(slice);
        at += n_slice;
    }
    decoded_add(&decoded, &batch);
    shef_evt_finish(&decoder);
    decoded.reached_us = shef_evt_reached_us(&decoder);
    decoded.stats = decoder.stats;
    free(batch.events);
    TEST_ASSERT_EQUAL_UINT64(decoded.n_events, decoded.stats.n_events);
    TEST_ASSERT_EQUAL_UINT64(decoded.n_triggers, decoded.stats.n_triggers);
    TEST_ASSERT_EQUAL_UINT64(n_bytes, decoded.stats.n_bytes);
    return decoded;
}

void expect_event(const struct decoded *decoded, size_t i, int64_t t_us, uint32_t x_px,
                  uint32_t y_px, bool on)
{
    char place[64];

    snprintf(place, sizeof place, "event %zu", i);
    TEST_ASSERT_TRUE_MESSAGE(i < decoded->n_events, place);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(t_us, decoded->events[i].t_us, place);
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(x_px, decoded->events[i].x_px, place);
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(y_px, decoded->events[i].y_px, place);
    TEST_ASSERT_EQUAL_MESSAGE(on, decoded->events[i].on, place);
}

void expect_same_events(const struct decoded *expected, const struct decoded *actual)
{
    TEST_ASSERT_EQUAL_UINT64(expected->n_events, actual->n_events);
    for (size_t i = 0; i < expected->n_events; i++) {
        const struct timed_event *event = &expected->events[i];

        expect_event(actual, i, event->t_us, event->x_px, event->y_px, event->on);
    }
    TEST_ASSERT_EQUAL_UINT64(expected->n_triggers, actual->n_triggers);
    for (size_t i = 0; i < expected->n_triggers; i++) {
        TEST_ASSERT_EQUAL_INT64(expected->triggers[i].t_us, actual->triggers[i].t_us);
        TEST_ASSERT_EQUAL_UINT32(expected->triggers[i].n_before, actual->triggers[i].n_before);
        TEST_ASSERT_EQUAL_UINT8(expected->triggers[i].channel, actual->triggers[i].channel);
        TEST_ASSERT_EQUAL(expected->triggers[i].rising, actual->triggers[i].rising);
    }
}

void expect_same(const struct decoded *expected, const struct decoded *actual)
{
    expect_same_events(expected, actual);
    TEST_ASSERT_EQUAL_INT64(expected->reached_us, actual->reached_us);
    TEST_ASSERT_EQUAL_UINT64(expected->stats.n_words, actual->stats.n_words);
    TEST_ASSERT_EQUAL_UINT64(expected->stats.n_resyncs, actual->stats.n_resyncs);
    TEST_ASSERT_EQUAL_UINT64(expected->stats.n_bytes_skipped, actual->stats.n_bytes_skipped);
    TEST_ASSERT_EQUAL_UINT64(expected->stats.n_wraps, actual->stats.n_wraps);
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(expected->stats.n_violations[i],
                                         actual->stats.n_violations[i],
                                         shef_evt_violation_name((enum shef_evt_violation)i));
}

void expect_no_violations(const struct shef_evt_stats *stats)
{
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, stats->n_violations[i],
                                         shef_evt_violation_name((enum shef_evt_violation)i));
    TEST_ASSERT_EQUAL_UINT64(0, stats->n_resyncs);
    TEST_ASSERT_EQUAL_UINT64(0, stats->n_bytes_skipped);
}

struct decoded scene_make(struct scene scene, struct shef_test_random *random)
{
    struct decoded made = { 0 };
    int64_t t_us = scene.start_us;

    for (int32_t burst = 0; burst < scene.n_bursts; burst++) {
        const uint16_t y_px =
            (uint16_t)shef_test_random_range(random, 0, (int32_t)scene.height_px - 1);
        const bool on = shef_test_random_u64(random) >> 63;
        uint32_t x_px = (uint32_t)shef_test_random_range(random, 0, (int32_t)scene.width_px - 1);
        const int32_t n_burst = shef_test_random_range(random, 1, 20);
        const int32_t gap_px = shef_test_random_range(random, 1, 8);

        /* Every now and then a burst of neighbours, which encoders write as vectors. */
        for (int32_t i = 0; i < n_burst && x_px < scene.width_px; i++) {
            add_event(&made, (struct timed_event){ t_us, (uint16_t)x_px, y_px, on });
            x_px += (uint32_t)shef_test_random_range(random, 1, gap_px);
        }
        if (scene.n_channels > 0 && shef_test_random_range(random, 0, 9) == 0)
            add_trigger(&made, (struct shef_trigger){
                                   .t_us = t_us,
                                   .n_before = (uint32_t)made.n_events,
                                   .channel = (uint8_t)shef_test_random_range(
                                       random, 0, (int32_t)scene.n_channels - 1),
                                   .rising = shef_test_random_u64(random) >> 63,
                               });
        if (shef_test_random_range(random, 0, 99) == 0)
            t_us += shef_test_random_range(random, 0, scene.pause_us);
        else
            t_us += shef_test_random_range(random, 0, 6);
    }
    made.reached_us = t_us;
    return made;
}

struct stream encode_all(struct shef_evt_encoder *encoder, const struct decoded *source,
                         uint32_t n_batch)
{
    struct stream stream = { 0 };
    struct shef_event_batch batch = { .events = calloc(n_batch, sizeof *batch.events),
                                      .capacity = n_batch };
    size_t at_event = 0;
    size_t at_trigger = 0;

    TEST_ASSERT_NOT_NULL(batch.events);
    while (at_event < source->n_events || at_trigger < source->n_triggers) {
        uint8_t bytes[SHEF_EVT_ENCODE_MIN_ROOM * 3];
        size_t n_bytes;
        enum shef_err code;

        shef_event_batch_clear(&batch);
        batch.base_us = at_event < source->n_events ? source->events[at_event].t_us : 0;
        batch.reached_us = source->reached_us;
        for (;;) {
            if (at_trigger < source->n_triggers &&
                source->triggers[at_trigger].n_before <= at_event) {
                if (batch.n_triggers == SHEF_BATCH_TRIGGERS)
                    break;
                batch.triggers[batch.n_triggers] = source->triggers[at_trigger++];
                batch.triggers[batch.n_triggers++].n_before = batch.n_events;
                continue;
            }
            if (at_event == source->n_events || batch.n_events == n_batch)
                break;
            const struct timed_event *event = &source->events[at_event];
            const int64_t t_us = event->t_us - batch.base_us;

            if (t_us < 0 || t_us > UINT32_MAX)
                break;
            batch.events[batch.n_events++] =
                shef_event_make((uint32_t)t_us, event->x_px, event->y_px, event->on);
            batch.reached_us = event->t_us;
            at_event++;
        }
        do {
            code = shef_evt_encode(encoder, &batch, bytes, sizeof bytes, &n_bytes);
            stream_put(&stream, bytes, n_bytes);
        } while (code == SHEF_ERR_FULL);
        TEST_ASSERT_EQUAL(SHEF_OK, code);
    }
    free(batch.events);
    return stream;
}
