/* Damaged streams: the decoder finds words again, time stays true, and slices never matter. */
#include <string.h>

#include "codecs/evt_word.h"
#include "streams.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480

static struct decoded scene;
static struct decoded decoded;
static struct stream stream;

static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT21_LEGACY,
                                                SHEF_EVT3 };

void tearDown(void)
{
    decoded_free(&scene);
    decoded_free(&decoded);
    stream_free(&stream);
}

/* A stream as a sensor sends it, and the scene in it. */
static void make_stream(enum shef_evt_format format, struct shef_test_random *random)
{
    struct shef_evt_encoder encoder;

    tearDown();
    scene = scene_make((struct scene){ .width_px = WIDTH_PX,
                                       .height_px = HEIGHT_PX,
                                       .start_us = 1000000,
                                       .pause_us = 1000,
                                       .n_bursts = 6000 },
                       random);
    shef_evt_encoder_init(&encoder, format, SHEF_EVT_TICKS_SENSOR, WIDTH_PX, HEIGHT_PX);
    stream = encode_all(&encoder, &scene, 1000);
}

static void cut(size_t at, size_t n_bytes)
{
    memmove(stream.bytes + at, stream.bytes + at + n_bytes, stream.n_bytes - at - n_bytes);
    stream.n_bytes -= n_bytes;
}

static struct decoding decoding_of(enum shef_evt_format format)
{
    return (struct decoding){ .format = format, .width_px = WIDTH_PX, .height_px = HEIGHT_PX };
}

static bool is_same(struct timed_event a, struct timed_event b)
{
    return a.t_us == b.t_us && a.x_px == b.x_px && a.y_px == b.y_px && a.on == b.on;
}

/* How many events at the end agree with the scene's end, time included; the first n_start of both
 * do not count. */
static size_t n_same_at_end(size_t n_start)
{
    size_t n = 0;

    while (n < decoded.n_events - n_start && n < scene.n_events - n_start &&
           is_same(decoded.events[decoded.n_events - 1 - n], scene.events[scene.n_events - 1 - n]))
        n++;
    return n;
}

static size_t n_same_at_start(void)
{
    size_t n = 0;

    while (n < decoded.n_events && n < scene.n_events &&
           is_same(decoded.events[n], scene.events[n]))
        n++;
    return n;
}

static void test_lost_bytes_cost_little_and_never_the_time_after(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t f = 0; f < 4; f++) {
        const size_t word_bytes = formats[f] == SHEF_EVT2 ? 4 : formats[f] == SHEF_EVT3 ? 2 : 8;

        for (size_t n_cut = 1; n_cut <= 2 * word_bytes; n_cut++) {
            make_stream(formats[f], &random);
            const size_t at =
                (size_t)shef_test_random_range(&random, 2000, (int32_t)stream.n_bytes / 2);

            cut(at, n_cut);
            decoded = decode_all(decoding_of(formats[f]), stream.bytes, stream.n_bytes);

            const size_t n_start = n_same_at_start();
            const size_t n_end = n_same_at_end(n_start);
            const size_t n_wrong = decoded.n_events - n_start - n_end;

            TEST_ASSERT_TRUE(n_start > 0);
            /* At worst time words have to stay away for long, and then to be found. */
            const size_t n_worst = SHEF_EVT_SYNC_MAX_SILENCE_BYTES + 4000;
            const size_t n_max = scene.n_events * n_worst / stream.n_bytes;

            TEST_ASSERT_TRUE(scene.n_events - n_start - n_end < n_max);
            TEST_ASSERT_TRUE(n_wrong < n_max);
            TEST_ASSERT_EQUAL(n_cut % word_bytes != 0, decoded.stats.n_resyncs > 0);
        }
    }
}

static void test_a_stream_that_starts_in_mid_word_is_found_and_timed(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t f = 0; f < 4; f++) {
        make_stream(formats[f], &random);
        cut(0, 1);
        decoded = decode_all(decoding_of(formats[f]), stream.bytes, stream.n_bytes);
        TEST_ASSERT_TRUE(decoded.stats.n_resyncs > 0);
        TEST_ASSERT_TRUE(n_same_at_end(0) > scene.n_events / 2);
    }
}

static void test_inserted_rubbish_is_skipped(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t f = 0; f < 4; f++) {
        make_stream(formats[f], &random);
        uint8_t rubbish[3001];
        struct stream damaged = { 0 };
        const size_t half = stream.n_bytes / 2;

        for (size_t i = 0; i < sizeof rubbish; i++)
            rubbish[i] = (uint8_t)shef_test_random_u64(&random);
        stream_put(&damaged, stream.bytes, half);
        stream_put(&damaged, rubbish, sizeof rubbish);
        stream_put(&damaged, stream.bytes + half, stream.n_bytes - half);
        decoded = decode_all(decoding_of(formats[f]), damaged.bytes, damaged.n_bytes);
        TEST_ASSERT_TRUE(decoded.stats.n_resyncs > 0);
        TEST_ASSERT_TRUE(n_same_at_end(0) > scene.n_events / 3);
        stream_free(&damaged);
    }
}

