/* A decoder's state as bytes: a recording's segments join wherever they were cut. */
#include <string.h>

#include "core/cpu.h"
#include "streams.h"

static struct decoded scene;
static struct decoded expected;
static struct stream stream;

static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT21_LEGACY,
                                                SHEF_EVT3 };

void tearDown(void)
{
    decoded_free(&scene);
    decoded_free(&expected);
    stream_free(&stream);
}

static void make_stream(enum shef_evt_format format)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_evt_encoder encoder;

    tearDown();
    scene = scene_make((struct scene){ .width_px = 640,
                                       .height_px = 480,
                                       .start_us = 7000000,
                                       .pause_us = 6000000,
                                       .n_bursts = 2000,
                                       .n_channels = 4 },
                       &random);
    shef_evt_encoder_init(&encoder, format, SHEF_EVT_TICKS_SPARSE, 640, 480);
    stream = encode_all(&encoder, &scene, 500);
}

static void init(struct shef_evt_decoder *decoder, enum shef_evt_format format)
{
    shef_evt_init(decoder, format, 640, 480, 0, shef_cpu_features());
}

/* Decodes bytes at..end, appending to out. */
static void decode_part(struct shef_evt_decoder *decoder, size_t at, size_t end,
                        struct decoded *out)
{
    struct shef_event events[1000];
    struct shef_event_batch batch = { .events = events, .capacity = 1000 };

    while (at < end) {
        at += shef_evt_decode(decoder, stream.bytes + at, end - at, &batch);
        decoded_add(out, &batch);
        shef_event_batch_clear(&batch);
    }
}

static void test_a_decoder_goes_on_from_a_saved_state(void)
{
    for (size_t f = 0; f < 4; f++) {
        make_stream(formats[f]);
        for (size_t cut = 0; cut < stream.n_bytes; cut += 1 + cut / 30) {
            struct shef_evt_decoder first;
            struct shef_evt_decoder second;
            struct shef_error err = { 0 };
            uint8_t state[SHEF_EVT_STATE_BYTES];
            struct decoded joined = { 0 };

            init(&first, formats[f]);
            decode_part(&first, 0, cut, &joined);
            shef_evt_save(&first, state);
            init(&second, formats[f]);
            TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_evt_restore(&second, state, &err), err.text);
            decode_part(&second, cut, stream.n_bytes, &joined);
            expect_same_events(&scene, &joined);
            expect_no_violations(&second.stats);
            decoded_free(&joined);
        }
    }
}

static void test_a_state_of_another_stream_is_refused_and_changes_nothing(void)
{
    struct shef_evt_decoder evt3;
    struct shef_evt_decoder evt2;
    struct shef_evt_decoder before;
    struct shef_error err = { 0 };
    uint8_t state[SHEF_EVT_STATE_BYTES];

    init(&evt3, SHEF_EVT3);
    init(&evt2, SHEF_EVT2);
    shef_evt_save(&evt3, state);
    before = evt2;
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_evt_restore(&evt2, state, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "EVT2 stream of 640 x 480"));
    TEST_ASSERT_EQUAL_MEMORY(&before, &evt2, sizeof evt2);
}

static void test_damaged_states_are_refused_or_harmless(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_evt_decoder decoder;
    uint8_t state[SHEF_EVT_STATE_BYTES];
    int n_refused = 0;

    make_stream(SHEF_EVT3);
    for (int round = 0; round < 2000; round++) {
        struct decoded out = { 0 };

        init(&decoder, SHEF_EVT3);
        decode_part(&decoder, 0, 2000, &out);
        shef_evt_save(&decoder, state);
        state[shef_test_random_range(&random, 0, SHEF_EVT_STATE_BYTES - 1)] =
            (uint8_t)shef_test_random_u64(&random);
        if (shef_evt_restore(&decoder, state, NULL) == SHEF_OK)
            decode_part(&decoder, 2000, 4000, &out);
        else
            n_refused++;
        decoded_free(&out);
    }
    TEST_ASSERT_TRUE(n_refused > 100);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_decoder_goes_on_from_a_saved_state);
    RUN_TEST(test_a_state_of_another_stream_is_refused_and_changes_nothing);
    RUN_TEST(test_damaged_states_are_refused_or_harmless);
    return UNITY_END();
}
