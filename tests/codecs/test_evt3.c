/* EVT3: what each word means, and what is counted when it means nothing. */
#include "streams.h"

enum {
    ROW = 0,
    FOREIGN_ROW = 1,
    EVENT = 2,
    BASE = 3,
    VECTOR_12 = 4,
    VECTOR_8 = 5,
    TIME_LOW = 6,
    CONTINUED_4 = 7,
    TIME_HIGH = 8,
    TRIGGER = 10,
    OTHER = 14,
    CONTINUED_12 = 15,
    ON = 0x800,
};

static struct stream stream;
static struct decoded decoded;

void setUp(void)
{
    evt3_word(&stream, TIME_HIGH, 2861);
    evt3_word(&stream, TIME_LOW, 11);
}

void tearDown(void)
{
    stream_free(&stream);
    decoded_free(&decoded);
}

static void put(uint32_t type, uint32_t value)
{
    evt3_word(&stream, type, value);
}

static void decode(void)
{
    decoded_free(&decoded);
    decoded =
        decode_all((struct decoding){ .format = SHEF_EVT3, .width_px = 1280, .height_px = 720 },
                   stream.bytes, stream.n_bytes);
}

static uint64_t n_of(enum shef_evt_violation violation)
{
    return decoded.stats.n_violations[violation];
}

#define T0_US (2861 * 4096LL)

static void test_events_take_row_and_time_from_the_words_before(void)
{
    put(ROW, 200);
    put(EVENT, 874);
    put(EVENT, 806 | ON);
    put(TIME_LOW, 12);
    put(EVENT, 0);
    put(ROW, 719);
    put(EVENT, 1279 | ON);
    decode();
    TEST_ASSERT_EQUAL_UINT64(4, decoded.n_events);
    expect_event(&decoded, 0, T0_US + 11, 874, 200, false);
    expect_event(&decoded, 1, T0_US + 11, 806, 200, true);
    expect_event(&decoded, 2, T0_US + 12, 0, 200, false);
    expect_event(&decoded, 3, T0_US + 12, 1279, 719, true);
    expect_no_violations(&decoded.stats);
}

static void test_vectors_go_on_from_their_base(void)
{
    put(ROW, 5);
    put(BASE, 64 | ON);
    for (int group = 0; group < 2; group++) {
        put(VECTOR_12, 0x801);
        put(VECTOR_12, 0x002);
        put(VECTOR_8, 0x80);
    }
    decode();
    TEST_ASSERT_EQUAL_UINT64(8, decoded.n_events);
    expect_event(&decoded, 0, T0_US + 11, 64, 5, true);
    expect_event(&decoded, 1, T0_US + 11, 75, 5, true);
    expect_event(&decoded, 2, T0_US + 11, 77, 5, true);
    expect_event(&decoded, 3, T0_US + 11, 95, 5, true);
    expect_event(&decoded, 4, T0_US + 11, 96, 5, true);
    expect_event(&decoded, 7, T0_US + 11, 127, 5, true);
    expect_no_violations(&decoded.stats);
}

static void test_a_group_may_be_cut_anywhere_by_slices(void)
{
    put(ROW, 5);
    put(BASE, 64);
    put(VECTOR_12, 0xfff);
    put(VECTOR_12, 0xfff);
    put(VECTOR_8, 0xff);
    put(EVENT, 3);
    decode();
    TEST_ASSERT_EQUAL_UINT64(33, decoded.n_events);
    for (size_t n = 1; n < stream.n_bytes; n++) {
        struct decoded sliced = decode_all(
            (struct decoding){
                .format = SHEF_EVT3, .width_px = 1280, .height_px = 720, .slice_bytes = n },
            stream.bytes, stream.n_bytes);

        expect_same(&decoded, &sliced);
        decoded_free(&sliced);
    }
}