/* Of EVT2.1 four bytes early or late, a lone last pixel's bits are a TIME_HIGH. */
static void test_lone_pixels_of_evt21_do_not_pass_for_time_words(void)
{
    for (uint32_t n_said = 1; n_said <= 4; n_said += 3) {
        tearDown();
        for (uint32_t i = 0; i < 40000; i++) {
            for (uint32_t said = 0; said < n_said && i % 40 == 0; said++)
                evt21_high(&stream, 5000 + i / 40);
            evt21_events(&stream, i % 40, i / 7 % 20 * 32, i % 480, i & 1, 1u << (i * 7 + 3) % 32);
        }
        scene = decode_all(decoding_of(SHEF_EVT21), stream.bytes, stream.n_bytes);
        TEST_ASSERT_EQUAL_UINT64(40000, scene.n_events);
        cut(stream.n_bytes / 4 / 8 * 8, 4);
        decoded = decode_all(decoding_of(SHEF_EVT21), stream.bytes, stream.n_bytes);
        TEST_ASSERT_EQUAL_UINT64(1, decoded.stats.n_resyncs);
        TEST_ASSERT_TRUE(n_same_at_start() > 9000);
        TEST_ASSERT_TRUE(n_same_at_end(9000) > 28000);
    }
}

static void test_spare_bits_that_change_are_no_sign_of_damage(void)
{
    for (uint32_t i = 0; i < 4000; i++) {
        evt21_word(&stream, (uint64_t)SHEF_EVT2_TIME_HIGH << 60 | (uint64_t)(5000 + i) << 32 | i);
        evt21_events(&stream, 5, 64, 7, true, 1);
    }
    decoded = decode_all(decoding_of(SHEF_EVT21), stream.bytes, stream.n_bytes);
    TEST_ASSERT_EQUAL_UINT64(4000, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(0, decoded.stats.n_violations[SHEF_EVT_UNKNOWN_WORD]);
    TEST_ASSERT_EQUAL_INT64((5000 + 3999) * 64 + 5, decoded.events[3999].t_us);
}

static void test_lost_whole_words_need_no_hunt(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t f = 0; f < 4; f++) {
        make_stream(formats[f], &random);
        cut(stream.n_bytes / 4 / 8 * 8, stream.n_bytes / 4 / 8 * 8);
        decoded = decode_all(decoding_of(formats[f]), stream.bytes, stream.n_bytes);
        TEST_ASSERT_EQUAL_UINT64(0, decoded.stats.n_resyncs);
        /* EVT3 may have lost less than one step of its TIME_HIGH. */
        TEST_ASSERT_TRUE(decoded.stats.n_violations[SHEF_EVT_TIME_GAP] == 1 ||
                         formats[f] == SHEF_EVT3);
        TEST_ASSERT_TRUE(n_same_at_end(0) > scene.n_events / 3);
    }
}

static void test_damage_gives_the_same_for_every_way_of_slicing(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 24; round++) {
        const enum shef_evt_format format = formats[round % 4];
        struct decoding decoding = decoding_of(format);

        make_stream(format, &random);
        if (stream.n_bytes > 60000)
            stream.n_bytes = 60000;
        for (int i = 0; i < 4; i++)
            cut((size_t)shef_test_random_range(&random, 0, (int32_t)stream.n_bytes - 10),
                (size_t)shef_test_random_range(&random, 1, 9));
        for (int i = 0; i < 30; i++)
            stream.bytes[shef_test_random_range(&random, 0, (int32_t)stream.n_bytes - 1)] =
                (uint8_t)shef_test_random_u64(&random);
        decoded = decode_all(decoding, stream.bytes, stream.n_bytes);
        for (int slicing = 0; slicing < 4; slicing++) {
            static const size_t slices[] = { 1, 3, 100, 5000 };

            decoding.slice_bytes = slices[slicing];
            decoding.random = slicing > 1 ? &random : NULL;
            decoding.batch_events = 64u << slicing;
            decoding.isa = slicing % 2 ? "c" : NULL;
            struct decoded sliced = decode_all(decoding, stream.bytes, stream.n_bytes);

            expect_same(&decoded, &sliced);
            decoded_free(&sliced);
        }
    }
}

/* Events of one kind of bytes: every alignment looks plausible, only time words tell. */
static void test_time_words_that_stay_away_start_a_hunt(void)
{
    for (uint32_t i = 0; i < 1000; i++) {
        evt2_high(&stream, 100 + i / 4);
        evt2_event(&stream, 0, 0, 0, false);
    }
    const uint64_t n_events_before = 1000;

    for (uint32_t i = 0; i < 10000; i++)
        evt2_event(&stream, 0, 0, 0, false);
    decoded = decode_all(decoding_of(SHEF_EVT2), stream.bytes, stream.n_bytes);
    TEST_ASSERT_EQUAL_UINT64(n_events_before + SHEF_EVT_SYNC_MAX_SILENCE_BYTES / 4 - 1,
                             decoded.n_events);
    TEST_ASSERT_TRUE(decoded.stats.n_bytes_skipped > 0);
}

static void test_noise_never_stops_the_decoder(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t f = 0; f < 4; f++) {
        tearDown();
        for (int i = 0; i < 100000; i++) {
            const uint64_t any = shef_test_random_u64(&random);

            stream_put(&stream, &any, sizeof any);
        }
        decoded = decode_all(decoding_of(formats[f]), stream.bytes, stream.n_bytes);
        TEST_ASSERT_TRUE(decoded.stats.n_bytes_skipped > stream.n_bytes / 2);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_lost_bytes_cost_little_and_never_the_time_after);
    RUN_TEST(test_a_stream_that_starts_in_mid_word_is_found_and_timed);
    RUN_TEST(test_inserted_rubbish_is_skipped);
    RUN_TEST(test_lone_pixels_of_evt21_do_not_pass_for_time_words);
    RUN_TEST(test_spare_bits_that_change_are_no_sign_of_damage);
    RUN_TEST(test_lost_whole_words_need_no_hunt);
    RUN_TEST(test_damage_gives_the_same_for_every_way_of_slicing);
    RUN_TEST(test_time_words_that_stay_away_start_a_hunt);
    RUN_TEST(test_noise_never_stops_the_decoder);
    return UNITY_END();
}
