/* decode(encode(x)) is x, in every format and way of slicing. */

#include "streams.h"

static struct decoded scene;
static struct decoded decoded;
static struct stream stream;

void tearDown(void)
{
    decoded_free(&scene);
    decoded_free(&decoded);
    stream_free(&stream);
}

static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT21_LEGACY,
                                                SHEF_EVT3 };

static void start(void)
{
    decoded_free(&scene);
    decoded_free(&decoded);
    stream_free(&stream);
}

static void encode(enum shef_evt_format format, enum shef_evt_ticks ticks, uint32_t width_px,
                   uint32_t height_px, uint32_t n_batch)
{
    struct shef_evt_encoder encoder;

    shef_evt_encoder_init(&encoder, format, ticks, width_px, height_px);
    stream = encode_all(&encoder, &scene, n_batch);
}

static void test_random_scenes_come_back_in_every_format(void)
{
    static const char *const isas[] = { NULL, "c" };
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 48; round++) {
        const enum shef_evt_format format = formats[round % 4];
        const enum shef_evt_ticks ticks =
            round / 4 % 2 ? SHEF_EVT_TICKS_SENSOR : SHEF_EVT_TICKS_SPARSE;
        const uint32_t width_px = (uint32_t)shef_test_random_range(&random, 1, 2048);
        const uint32_t height_px = (uint32_t)shef_test_random_range(&random, 1, 2048);
        const int64_t start_us = shef_test_random_range(&random, 0, 8000000);
        const int32_t n_batch = shef_test_random_range(&random, 1, 3000);

        start();
        scene = scene_make((struct scene){ .width_px = width_px,
                                           .height_px = height_px,
                                           .start_us = start_us,
                                           .pause_us = ticks ? 20000 : 40000000,
                                           .n_bursts = 3000,
                                           .n_channels = 16 },
                           &random);
        encode(format, ticks, width_px, height_px, (uint32_t)n_batch);
        decoded = decode_all((struct decoding){ .format = format,
                                                .width_px = width_px,
                                                .height_px = height_px,
                                                .isa = isas[round / 8 % 2],
                                                .slice_bytes = 3000,
                                                .random = &random },
                             stream.bytes, stream.n_bytes);
        expect_same_events(&scene, &decoded);
        expect_no_violations(&decoded.stats);
    }
}

static void test_slices_of_every_size_give_the_same(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < 4; i++) {
        start();
        scene = scene_make((struct scene){ .width_px = 640,
                                           .height_px = 480,
                                           .pause_us = 100000,
                                           .n_bursts = 300,
                                           .n_channels = 8 },
                           &random);
        encode(formats[i], SHEF_EVT_TICKS_SPARSE, 640, 480, 1000);
        /* Some damage too: counts must not depend on slices either. */
        for (int flip = 0; flip < 20; flip++)
            stream.bytes[shef_test_random_range(&random, 0, (int32_t)stream.n_bytes - 1)] ^=
                (uint8_t)(1u << shef_test_random_range(&random, 0, 7));

        struct decoding decoding = { .format = formats[i], .width_px = 640, .height_px = 480 };

        decoded = decode_all(decoding, stream.bytes, stream.n_bytes);
        for (decoding.slice_bytes = 1; decoding.slice_bytes < 70; decoding.slice_bytes++) {
            decoding.batch_events = 64 + (uint32_t)decoding.slice_bytes * 7;
            struct decoded sliced = decode_all(decoding, stream.bytes, stream.n_bytes);

            expect_same(&decoded, &sliced);
            decoded_free(&sliced);
        }
    }
}

static void test_long_pauses_cross_every_wrap(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < 4; i++) {
        const bool is_evt3 = formats[i] == SHEF_EVT3;

        start();
        /* EVT3 wraps after 17 s, the others after 4.8 h: pauses of minutes, and 28 min each. */
        scene = scene_make((struct scene){ .width_px = 640,
                                           .height_px = 480,
                                           .pause_us = is_evt3 ? 300000000 : 1700000000,
                                           .n_bursts = 4000,
                                           .n_channels = 1 },
                           &random);
        encode(formats[i], SHEF_EVT_TICKS_SPARSE, 640, 480, 500);
        decoded =
            decode_all((struct decoding){ .format = formats[i], .width_px = 640, .height_px = 480 },
                       stream.bytes, stream.n_bytes);
        TEST_ASSERT_TRUE(decoded.stats.n_wraps > 0);
        expect_same_events(&scene, &decoded);
    }
}

