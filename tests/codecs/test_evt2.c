/* EVT2 and EVT2.1: what each word means, and what is counted when it means nothing. */

#include "streams.h"

static struct stream stream;
static struct decoded decoded;

void tearDown(void)
{
    stream_free(&stream);
    decoded_free(&decoded);
}

static void decode(enum shef_evt_format format)
{
    decoded_free(&decoded);
    decoded = decode_all((struct decoding){ .format = format, .width_px = 640, .height_px = 480 },
                         stream.bytes, stream.n_bytes);
}

static uint64_t n_of(enum shef_evt_violation violation)
{
    return decoded.stats.n_violations[violation];
}

static void test_evt2_events_carry_place_polarity_and_time(void)
{
    evt2_high(&stream, 20592);
    evt2_event(&stream, 0, 0, 0, false);
    evt2_event(&stream, 5, 639, 479, true);
    evt2_event(&stream, 63, 17, 300, true);
    evt2_high(&stream, 20593);
    evt2_event(&stream, 0, 1, 2, false);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(4, decoded.n_events);
    expect_event(&decoded, 0, 1317888, 0, 0, false);
    expect_event(&decoded, 1, 1317893, 639, 479, true);
    expect_event(&decoded, 2, 1317951, 17, 300, true);
    expect_event(&decoded, 3, 1317952, 1, 2, false);
    TEST_ASSERT_EQUAL_INT64(1317952, decoded.reached_us);
    expect_no_violations(&decoded.stats);
}

static void test_evt2_triggers_carry_channel_edge_and_place_in_the_stream(void)
{
    evt2_high(&stream, 100);
    evt2_trigger(&stream, 1, 0, true);
    evt2_event(&stream, 2, 3, 4, true);
    evt2_trigger(&stream, 9, 31, false);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(2, decoded.n_triggers);
    TEST_ASSERT_EQUAL_INT64(6401, decoded.triggers[0].t_us);
    TEST_ASSERT_EQUAL_UINT8(0, decoded.triggers[0].channel);
    TEST_ASSERT_TRUE(decoded.triggers[0].rising);
    TEST_ASSERT_EQUAL_UINT32(0, decoded.triggers[0].n_before);
    TEST_ASSERT_EQUAL_INT64(6409, decoded.triggers[1].t_us);
    TEST_ASSERT_EQUAL_UINT8(31, decoded.triggers[1].channel);
    TEST_ASSERT_FALSE(decoded.triggers[1].rising);
    TEST_ASSERT_EQUAL_UINT32(1, decoded.triggers[1].n_before);
}

static void test_more_triggers_than_a_batch_holds_all_come_out(void)
{
    evt2_high(&stream, 100);
    for (uint32_t i = 0; i < 1000; i++)
        evt2_trigger(&stream, i % 64, i % 32, i % 2);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(1000, decoded.n_triggers);
    for (uint32_t i = 0; i < 1000; i++)
        TEST_ASSERT_EQUAL_UINT8(i % 32, decoded.triggers[i].channel);
}

static void test_events_before_the_first_time_are_dropped_and_counted(void)
{
    evt2_event(&stream, 1, 2, 3, true);
    evt2_trigger(&stream, 1, 0, true);
    evt2_high(&stream, 1);
    evt2_event(&stream, 1, 2, 3, true);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_triggers);
    TEST_ASSERT_EQUAL_UINT64(2, n_of(SHEF_EVT_NO_TIME));
}

static void test_events_outside_the_sensor_are_dropped_and_counted(void)
{
    evt2_high(&stream, 1);
    evt2_event(&stream, 0, 640, 0, true);
    evt2_event(&stream, 0, 0, 480, true);
    evt2_event(&stream, 0, 2047, 2047, false);
    evt2_event(&stream, 0, 639, 479, false);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(3, n_of(SHEF_EVT_OUTSIDE));
}