static void test_incomplete_groups_are_counted_and_their_events_kept(void)
{
    put(ROW, 5);
    put(BASE, 0);
    put(VECTOR_12, 1);
    put(VECTOR_12, 1);
    put(EVENT, 100); /* the VECT_8 is missing */
    put(BASE, 320);
    put(VECTOR_12, 1);
    put(VECTOR_8, 1); /* a VECT_12 is missing */
    put(BASE, 640);
    put(VECTOR_8, 1); /* both are missing */
    decode();
    TEST_ASSERT_EQUAL_UINT64(6, decoded.n_events);
    expect_event(&decoded, 1, T0_US + 11, 12, 5, false);
    expect_event(&decoded, 2, T0_US + 11, 100, 5, false);
    expect_event(&decoded, 4, T0_US + 11, 332, 5, false);
    expect_event(&decoded, 5, T0_US + 11, 640, 5, false);
    TEST_ASSERT_EQUAL_UINT64(3, n_of(SHEF_EVT_BAD_VECTOR));
}

static void test_vectors_without_a_base_are_dropped_and_counted(void)
{
    put(ROW, 5);
    put(VECTOR_12, 0xfff);
    put(VECTOR_12, 0xfff);
    put(VECTOR_8, 0xff);
    decode();
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(3, n_of(SHEF_EVT_BAD_VECTOR));
}

static void test_vectors_keep_what_lies_inside_the_sensor(void)
{
    put(ROW, 5);
    put(BASE, 1260 | ON);
    put(VECTOR_12, 0xfff);
    put(VECTOR_12, 0xfff);
    put(VECTOR_8, 0xff);
    decode();
    TEST_ASSERT_EQUAL_UINT64(20, decoded.n_events);
    expect_event(&decoded, 19, T0_US + 11, 1279, 5, true);
    TEST_ASSERT_EQUAL_UINT64(12, n_of(SHEF_EVT_OUTSIDE));
}

static void test_vectors_that_run_off_the_address_range_stay_harmless(void)
{
    put(ROW, 5);
    put(BASE, 2047);
    for (int i = 0; i < 1000; i++)
        put(VECTOR_12, 0xfff);
    decode();
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(12000, n_of(SHEF_EVT_OUTSIDE));
}

static void test_a_row_below_the_sensor_drops_its_events(void)
{
    put(ROW, 720);
    put(EVENT, 1);
    put(BASE, 0);
    put(VECTOR_12, 3);
    put(VECTOR_12, 0);
    put(VECTOR_8, 0);
    put(ROW, 719);
    put(EVENT, 2);
    put(EVENT, 1280);
    decode();
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(4, n_of(SHEF_EVT_OUTSIDE));
}

static void test_events_before_a_row_or_a_time_are_dropped_and_counted(void)
{
    put(EVENT, 1);
    put(ROW, 3);
    put(EVENT, 2);
    decode();
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(1, n_of(SHEF_EVT_NO_ROW));

    stream.n_bytes = 0;
    put(ROW, 3);
    put(TIME_LOW, 3);
    put(EVENT, 2);
    put(TRIGGER, 1);
    decode();
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_triggers);
    TEST_ASSERT_EQUAL_UINT64(2, n_of(SHEF_EVT_NO_TIME));
}

static void test_triggers_take_the_time_of_the_words_before(void)
{
    put(TRIGGER, 1);
    put(TIME_LOW, 500);
    put(ROW, 1);
    put(EVENT, 1);
    put(TRIGGER, 7 << 8);
    decode();
    TEST_ASSERT_EQUAL_UINT64(2, decoded.n_triggers);
    TEST_ASSERT_EQUAL_INT64(T0_US + 11, decoded.triggers[0].t_us);
    TEST_ASSERT_TRUE(decoded.triggers[0].rising);
    TEST_ASSERT_EQUAL_UINT8(0, decoded.triggers[0].channel);
    TEST_ASSERT_EQUAL_INT64(T0_US + 500, decoded.triggers[1].t_us);
    TEST_ASSERT_FALSE(decoded.triggers[1].rising);
    TEST_ASSERT_EQUAL_UINT8(7, decoded.triggers[1].channel);
    TEST_ASSERT_EQUAL_UINT32(1, decoded.triggers[1].n_before);
}

