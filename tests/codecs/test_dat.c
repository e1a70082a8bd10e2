#include "codecs/dat.h"

#include <string.h>

#include "streams.h"

#define MAX_EVENTS 4096

static struct shef_dat_header header;
static struct shef_error err;
static struct stream stream;
static struct decoded decoded;

void tearDown(void)
{
    stream_free(&stream);
    decoded_free(&decoded);
}

static void put_text(const char *text)
{
    stream_put(&stream, text, strlen(text));
}

static void put_bytes(uint8_t first, uint8_t second)
{
    stream_put(&stream, &first, 1);
    stream_put(&stream, &second, 1);
}

static void put_record(uint32_t t_us, uint32_t x_px, uint32_t y_px, uint32_t polarity)
{
    const uint32_t words[2] = { t_us, x_px | y_px << 14 | polarity << 28 };

    stream_put(&stream, words, sizeof words);
}

static enum shef_err parse(void)
{
    err = (struct shef_error){ 0 };
    return shef_dat_header_parse(stream.bytes, stream.n_bytes, &header, &err);
}

/* Decodes what follows the header, in slices. */
static struct shef_evt_stats decode(size_t slice_bytes, uint32_t batch_events)
{
    struct shef_event events[MAX_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = batch_events };
    struct shef_dat_decoder decoder;
    size_t at;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(), err.text);
    at = header.n_bytes;
    shef_dat_init(&decoder, &header);
    while (at < stream.n_bytes) {
        const size_t n_left = stream.n_bytes - at;
        const size_t n = n_left < slice_bytes ? n_left : slice_bytes;
        const size_t n_taken = shef_dat_decode(&decoder, stream.bytes + at, n, &batch);

        at += n_taken;
        if (n_taken < n) {
            TEST_ASSERT_TRUE(n_taken > 0 || batch.n_events > 0 || batch.n_triggers > 0);
            decoded_add(&decoded, &batch);
            shef_event_batch_clear(&batch);
        }
    }
    decoded_add(&decoded, &batch);
    shef_dat_finish(&decoder);
    return decoder.stats;
}

static void put_old_header(void)
{
    put_text("% Data file containing CD events.\n% Version 2\n% Date 2020-09-14 09:03:25\n"
             "% Height 480\n% Width 640\n");
}

static void test_log_td_files_give_their_events(void)
{
    put_old_header();
    put_bytes(0x00, 8);
    put_record(5, 639, 479, 1);
    put_record(6, 0, 0, 0);
    const struct shef_evt_stats stats = decode(100, MAX_EVENTS);

    TEST_ASSERT_EQUAL(SHEF_DAT_EVENTS, header.content);
    TEST_ASSERT_TRUE(header.has_size);
    TEST_ASSERT_EQUAL_UINT32(640, header.width_px);
    TEST_ASSERT_EQUAL_STRING("2020-09-14 09:03:25", header.date);
    TEST_ASSERT_EQUAL_UINT64(2, decoded.n_events);
    expect_event(&decoded, 0, 5, 639, 479, true);
    expect_event(&decoded, 1, 6, 0, 0, false);
    expect_no_violations(&stats);
}

static void test_version_1_records_have_their_own_layout(void)
{
    const uint32_t words[2] = { 77, 303 | 239 << 9 | 1 << 17 };

    put_text("% Data file containing TD events.\n% Version 1\n");
    put_bytes(0x00, 8);
    stream_put(&stream, words, sizeof words);
    decode(100, MAX_EVENTS);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    expect_event(&decoded, 0, 77, 303, 239, true);
}

static void test_trigger_files_give_channel_and_edge(void)
{
    const uint32_t words[4] = { 1000, 1 | 6 << 26, 2000, 0 };

    put_text("% Data file containing external trigger events.\n% Version 2\n");
    put_bytes(0x0e, 8);
    stream_put(&stream, words, sizeof words);
    decode(3, MAX_EVENTS);
    TEST_ASSERT_EQUAL(SHEF_DAT_TRIGGERS, header.content);
    TEST_ASSERT_EQUAL_UINT64(2, decoded.n_triggers);
    TEST_ASSERT_EQUAL_INT64(1000, decoded.triggers[0].t_us);
    TEST_ASSERT_EQUAL_UINT8(6, decoded.triggers[0].channel);
    TEST_ASSERT_TRUE(decoded.triggers[0].rising);
    TEST_ASSERT_FALSE(decoded.triggers[1].rising);
}

static void test_time_counts_on_over_wraps_and_stragglers(void)
{
    put_old_header();
    put_bytes(0x0c, 8);
    put_record(0xfffffff0, 1, 1, 1);
    put_record(0x00000010, 2, 1, 1);
    put_record(0xfffffff8, 3, 1, 1);
    put_record(0x00000011, 4, 1, 1);
    const struct shef_evt_stats stats = decode(8, MAX_EVENTS);

    expect_event(&decoded, 0, 0xfffffff0, 1, 1, true);
    expect_event(&decoded, 1, 0x100000010, 2, 1, true);
    expect_event(&decoded, 2, 0xfffffff8, 3, 1, true);
    expect_event(&decoded, 3, 0x100000011, 4, 1, true);
    TEST_ASSERT_EQUAL_UINT64(1, stats.n_violations[SHEF_EVT_TIME_BACK]);
}