static void test_unknown_words_are_counted_and_skipped(void)
{
    static const uint32_t unknown_types[] = { 0x2, 0x3, 0x7, 0x9, 0xb, 0xc, 0xf };

    evt2_high(&stream, 1);
    for (size_t i = 0; i < 7; i++) {
        evt2_word(&stream, unknown_types[i] << 28 | 0x123);
        for (uint32_t j = 0; j < 20; j++)
            evt2_event(&stream, 1, j, 3, true);
    }
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(140, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(7, n_of(SHEF_EVT_UNKNOWN_WORD));
}

static void test_imu_and_counters_pass_without_complaint(void)
{
    evt2_high(&stream, 1);
    evt2_word(&stream, 0xd0000001);
    for (int i = 0; i < 5; i++)
        evt2_word(&stream, 0xf0001234);
    evt2_word(&stream, 0xe0000014);
    evt2_word(&stream, 0xf0000021);
    evt2_event(&stream, 1, 2, 3, true);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    expect_no_violations(&decoded.stats);
}

static void test_time_that_steps_back_is_counted_and_kept(void)
{
    evt2_high(&stream, 100);
    evt2_event(&stream, 20, 1, 1, true);
    evt2_event(&stream, 19, 2, 1, true);
    evt2_high(&stream, 99);
    evt2_event(&stream, 63, 3, 1, true);
    evt2_high(&stream, 100);
    evt2_event(&stream, 21, 4, 1, true);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(4, decoded.n_events);
    expect_event(&decoded, 1, 6419, 2, 1, true);
    expect_event(&decoded, 2, 6399, 3, 1, true);
    expect_event(&decoded, 3, 6421, 4, 1, true);
    TEST_ASSERT_EQUAL_UINT64(2, n_of(SHEF_EVT_TIME_BACK));
}

static void test_a_damaged_time_word_costs_its_events_and_no_more(void)
{
    for (int i = 0; i < 20; i++)
        evt2_high(&stream, 100);
    evt2_event(&stream, 1, 1, 1, true);
    evt2_high(&stream, 100 | 1 << 20);
    evt2_event(&stream, 2, 2, 1, true);
    evt2_event(&stream, 2, 3, 1, true);
    evt2_high(&stream, 100);
    evt2_event(&stream, 3, 4, 1, true);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(2, decoded.n_events);
    expect_event(&decoded, 0, 6401, 1, 1, true);
    expect_event(&decoded, 1, 6403, 4, 1, true);
    TEST_ASSERT_EQUAL_UINT64(1, n_of(SHEF_EVT_TIME_GAP));
    TEST_ASSERT_EQUAL_UINT64(2, n_of(SHEF_EVT_NO_TIME));
}

static void test_the_wrap_at_2_to_the_34_us_is_counted_on(void)
{
    evt2_high(&stream, 0xfffffff);
    evt2_event(&stream, 63, 1, 1, true);
    evt2_high(&stream, 0);
    evt2_event(&stream, 0, 2, 1, true);
    decode(SHEF_EVT2);
    expect_event(&decoded, 0, ((int64_t)1 << 34) - 1, 1, 1, true);
    expect_event(&decoded, 1, (int64_t)1 << 34, 2, 1, true);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.stats.n_wraps);
    expect_no_violations(&decoded.stats);
}

static void test_a_pause_of_hours_starts_a_new_batch(void)
{
    evt2_high(&stream, 0);
    evt2_event(&stream, 7, 1, 1, true);
    evt2_high(&stream, 100000000);
    evt2_event(&stream, 8, 2, 1, true);
    decode(SHEF_EVT2);
    expect_event(&decoded, 0, 7, 1, 1, true);
    expect_event(&decoded, 1, 6400000008, 2, 1, true);
    expect_no_violations(&decoded.stats);
}

static void test_an_end_in_mid_word_is_counted_and_the_rest_kept(void)
{
    evt2_high(&stream, 1);
    evt2_event(&stream, 1, 2, 3, true);
    stream_put(&stream, "abc", 3);
    decode(SHEF_EVT2);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(1, n_of(SHEF_EVT_CUT_WORD));
}

static void test_evt21_expands_its_valid_bits_from_the_left(void)
{
    evt21_high(&stream, 100);
    evt21_events(&stream, 5, 64, 7, true, 0x80000005);
    evt21_events(&stream, 6, 608, 479, false, 0);
    decode(SHEF_EVT21);
    TEST_ASSERT_EQUAL_UINT64(3, decoded.n_events);
    expect_event(&decoded, 0, 6405, 64, 7, true);
    expect_event(&decoded, 1, 6405, 66, 7, true);
    expect_event(&decoded, 2, 6405, 95, 7, true);
    expect_no_violations(&decoded.stats);
}

