#include "codecs/evt_clock.h"

#include "support/support.h"

static struct shef_evt_clock clock_;

static void start_evt2(uint32_t value)
{
    shef_evt_clock_init(&clock_, 28, 64, 0);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, value));
}

static void start_evt3(uint32_t value)
{
    shef_evt_clock_init(&clock_, 12, 4096, 0);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, value));
}

/* What a sensor does: the same value again and again. */
static void repeat(uint32_t value, int n)
{
    for (int i = 0; i < n; i++)
        TEST_ASSERT_EQUAL(SHEF_EVT_TICK_SAME, shef_evt_clock_push(&clock_, value));
}

static void test_time_is_unknown_until_the_first_word(void)
{
    shef_evt_clock_init(&clock_, 28, 64, 0);
    TEST_ASSERT_FALSE(shef_evt_clock_runs(&clock_));
    start_evt2(1000);
    TEST_ASSERT_TRUE(shef_evt_clock_runs(&clock_));
    TEST_ASSERT_EQUAL_INT64(64000, clock_.high_us);
}

static void test_evt2_counts_on_over_its_wrap_at_2_to_the_34_us(void)
{
    start_evt2((1u << 28) - 1);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 0));
    TEST_ASSERT_EQUAL_INT64((int64_t)1 << 34, clock_.high_us);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 1));
    TEST_ASSERT_EQUAL_INT64(((int64_t)1 << 34) + 64, clock_.high_us);
}

static void test_evt3_counts_on_over_many_wraps(void)
{
    start_evt3(4000);
    for (int64_t high = 4001; high < 50000; high++)
        TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD,
                          shef_evt_clock_push(&clock_, (uint32_t)(high & 4095)));
    TEST_ASSERT_EQUAL_INT64(49999 * 4096LL, clock_.high_us);
}

static void test_a_hint_puts_the_first_word_into_the_right_wrap(void)
{
    const int64_t range_us = 1 << 24;

    for (int64_t near_us = 0; near_us < 5 * range_us; near_us += range_us / 7) {
        shef_evt_clock_init(&clock_, 12, 4096, near_us);
        /* 100 ms later than the hint says; from 0 on there is no wrap before. */
        const int64_t true_us = near_us + 100000;

        shef_evt_clock_push(&clock_, (uint32_t)(true_us >> 12 & 4095));
        TEST_ASSERT_EQUAL_INT64(true_us & ~4095LL, clock_.high_us);
    }
    shef_evt_clock_init(&clock_, 12, 4096, 3 * range_us + 4096);
    shef_evt_clock_push(&clock_, 4095);
    TEST_ASSERT_EQUAL_INT64(3 * range_us - 4096, clock_.high_us);
}

static void test_a_sparse_stream_may_pause_as_it_likes(void)
{
    start_evt2(10);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 11));
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 50000000));
    TEST_ASSERT_EQUAL_INT64(50000000 * 64LL, clock_.high_us);

    start_evt3(0);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 3000));
    TEST_ASSERT_EQUAL_INT64(3000 * 4096LL, clock_.high_us);
}

static void test_neighbours_swapped_are_followed_back_at_once(void)
{
    start_evt3(100);
    repeat(100, 50);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_BACK, shef_evt_clock_push(&clock_, 99));
    TEST_ASSERT_EQUAL_INT64(99 * 4096LL, clock_.high_us);
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_AHEAD, shef_evt_clock_push(&clock_, 100));
}

static void test_one_flipped_bit_never_moves_time_in_a_sensor_stream(void)
{
    for (uint32_t bit = 1; bit < 12; bit++) {
        start_evt3(1365);
        repeat(1365, 50);
        const enum shef_evt_tick tick = shef_evt_clock_push(&clock_, 1365 ^ 1u << bit);

        TEST_ASSERT_TRUE(tick == SHEF_EVT_TICK_DOUBT_AHEAD || tick == SHEF_EVT_TICK_DOUBT_BACK);
        TEST_ASSERT_FALSE(shef_evt_clock_runs(&clock_));
        repeat(1365, 1);
        TEST_ASSERT_TRUE(shef_evt_clock_runs(&clock_));
        TEST_ASSERT_EQUAL_INT64(1365 * 4096LL, clock_.high_us);
    }
}

static void test_lost_data_is_believed_with_the_fourth_word(void)
{
    start_evt2(1000);
    repeat(1000, 20);
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL(SHEF_EVT_TICK_DOUBT_AHEAD, shef_evt_clock_push(&clock_, 5000));
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_GAP, shef_evt_clock_push(&clock_, 5000));
    TEST_ASSERT_TRUE(shef_evt_clock_runs(&clock_));
    TEST_ASSERT_EQUAL_INT64(5000 * 64LL, clock_.high_us);
}

static void test_a_clock_set_back_is_believed_with_the_fourth_word(void)
{
    start_evt2(1000);
    repeat(1000, 20);
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL(SHEF_EVT_TICK_DOUBT_BACK, shef_evt_clock_push(&clock_, 3));
    TEST_ASSERT_EQUAL(SHEF_EVT_TICK_BACK, shef_evt_clock_push(&clock_, 4));
    TEST_ASSERT_EQUAL_INT64(4 * 64LL, clock_.high_us);
}

static void test_words_that_contradict_each_other_are_never_believed(void)
{
    start_evt2(1000);
    repeat(1000, 20);
    for (uint32_t i = 1; i < 100; i++)
        TEST_ASSERT_EQUAL(SHEF_EVT_TICK_DOUBT_AHEAD, shef_evt_clock_push(&clock_, 1000 + i * 1000));
    TEST_ASSERT_EQUAL_INT64(1000 * 64LL, clock_.high_us);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_time_is_unknown_until_the_first_word);
    RUN_TEST(test_evt2_counts_on_over_its_wrap_at_2_to_the_34_us);
    RUN_TEST(test_evt3_counts_on_over_many_wraps);
    RUN_TEST(test_a_hint_puts_the_first_word_into_the_right_wrap);
    RUN_TEST(test_a_sparse_stream_may_pause_as_it_likes);
    RUN_TEST(test_neighbours_swapped_are_followed_back_at_once);
    RUN_TEST(test_one_flipped_bit_never_moves_time_in_a_sensor_stream);
    RUN_TEST(test_lost_data_is_believed_with_the_fourth_word);
    RUN_TEST(test_a_clock_set_back_is_believed_with_the_fourth_word);
    RUN_TEST(test_words_that_contradict_each_other_are_never_believed);
    return UNITY_END();
}