static void test_slices_and_batches_of_every_size_give_the_same(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct decoded expected;

    put_old_header();
    put_bytes(0x0c, 8);
    for (uint32_t i = 0; i < 1500; i++)
        put_record(i * 3000000, (uint32_t)shef_test_random_range(&random, 0, 639),
                   (uint32_t)shef_test_random_range(&random, 0, 479), i & 1);
    put_text("cut");
    decode(1 << 20, MAX_EVENTS);
    expected = decoded;
    decoded = (struct decoded){ 0 };
    for (size_t slice = 1; slice < 40; slice++) {
        const struct shef_evt_stats stats = decode(slice, (uint32_t)slice);

        expect_same_events(&expected, &decoded);
        TEST_ASSERT_EQUAL_UINT64(1, stats.n_violations[SHEF_EVT_CUT_WORD]);
        decoded_free(&decoded);
    }
    TEST_ASSERT_EQUAL_INT64(1499 * 3000000LL, expected.events[1499].t_us);
    decoded_free(&expected);
}

static void test_events_outside_the_sensor_are_dropped_and_counted(void)
{
    put_old_header();
    put_bytes(0x0c, 8);
    put_record(1, 640, 0, 1);
    put_record(2, 0, 480, 1);
    put_record(3, 639, 479, 1);
    const struct shef_evt_stats stats = decode(100, MAX_EVENTS);

    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(2, stats.n_violations[SHEF_EVT_OUTSIDE]);
}

static void test_a_file_without_header_is_read_if_its_records_make_sense(void)
{
    for (uint32_t i = 0; i < 100; i++)
        put_record(i, i, i, 1);
    decode(100, MAX_EVENTS);
    TEST_ASSERT_EQUAL_UINT64(100, decoded.n_events);
    TEST_ASSERT_FALSE(header.has_size);
}

static void expect_refused(enum shef_err code, const char *sentence)
{
    TEST_ASSERT_EQUAL(code, parse());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, sentence), err.text);
    stream.n_bytes = 0;
}

static void test_what_is_no_dat_file_gets_one_sentence(void)
{
    put_text("\x7f"
             "ELF and so on, surely no events");
    expect_refused(SHEF_ERR_FORMAT, "not a DAT recording");
    put_text("% Version 2\n");
    expect_refused(SHEF_ERR_FORMAT, "ends inside its header");
    put_text("% Version 2\n% Hei");
    expect_refused(SHEF_ERR_FORMAT, "ends inside its header");
    put_text("% Data file contai");
    expect_refused(SHEF_ERR_FORMAT, "ends inside its header");
    put_text("% Version 3\n");
    put_bytes(0x0c, 8);
    expect_refused(SHEF_ERR_UNSUPPORTED, "version 3");
    put_text("% Version 2\n");
    put_bytes(0x28, 8);
    expect_refused(SHEF_ERR_UNSUPPORTED, "type 40");
    put_text("% Version 2\n");
    put_bytes(0x0c, 16);
    expect_refused(SHEF_ERR_FORMAT, "16 bytes");
}

static void test_an_absurd_size_is_known_as_such(void)
{
    put_text("% Version 2\n% Width 99999\n% Height 480\n");
    put_bytes(0x0c, 8);
    TEST_ASSERT_EQUAL(SHEF_OK, parse());
    TEST_ASSERT_FALSE(header.has_size);
    TEST_ASSERT_TRUE(header.absurd_size);
    TEST_ASSERT_EQUAL_UINT32(SHEF_DAT_MAX_SIDE_PX, header.width_px);
}

static void test_records_written_are_read_back(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct decoded scene = scene_make(
        (struct scene){
            .width_px = 640, .height_px = 480, .pause_us = 200000000, .n_bursts = 2000 },
        &random);
    const struct shef_dat_header written = { .width_px = 640, .height_px = 480 };
    uint8_t bytes[SHEF_DAT_HEADER_BYTES];

    stream_put(&stream, bytes, shef_dat_header_write(&written, bytes));
    for (size_t i = 0; i < scene.n_events; i++) {
        const struct timed_event *e = &scene.events[i];
        struct shef_event event = shef_event_make(7, e->x_px, e->y_px, e->on);
        struct shef_event_batch batch = {
            .events = &event, .capacity = 1, .n_events = 1, .base_us = e->t_us - 7
        };

        stream_put(&stream, bytes, shef_dat_encode(SHEF_DAT_EVENTS, &batch, bytes));
    }
    decode(1000, MAX_EVENTS);
    expect_same_events(&scene, &decoded);
    decoded_free(&scene);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_log_td_files_give_their_events);
    RUN_TEST(test_version_1_records_have_their_own_layout);
    RUN_TEST(test_trigger_files_give_channel_and_edge);
    RUN_TEST(test_time_counts_on_over_wraps_and_stragglers);
    RUN_TEST(test_slices_and_batches_of_every_size_give_the_same);
    RUN_TEST(test_events_outside_the_sensor_are_dropped_and_counted);
    RUN_TEST(test_a_file_without_header_is_read_if_its_records_make_sense);
    RUN_TEST(test_what_is_no_dat_file_gets_one_sentence);
    RUN_TEST(test_an_absurd_size_is_known_as_such);
    RUN_TEST(test_records_written_are_read_back);
    return UNITY_END();
}