static void test_evt21_keeps_the_part_of_a_vector_inside_the_sensor(void)
{
    evt21_high(&stream, 100);
    evt21_events(&stream, 5, 620, 7, true, 0xffffffff);
    evt21_events(&stream, 5, 620, 480, true, 0xff);
    decode(SHEF_EVT21);
    TEST_ASSERT_EQUAL_UINT64(20, decoded.n_events);
    expect_event(&decoded, 19, 6405, 639, 7, true);
    TEST_ASSERT_EQUAL_UINT64(12 + 8, n_of(SHEF_EVT_OUTSIDE));
}

static void test_evt21_triggers_and_wrap(void)
{
    evt21_high(&stream, 0xfffffff);
    evt21_word(&stream, (uint64_t)(0xa0000000u | 3 << 22 | 6 << 8 | 1) << 32);
    evt21_high(&stream, 0);
    evt21_events(&stream, 1, 0, 0, true, 1);
    decode(SHEF_EVT21);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_triggers);
    TEST_ASSERT_EQUAL_INT64(((int64_t)1 << 34) - 61, decoded.triggers[0].t_us);
    TEST_ASSERT_EQUAL_UINT8(6, decoded.triggers[0].channel);
    TEST_ASSERT_TRUE(decoded.triggers[0].rising);
    expect_event(&decoded, 0, ((int64_t)1 << 34) + 1, 0, 0, true);
}

static void test_evt21_word_orders_differ_as_documented(void)
{
    /* The documented example: 0x0102030405060708. */
    static const uint8_t time_high[] = { 0, 0, 0, 0, 0, 0, 0, 0x80 };
    static const uint8_t little[] = { 8, 7, 6, 5, 4, 3, 2, 1 };
    static const uint8_t legacy[] = { 4, 3, 2, 1, 8, 7, 6, 5 };
    struct decoded other;

    stream_put(&stream, time_high, 8);
    stream_put(&stream, little, 8);
    decoded = decode_all((struct decoding){ .format = SHEF_EVT21 }, stream.bytes, stream.n_bytes);
    stream.n_bytes = 0;
    stream_put(&stream, time_high + 4, 4);
    stream_put(&stream, time_high, 4);
    stream_put(&stream, legacy, 8);
    other =
        decode_all((struct decoding){ .format = SHEF_EVT21_LEGACY }, stream.bytes, stream.n_bytes);
    TEST_ASSERT_EQUAL_UINT64(8, decoded.n_events); /* bits of 0x05060708 */
    expect_same(&decoded, &other);
    decoded_free(&other);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_evt2_events_carry_place_polarity_and_time);
    RUN_TEST(test_evt2_triggers_carry_channel_edge_and_place_in_the_stream);
    RUN_TEST(test_more_triggers_than_a_batch_holds_all_come_out);
    RUN_TEST(test_events_before_the_first_time_are_dropped_and_counted);
    RUN_TEST(test_events_outside_the_sensor_are_dropped_and_counted);
    RUN_TEST(test_unknown_words_are_counted_and_skipped);
    RUN_TEST(test_imu_and_counters_pass_without_complaint);
    RUN_TEST(test_time_that_steps_back_is_counted_and_kept);
    RUN_TEST(test_a_damaged_time_word_costs_its_events_and_no_more);
    RUN_TEST(test_the_wrap_at_2_to_the_34_us_is_counted_on);
    RUN_TEST(test_a_pause_of_hours_starts_a_new_batch);
    RUN_TEST(test_an_end_in_mid_word_is_counted_and_the_rest_kept);
    RUN_TEST(test_evt21_expands_its_valid_bits_from_the_left);
    RUN_TEST(test_evt21_keeps_the_part_of_a_vector_inside_the_sensor);
    RUN_TEST(test_evt21_triggers_and_wrap);
    RUN_TEST(test_evt21_word_orders_differ_as_documented);
    return UNITY_END();
}