static void test_ticks_jump_over_a_pause_of_more_than_a_minute(void)
{
    for (size_t i = 0; i < 4; i++) {
        const int64_t pause_us = formats[i] == SHEF_EVT3 ? 100000000 : 1700000000;

        start();
        for (uint32_t n = 0; n < 40; n++) {
            /* Pairs, with enough ticks between them to make it a stream that ticks. */
            struct shef_event event = shef_event_make(n % 2 * 50000, n, 7, true);
            const struct shef_event_batch batch = {
                .events = &event, .capacity = 1, .n_events = 1, .base_us = n / 2 * pause_us
            };

            decoded_add(&scene, &batch);
        }
        encode(formats[i], SHEF_EVT_TICKS_SENSOR, 640, 480, 1);
        TEST_ASSERT_TRUE(stream.n_bytes < 20 * 3200 * 8);
        decoded =
            decode_all((struct decoding){ .format = formats[i], .width_px = 640, .height_px = 480 },
                       stream.bytes, stream.n_bytes);
        TEST_ASSERT_TRUE(decoded.stats.n_wraps > 0);
        expect_same_events(&scene, &decoded);
    }
}

static void test_steps_back_in_time_come_back_too(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < 4; i++)
        for (int ticks = 0; ticks < 2; ticks++) {
            start();
            scene = scene_make((struct scene){ .width_px = 640,
                                               .height_px = 480,
                                               .start_us = 5000000,
                                               .pause_us = 5000,
                                               .n_bursts = 2000 },
                               &random);
            /* Blocks set back by up to a second, and single events by some microseconds. */
            for (size_t j = 0; j < scene.n_events; j++) {
                scene.events[j].t_us -= (int64_t)(j / 1000 % 3) * 450000;
                if (j % 7 == 0)
                    scene.events[j].t_us -= 11;
            }
            encode(formats[i], ticks ? SHEF_EVT_TICKS_SENSOR : SHEF_EVT_TICKS_SPARSE, 640, 480, 64);
            decoded = decode_all(
                (struct decoding){ .format = formats[i], .width_px = 640, .height_px = 480 },
                stream.bytes, stream.n_bytes);
            expect_same_events(&scene, &decoded);
            TEST_ASSERT_TRUE(decoded.stats.n_violations[SHEF_EVT_TIME_BACK] > 0);
        }
}

static void test_events_in_random_order_come_back_too(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < 4; i++) {
        start();
        scene = scene_make((struct scene){ .width_px = 640, .height_px = 480, .n_bursts = 1000 },
                           &random);
        /* EVT3 can go back by a second. */
        for (size_t j = 0; j < scene.n_events; j++)
            scene.events[j].t_us = shef_test_random_range(&random, 0, 1000000);
        encode(formats[i], SHEF_EVT_TICKS_SPARSE, 640, 480, 1000);
        decoded =
            decode_all((struct decoding){ .format = formats[i], .width_px = 640, .height_px = 480 },
                       stream.bytes, stream.n_bytes);
        expect_same_events(&scene, &decoded);
        TEST_ASSERT_EQUAL_UINT64(0, decoded.stats.n_resyncs);
    }
}

static void test_a_sensor_that_sees_nothing_still_ticks(void)
{
    for (size_t i = 0; i < 4; i++) {
        struct shef_event event = shef_event_make(0, 1, 1, true);
        struct shef_event_batch batch = {
            .events = &event, .capacity = 1, .n_events = 1, .base_us = 1000, .reached_us = 11000
        };
        struct shef_evt_encoder encoder;
        uint8_t bytes[16384];
        size_t n_bytes;

        shef_evt_encoder_init(&encoder, formats[i], SHEF_EVT_TICKS_SENSOR, 640, 480);
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_evt_encode(&encoder, &batch, bytes, sizeof bytes, &n_bytes));
        decoded_free(&decoded);
        decoded = decode_all((struct decoding){ .format = formats[i] }, bytes, n_bytes);
        /* One word each 16 us for 10 ms. */
        TEST_ASSERT_TRUE(decoded.stats.n_words > 10000 / 16);
        TEST_ASSERT_INT64_WITHIN(64, 11000, decoded.reached_us);
        TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
        expect_no_violations(&decoded.stats);
    }
}