static void test_foreign_rows_counters_and_padding_are_left_out_silently(void)
{
    put(ROW, 3);
    put(FOREIGN_ROW, 4);
    put(EVENT, 9);
    put(OTHER, 0x014);
    put(CONTINUED_12, 0x015);
    put(CONTINUED_12, 0);
    put(CONTINUED_4, 0);
    put(9, 0x999);
    put(ROW, 5);
    put(EVENT, 10);
    decode();
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    expect_event(&decoded, 0, T0_US + 11, 10, 5, false);
    expect_no_violations(&decoded.stats);
}

static void test_unknown_words_and_stray_continuations_are_counted(void)
{
    put(ROW, 3);
    put(11, 1);
    put(EVENT, 1);
    put(12, 1);
    put(EVENT, 2);
    put(CONTINUED_12, 1);
    put(EVENT, 3);
    put(CONTINUED_4, 1);
    put(9, 0x998);
    decode();
    TEST_ASSERT_EQUAL_UINT64(3, decoded.n_events);
    TEST_ASSERT_EQUAL_UINT64(5, n_of(SHEF_EVT_UNKNOWN_WORD));
}

static void test_small_backward_steps_pass_and_are_counted(void)
{
    put(ROW, 3);
    put(TIME_LOW, 100);
    put(EVENT, 1);
    put(TIME_LOW, 89);
    put(EVENT, 2);
    decode();
    expect_event(&decoded, 0, T0_US + 100, 1, 3, false);
    expect_event(&decoded, 1, T0_US + 89, 2, 3, false);
    TEST_ASSERT_EQUAL_UINT64(1, n_of(SHEF_EVT_TIME_BACK));
}

static void test_a_new_time_high_starts_at_low_zero_and_a_repeated_one_does_not(void)
{
    put(ROW, 3);
    put(TIME_HIGH, 2861);
    put(EVENT, 1);
    put(TIME_HIGH, 2862);
    put(EVENT, 2);
    decode();
    expect_event(&decoded, 0, T0_US + 11, 1, 3, false);
    expect_event(&decoded, 1, T0_US + 4096, 2, 3, false);
}

static void test_time_counts_on_over_wraps_of_16_seconds(void)
{
    put(ROW, 3);
    for (uint32_t high = 2862; high < 3 * 4096; high++)
        put(TIME_HIGH, high & 4095);
    put(TIME_LOW, 5);
    put(EVENT, 1);
    decode();
    expect_event(&decoded, 0, (3 * 4096 - 1) * 4096LL + 5, 1, 3, false);
    TEST_ASSERT_EQUAL_UINT64(2, decoded.stats.n_wraps);
    expect_no_violations(&decoded.stats);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_events_take_row_and_time_from_the_words_before);
    RUN_TEST(test_vectors_go_on_from_their_base);
    RUN_TEST(test_a_group_may_be_cut_anywhere_by_slices);
    RUN_TEST(test_incomplete_groups_are_counted_and_their_events_kept);
    RUN_TEST(test_vectors_without_a_base_are_dropped_and_counted);
    RUN_TEST(test_vectors_keep_what_lies_inside_the_sensor);
    RUN_TEST(test_vectors_that_run_off_the_address_range_stay_harmless);
    RUN_TEST(test_a_row_below_the_sensor_drops_its_events);
    RUN_TEST(test_events_before_a_row_or_a_time_are_dropped_and_counted);
    RUN_TEST(test_triggers_take_the_time_of_the_words_before);
    RUN_TEST(test_foreign_rows_counters_and_padding_are_left_out_silently);
    RUN_TEST(test_unknown_words_and_stray_continuations_are_counted);
    RUN_TEST(test_small_backward_steps_pass_and_are_counted);
    RUN_TEST(test_a_new_time_high_starts_at_low_zero_and_a_repeated_one_does_not);
    RUN_TEST(test_time_counts_on_over_wraps_of_16_seconds);
    return UNITY_END();
}
