/* The event sensor: what dead time, latency and each kind of noise add. */
#include <math.h>

#include "event_runs.h"
#include "support/support.h"

static void expect_gaps_of_at_least(int64_t gap_us)
{
    static int64_t last[N_PIXELS];

    for (int32_t k = 0; k < N_PIXELS; k++)
        last[k] = INT64_MIN / 2;
    TEST_ASSERT_GREATER_THAN_size_t(10000, seen.n);
    for (size_t i = 0; i < seen.n; i++) {
        /* Both times are rounded down to whole microseconds. */
        TEST_ASSERT_TRUE(seen.t_us[i] - last[pixel_of(i)] >= gap_us - 1);
        last[pixel_of(i)] = seen.t_us[i];
    }
}

static void test_a_pixel_is_silent_for_its_dead_time(void)
{
    params.dead_time_ns = 3000000;
    sensor_make(5);
    run_texture(200);
    expect_gaps_of_at_least(3000);
}

static void test_dead_time_holds_with_noise_jitter_and_mismatch_too(void)
{
    params.mismatch = 0.2;
    params.dead_time_ns = 700000;
    params.jitter_ns = 100000;
    params.background_hz = 20;
    params.hot_share = 0.02;
    sensor_make(5);
    run_texture(200);
    expect_gaps_of_at_least(700);
    /* Nothing comes later than the last image but by jitter. */
    TEST_ASSERT_TRUE(seen.t_us[seen.n - 1] <= 200 * STEP_US + 347);
}

static void test_what_a_dead_time_held_back_is_said_later(void)
{
    int32_t sum[N_PIXELS] = { 0 };

    params.dead_time_ns = 400000;
    sensor_make(1);
    for (int32_t i = 0; i <= 200; i++) {
        image_paint(i * STEP_US * 1e-6);
        sensor_show((int64_t)i * STEP_US);
    }
    /* The same image for a while: what is owed is paid. */
    for (int32_t i = 1; i <= 20; i++)
        sensor_show((int64_t)(200 + i) * STEP_US);
    sensor_end();
    TEST_ASSERT_TRUE(seen.t_us[seen.n - 1] <= 220 * STEP_US);
    for (size_t i = 0; i < seen.n; i++)
        sum[pixel_of(i)] += shef_event_is_on(seen.events[i]) ? 1 : -1;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        const double now = log(exp(light_log(k % WIDTH, k / WIDTH, 0.4)) + params.dark);
        const double first = log(exp(light_log(k % WIDTH, k / WIDTH, 0)) + params.dark);

        TEST_ASSERT_DOUBLE_WITHIN(0.301, now - first, 0.3 * sum[k]);
    }
}

static void test_latency_shifts_and_jitter_spreads_times(void)
{
    double mean = 0, squares = 0;

    params.latency_ns = 500000;
    params.jitter_ns = 40000;
    sensor_make(7);
    image_paint_constant(1);
    sensor_show(0);
    /* One event each, half-way up: ln rises by 0.6 within the step. */
    image_paint_constant(1.0f + 1.01f * (float)(exp(0.45) - 1));
    sensor_show(100000);
    image_paint_constant(1.0f + 1.01f * (float)(exp(0.45) - 1));
    sensor_show(110000);
    sensor_end();
    TEST_ASSERT_EQUAL_size_t(N_PIXELS, seen.n);
    for (size_t i = 0; i < seen.n; i++) {
        const double late = (double)seen.t_us[i] - 100000 * 0.3 / 0.45;

        mean += late / N_PIXELS;
        squares += late * late / N_PIXELS;
    }
    TEST_ASSERT_DOUBLE_WITHIN(3, 500, mean);
    TEST_ASSERT_DOUBLE_WITHIN(2, 40, sqrt(squares - mean * mean));
}

static void test_leak_makes_on_events_at_its_rate(void)
{
    params.leak_hz = 2;
    sensor_make(1);
    run_constant(0.4f, 500); /* 10 s */
    TEST_ASSERT_UINT32_WITHIN(N_PIXELS / 50, 20 * N_PIXELS, seen.n);
    for (size_t i = 0; i < seen.n; i++)
        TEST_ASSERT_TRUE(shef_event_is_on(seen.events[i]));
    /* Not all at once, from the first period on. */
    for (size_t i = 0; i < 10; i++)
        TEST_ASSERT_INT64_WITHIN(60000, 500000 * (int64_t)i / 10,
                                 seen.t_us[(size_t)N_PIXELS * i / 10]);
}

static void test_a_long_leak_does_not_overflow(void)
{
    params.leak_hz = 100;
    params.threshold_on = 10;
    sensor_make(1);
    run_constant(0.4f, 200); /* 4 s: twice what 32 bits of levels hold */
    TEST_ASSERT_UINT32_WITHIN(N_PIXELS, 400 * N_PIXELS, seen.n);
}

static void test_background_comes_at_its_rate_evenly_in_space_and_sign(void)
{
    size_t n_on = 0, n_left = 0;

    params.background_hz = 3;
    sensor_make(11);
    run_constant(0.4f, 500); /* 10 s */
    TEST_ASSERT_DOUBLE_WITHIN(5 * sqrt(30.0 * N_PIXELS), 30.0 * N_PIXELS, (double)seen.n);
    TEST_ASSERT_EQUAL_size_t(seen.n, sim_event_sensor_stats(sensor).n_background);
    for (size_t i = 0; i < seen.n; i++) {
        n_on += shef_event_is_on(seen.events[i]);
        n_left += seen.events[i].x_px < WIDTH / 2;
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.5 * sqrt((double)seen.n), (double)seen.n / 2, (double)n_on);
    TEST_ASSERT_DOUBLE_WITHIN(2.5 * sqrt((double)seen.n), (double)seen.n / 2, (double)n_left);
}

static void test_hot_pixels_are_few_and_fast(void)
{
    int32_t n[N_PIXELS] = { 0 };
    int32_t n_hot = 0;

    params.hot_share = 0.01;
    sensor_make(11);
    run_constant(0.4f, 500); /* 10 s */
    for (size_t i = 0; i < seen.n; i++)
        n[pixel_of(i)]++;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        TEST_ASSERT_TRUE(n[k] == 0 || n[k] >= 999);
        n_hot += n[k] > 0;
    }
    /* Two that were drawn on the same pixel count once. */
    TEST_ASSERT_INT32_WITHIN(3, N_PIXELS / 100 - 2, n_hot);
    TEST_ASSERT_UINT32_WITHIN(1500 * n_hot / 4, 3000 * n_hot, seen.n);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_pixel_is_silent_for_its_dead_time);
    RUN_TEST(test_dead_time_holds_with_noise_jitter_and_mismatch_too);
    RUN_TEST(test_what_a_dead_time_held_back_is_said_later);
    RUN_TEST(test_latency_shifts_and_jitter_spreads_times);
    RUN_TEST(test_leak_makes_on_events_at_its_rate);
    RUN_TEST(test_a_long_leak_does_not_overflow);
    RUN_TEST(test_background_comes_at_its_rate_evenly_in_space_and_sign);
    RUN_TEST(test_hot_pixels_are_few_and_fast);
    return UNITY_END();
}