static void expect_refused(enum shef_evt_format format, const struct shef_event_batch *batch)
{
    struct shef_evt_encoder encoder;
    uint8_t bytes[1024];
    size_t n_bytes = 12345;

    shef_evt_encoder_init(&encoder, format, SHEF_EVT_TICKS_SPARSE, 640, 480);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_evt_encode(&encoder, batch, bytes, sizeof bytes, &n_bytes));
    TEST_ASSERT_TRUE(n_bytes < sizeof bytes);
}

static void test_what_a_format_cannot_say_is_refused(void)
{
    struct shef_event events[2] = { { 0 } };
    struct shef_event_batch batch = { .events = events, .capacity = 2, .n_events = 1 };

    for (size_t i = 0; i < 4; i++) {
        events[0] = shef_event_make(0, 640, 0, true);
        expect_refused(formats[i], &batch);
        events[0] = shef_event_make(0, 0, 480, true);
        expect_refused(formats[i], &batch);
    }
    batch.n_events = 2;
    events[0] = shef_event_make(3000000, 0, 0, true);
    events[1] = shef_event_make(0, 0, 0, true);
    expect_refused(SHEF_EVT3, &batch);

    batch.n_events = 0;
    batch.n_triggers = 1;
    batch.triggers[0] = (struct shef_trigger){ .channel = 16 };
    expect_refused(SHEF_EVT3, &batch);
    batch.triggers[0].channel = 32;
    expect_refused(SHEF_EVT2, &batch);
}

static void test_rows_of_neighbours_become_vectors(void)
{
    struct shef_event events[32];
    struct shef_event_batch batch = { .events = events, .capacity = 32, .n_events = 32 };
    const size_t expected_bytes[] = { 4 + 32 * 4, 8 + 8, 8 + 8, 2 * 7 };

    for (uint32_t i = 0; i < 32; i++)
        events[i] = shef_event_make(0, 320 + i, 100, true);
    for (size_t i = 0; i < 4; i++) {
        struct shef_evt_encoder encoder;
        uint8_t bytes[1024];
        size_t n_bytes;

        shef_evt_encoder_init(&encoder, formats[i], SHEF_EVT_TICKS_SPARSE, 640, 480);
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_evt_encode(&encoder, &batch, bytes, sizeof bytes, &n_bytes));
        TEST_ASSERT_EQUAL_UINT64(expected_bytes[i], n_bytes);
    }
}

/* Other readers keep one x for single events and vectors. */
static void test_a_single_event_between_vectors_makes_the_base_be_said_again(void)
{
    struct shef_event events[9];
    struct shef_event_batch batch = { .events = events, .capacity = 9, .n_events = 9 };
    struct shef_evt_encoder encoder;
    uint8_t bytes[1024];
    size_t n_bytes;

    for (uint32_t i = 0; i < 4; i++) {
        events[i] = shef_event_make(0, 320 + i, 100, true);
        events[5 + i] = shef_event_make(0, 352 + i, 100, true);
    }
    events[4] = shef_event_make(0, 7, 100, false);
    shef_evt_encoder_init(&encoder, SHEF_EVT3, SHEF_EVT_TICKS_SPARSE, 640, 480);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_evt_encode(&encoder, &batch, bytes, sizeof bytes, &n_bytes));
    /* TIME_HIGH, TIME_LOW, row; base and group; event; base and group. */
    TEST_ASSERT_EQUAL_UINT64(2 * (3 + 4 + 1 + 4), n_bytes);
    TEST_ASSERT_EQUAL_HEX8(0x31 | 0x08, bytes[8 * 2 + 1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_scenes_come_back_in_every_format);
    RUN_TEST(test_slices_of_every_size_give_the_same);
    RUN_TEST(test_long_pauses_cross_every_wrap);
    RUN_TEST(test_ticks_jump_over_a_pause_of_more_than_a_minute);
    RUN_TEST(test_steps_back_in_time_come_back_too);
    RUN_TEST(test_events_in_random_order_come_back_too);
    RUN_TEST(test_a_sensor_that_sees_nothing_still_ticks);
    RUN_TEST(test_what_a_format_cannot_say_is_refused);
    RUN_TEST(test_rows_of_neighbours_become_vectors);
    RUN_TEST(test_a_single_event_between_vectors_makes_the_base_be_said_again);
    return UNITY_END();
}
