#include "pipeline/filter.h"

#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "filter_model.h"

#define WIDTH_PX  40
#define HEIGHT_PX 30
#define C         SHEF_FILTER_LEVEL_STEP

static struct shef_filter *filter;

void tearDown(void)
{
    shef_filter_destroy(filter);
    filter = NULL;
}

static void start(void)
{
    const struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);

    tearDown();
    filter = shef_test_filter(&params);
}

static int32_t level_at(int64_t at_us)
{
    return shef_filter_level(filter, 5, 7, shef_test_us(at_us));
}

static void event_at(int64_t t_us, bool on)
{
    shef_test_apply_one(filter, t_us, 5, 7, on);
}

static void test_an_event_adds_a_step_that_decays_with_the_cutoff(void)
{
    start();
    event_at(1000, true);
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(1000));
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(C * exp(-.99996)), level_at(1000 + 8333));
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(C * exp(-2.4)), level_at(1000 + 20000));
    TEST_ASSERT_EQUAL_INT32(0, level_at(1000 + 300000));
    TEST_ASSERT_EQUAL_INT32(0, level_at(INT64_C(1000) << 40));
    TEST_ASSERT_EQUAL_INT32(0, shef_filter_level(filter, 6, 7, shef_test_us(1000)));
    event_at(1000, false);
    event_at(1000, false);
    TEST_ASSERT_INT32_WITHIN(2, -C, level_at(1000));
}

static void test_gains_of_polarities_and_pixels_multiply(void)
{
    static struct shef_filter_gain gains[WIDTH_PX * HEIGHT_PX];
    struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_image_i16 sums;

    params.on_gain = 0.9;
    params.off_gain = 1.25;
    filter = shef_test_filter(&params);
    event_at(0, true);
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(.9 * C), level_at(0));
    event_at(0, false);
    TEST_ASSERT_INT32_WITHIN(2, (int32_t)lrint(-.35 * C), level_at(0));

    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        gains[i] = (struct shef_filter_gain){ 256, 256 };
    gains[7 * WIDTH_PX + 5] = (struct shef_filter_gain){ 512, 128 };
    TEST_ASSERT_EQUAL(SHEF_OK, shef_filter_set_gains(filter, gains, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&sums, WIDTH_PX, HEIGHT_PX, NULL));
    event_at(400000, true);
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(1.8 * C), level_at(400000));
    event_at(800000, false);
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(-.625 * C), level_at(800000));
    shef_filter_read_sums(filter, sums);
    TEST_ASSERT_INT_WITHIN(2, lrint(256 * (.9 - 1.25 + 1.8 - .625)), shef_row_i16(sums, 7)[5]);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_filter_set_gains(filter, NULL, NULL));
    event_at(1200000, true);
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(.9 * C), level_at(1200000));
    shef_image_destroy_i16(&sums);
}

static void test_levels_saturate_instead_of_turning_round(void)
{
    start();
    for (int i = 0; i < 10000; i++)
        event_at(500, true);
    TEST_ASSERT_GREATER_THAN_INT32(INT32_MAX - 16, level_at(500));
    for (int i = 0; i < 20000; i++)
        event_at(500, false);
    TEST_ASSERT_LESS_THAN_INT32(-INT32_MAX + 16, level_at(500));
    TEST_ASSERT_LESS_THAN_INT32(0, level_at(600));
}

static void test_small_steps_back_in_time_count_as_no_time(void)
{
    start();
    event_at(100000, true);
    event_at(99000, true);
    TEST_ASSERT_INT32_WITHIN(2, 2 * C, level_at(100000));
    /* The newer time was kept: at 108333 it is one time constant old. */
    TEST_ASSERT_INT32_WITHIN(2, (int32_t)lrint(2 * C * exp(-.99996)), level_at(108333));
    /* A pixel that was quiet takes the older time as it is. */
    shef_test_apply_one(filter, 99000, 6, 7, true);
    TEST_ASSERT_INT32_WITHIN(1, (int32_t)lrint(C * exp(-.12)),
                             shef_filter_level(filter, 6, 7, shef_test_us(100000)));
    TEST_ASSERT_EQUAL_INT64(100000, shef_filter_newest(filter).ns / 1000);
    TEST_ASSERT_EQUAL_UINT32(0, shef_filter_stats(filter).n_epochs);
}

static void test_one_wrong_time_is_left_out_and_wipes_nothing(void)
{
    start();
    event_at(20000000, true);
    event_at(3, true);
    event_at(INT64_C(1) << 41, true);
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(20000000));
    TEST_ASSERT_EQUAL_UINT64(2, shef_filter_stats(filter).n_strays);
    TEST_ASSERT_EQUAL_UINT64(1, shef_filter_stats(filter).n_events);
    for (int i = 0; i < 100; i++) {
        event_at(20000000 + i, false);
        event_at(100, true);
    }
    TEST_ASSERT_EQUAL_UINT32(0, shef_filter_stats(filter).n_epochs);
    TEST_ASSERT_LESS_THAN_INT32(-90 * C, level_at(20000100));
}

static void test_many_times_that_agree_start_a_new_epoch(void)
{
    start();
    event_at(90000000, true);
    for (int i = 0; i < SHEF_FILTER_CONFIRMATIONS; i++)
        event_at(5000 + i, true);
    TEST_ASSERT_EQUAL_UINT32(1, shef_filter_stats(filter).n_epochs);
    TEST_ASSERT_EQUAL_UINT64(SHEF_FILTER_CONFIRMATIONS - 1, shef_filter_stats(filter).n_strays);
    /* Only the event that confirmed it counts, on zeroed levels. */
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(5000 + SHEF_FILTER_CONFIRMATIONS - 1));
    TEST_ASSERT_EQUAL_INT64(5000 + SHEF_FILTER_CONFIRMATIONS - 1,
                            shef_filter_newest(filter).ns / 1000);
}

static void test_a_long_gap_ahead_is_taken_after_confirmation_and_is_no_epoch(void)
{
    const int64_t later_us = INT64_C(7200) * 1000000; /* two hours: past the wrap of 32 bits */

    start();
    event_at(1000, true);
    event_at(9000000, true); /* within 10 s: at once */
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(9000000));
    for (int i = 0; i < SHEF_FILTER_CONFIRMATIONS; i++)
        event_at(later_us, true);
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(later_us));
    TEST_ASSERT_EQUAL_UINT32(0, shef_filter_stats(filter).n_epochs);
}

static void test_events_outside_the_sensor_are_counted_and_left_out(void)
{
    const struct shef_event events[] = {
        shef_event_make(0, WIDTH_PX, 7, true),
        shef_event_make(0, 5, HEIGHT_PX, true),
        shef_event_make(0, 65535, 32767, false),
        shef_event_make(0, 5, 7, true),
    };

    start();
    TEST_ASSERT_EQUAL_UINT32(4, shef_filter_apply(filter, events, 4, 50, SHEF_TEST_FOREVER));
    TEST_ASSERT_EQUAL_UINT64(3, shef_filter_stats(filter).n_outside);
    TEST_ASSERT_EQUAL_UINT64(1, shef_filter_stats(filter).n_events);
    TEST_ASSERT_INT32_WITHIN(1, C, level_at(50));
}

static void test_events_later_than_the_limit_are_left_for_the_next_call(void)
{
    const struct shef_event events[] = {
        shef_event_make(0, 5, 7, true),
        shef_event_make(10, 5, 7, true),
        shef_event_make(11, 5, 7, true),
        shef_event_make(9, 5, 7, true),
    };

    start();
    TEST_ASSERT_EQUAL_UINT32(
        2, shef_filter_apply(filter, events, 4, 100, (shef_event_time){ 110999 }));
    TEST_ASSERT_INT32_WITHIN(700, 2 * C, level_at(110));
    TEST_ASSERT_EQUAL_UINT32(
        2, shef_filter_apply(filter, events + 2, 2, 100, (shef_event_time){ 111000 }));
    TEST_ASSERT_INT32_WITHIN(2000, 4 * C, level_at(111));
    /* Before the stream's zero, too. */
    start();
    TEST_ASSERT_EQUAL_UINT32(
        1, shef_filter_apply(filter, events, 4, -100, (shef_event_time){ -90001 }));
}

/* Random events with jitter, bursts, strays, a wrap of the 32-bit time and a step back. */
static uint32_t make_stream(struct shef_test_random *random, struct shef_event *events, uint32_t n)
{
    uint32_t t_us = 2000000;

    for (uint32_t i = 0; i < n; i++) {
        const bool is_far = shef_test_random_range(random, 0, 499) == 0;
        const uint32_t jitter_us = (uint32_t)shef_test_random_range(random, 0, 3) * 40;

        if (shef_test_random_range(random, 0, 9) == 0)
            t_us += (uint32_t)shef_test_random_range(random, 1, 300);
        events[i] = shef_event_make(is_far ? t_us + 4000000000u : t_us - jitter_us,
                                    (uint32_t)shef_test_random_range(random, 0, WIDTH_PX),
                                    (uint32_t)shef_test_random_range(random, 0, HEIGHT_PX - 1),
                                    shef_test_random_range(random, 0, 1));
        if (i == n / 2)
            t_us -= 900000; /* a step back: a new epoch */
    }
    return t_us;
}

static void test_the_state_depends_on_the_events_and_not_on_their_slicing(void)
{
    enum { N_EVENTS = 60000 };
    static struct shef_event events[N_EVENTS];
    struct shef_test_random random = shef_test_random_start();
    const struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    const int64_t base_us = (INT64_C(1) << 32) - 300000;
    const shef_event_time end = shef_test_us(base_us + make_stream(&random, events, N_EVENTS));
    struct shef_filter *sliced = shef_test_filter(&params);
    uint32_t at = 0;

    start();
    /* The call ends with the event that begins the new epoch. */
    const uint32_t n_old = shef_filter_apply(filter, events, N_EVENTS, base_us, SHEF_TEST_FOREVER);

    TEST_ASSERT_GREATER_THAN_UINT32(N_EVENTS / 2, n_old);
    TEST_ASSERT_LESS_THAN_UINT32(N_EVENTS / 2 + 1000, n_old);
    TEST_ASSERT_EQUAL_UINT32(
        N_EVENTS - n_old,
        shef_filter_apply(filter, events + n_old, N_EVENTS - n_old, base_us, SHEF_TEST_FOREVER));
    while (at < N_EVENTS) {
        const uint32_t left = N_EVENTS - at;
        const uint32_t wanted = (uint32_t)shef_test_random_range(&random, 1, 700);
        const uint32_t n = wanted < left ? wanted : left;
        const shef_event_time until = {
            (base_us + events[at].t_us + shef_test_random_range(&random, -100, 400)) * 1000
        };

        const uint32_t n_used = shef_filter_apply(sliced, events + at, n, base_us, until);

        at += n_used;
        if (n_used == 0) {
            TEST_ASSERT_EQUAL_UINT32(
                1, shef_filter_apply(sliced, events + at, 1, base_us, SHEF_TEST_FOREVER));
            at++;
        }
    }
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            TEST_ASSERT_EQUAL_INT32(shef_filter_level(filter, x, y, end),
                                    shef_filter_level(sliced, x, y, end));

    const struct shef_filter_stats a = shef_filter_stats(filter);
    const struct shef_filter_stats b = shef_filter_stats(sliced);

    TEST_ASSERT_EQUAL_UINT64(a.n_events, b.n_events);
    TEST_ASSERT_EQUAL_UINT64(a.n_outside, b.n_outside);
    TEST_ASSERT_EQUAL_UINT64(a.n_strays, b.n_strays);
    TEST_ASSERT_EQUAL_UINT32(1, a.n_epochs);
    TEST_ASSERT_EQUAL_UINT32(1, b.n_epochs);
    TEST_ASSERT_GREATER_THAN_UINT64(N_EVENTS / 2, a.n_events);
    TEST_ASSERT_GREATER_THAN_UINT64(50, a.n_strays);
    TEST_ASSERT_GREATER_THAN_UINT64(500, a.n_outside);
    shef_filter_destroy(sliced);
}

static void test_pixels_quiet_for_over_an_hour_wake_up_exactly(void)
{
    const int64_t start_us = INT64_C(5000000000);
    const int64_t hour_us = INT64_C(3600000000);

    start();
    event_at(start_us, true);
    shef_test_apply_one(filter, start_us, 39, 29, true);
    /* Another pixel keeps the stream going, past the wrap and 75 minutes. */
    for (int64_t t_us = start_us; t_us < start_us + hour_us * 5 / 4; t_us += 5000000)
        shef_test_apply_one(filter, t_us, 20, 20, true);
    event_at(start_us + hour_us * 5 / 4, false);
    TEST_ASSERT_INT32_WITHIN(1, -C, level_at(start_us + hour_us * 5 / 4));
    TEST_ASSERT_EQUAL_UINT64(0, shef_filter_stats(filter).n_strays);
}

static void expect_close_to_double(double cutoff_rad_s, int32_t shortest_us, int32_t longest_us)
{
    enum { N_EVENTS = 200000 };
    struct shef_filter_params params = shef_filter_default_params(8, 8);
    struct shef_test_random random = shef_test_random_start();
    int64_t t_us = (INT64_C(1) << 32) - 1000000;

    params.cutoff_rad_s = cutoff_rad_s;
    params.on_gain = 1.125;

    struct shef_test_model model = shef_test_model_create(&params);

    filter = shef_test_filter(&params);
    for (int i = 0; i < N_EVENTS; i++) {
        /* One pixel in 64 gets every second event, of mostly one polarity. */
        const uint32_t pixel = (uint32_t)shef_test_random_range(&random, 0, 127);
        const bool is_hot = pixel >= 64;
        const bool on = shef_test_random_range(&random, 0, is_hot ? 9 : 1) != 0;
        const struct shef_event event =
            shef_event_make(0, is_hot ? 3 : pixel % 8, is_hot ? 3 : pixel / 8, on);

        t_us += shef_test_random_range(&random, shortest_us, longest_us);
        TEST_ASSERT_EQUAL_UINT32(1, shef_filter_apply(filter, &event, 1, t_us, SHEF_TEST_FOREVER));
        shef_test_model_apply(&model, event, t_us);
        if (i % 97 == 0)
            shef_test_model_compare(&model, filter, t_us);
    }
    printf("cut-off %.0f rad/s: worst error %.2e steps, largest level %.0f\n", cutoff_rad_s,
           model.worst_c, model.largest_c);
    TEST_ASSERT_TRUE(model.worst_c <= 2e-4);
    TEST_ASSERT_TRUE(model.largest_c > 3);
    shef_test_model_destroy(&model);
    tearDown();
}

static void test_levels_stay_close_to_double_precision(void)
{
    expect_close_to_double(120, 2, 5);
    expect_close_to_double(120, 0, 2000);
    expect_close_to_double(8, 100, 3000);
    expect_close_to_double(2000, 0, 200);
}

static void test_images_show_what_the_pixels_hold_except_where_masked(void)
{
    const struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_test_random random = shef_test_random_start();
    struct shef_test_model model = shef_test_model_create(&params);
    struct shef_image_i16 values;
    struct shef_image_i16 sums;
    const uint32_t masked[] = { 0, 7 * WIDTH_PX + 5, WIDTH_PX * HEIGHT_PX - 1 };
    int64_t t_us = 0;
    int n_visible = 0;

    start();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&values, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&sums, WIDTH_PX, HEIGHT_PX, NULL));
    for (int i = 0; i < 20000; i++) {
        const struct shef_event event =
            shef_event_make(0, (uint32_t)shef_test_random_range(&random, 0, WIDTH_PX - 1),
                            (uint32_t)shef_test_random_range(&random, 0, HEIGHT_PX - 1),
                            shef_test_random_range(&random, 0, 3) != 0);

        t_us += shef_test_random_range(&random, 0, 10);
        shef_test_apply_one(filter, t_us, event.x_px, shef_event_y_px(event),
                            shef_event_is_on(event));
        shef_test_model_apply(&model, event, t_us);
    }
    shef_filter_set_mask(filter, masked, 3);
    shef_filter_read(filter, shef_test_us(t_us + 4000), values);
    shef_filter_read_sums(filter, sums);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const uint32_t pixel = (uint32_t)(y * WIDTH_PX + x);
            const bool is_masked = pixel == masked[0] || pixel == masked[1] || pixel == masked[2];
            const double expected = 256 * shef_test_model_level(&model, x, y, t_us + 4000);

            if (is_masked) {
                TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(values, y)[x]);
                TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(sums, y)[x]);
                continue;
            }
            TEST_ASSERT_TRUE(fabs(shef_row_i16(values, y)[x] - expected) <= .6);
            TEST_ASSERT_EQUAL_INT16(model.sums[pixel], shef_row_i16(sums, y)[x]);
            n_visible += expected > 256;
        }
    TEST_ASSERT_GREATER_THAN_INT(100, n_visible);
    shef_filter_set_mask(filter, NULL, 0);
    shef_filter_read(filter, shef_test_us(t_us), values);
    TEST_ASSERT_TRUE(shef_row_i16(values, 7)[5] != 0);
    shef_image_destroy_i16(&values);
    shef_image_destroy_i16(&sums);
    shef_test_model_destroy(&model);
}

static void test_accrued_sums_weigh_what_came_since_the_last_look(void)
{
    struct shef_image_i16 values;
    struct shef_image_i16 before;

    start();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&values, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&before, WIDTH_PX, HEIGHT_PX, NULL));
    event_at(0, true);
    event_at(10, true);
    shef_filter_read(filter, shef_test_us(10), values);
    shef_filter_read_sums(filter, before);
    TEST_ASSERT_INT_WITHIN(1, 512, shef_row_i16(values, 7)[5]);
    for (int i = 0; i < 3; i++)
        event_at(20, false);
    shef_filter_accrue_sums(filter, .5, values, before);
    TEST_ASSERT_INT_WITHIN(1, 512 - 384, shef_row_i16(values, 7)[5]);
    event_at(30, true);
    shef_filter_accrue_sums(filter, .25, values, before);
    TEST_ASSERT_INT_WITHIN(1, 512 - 384 + 64, shef_row_i16(values, 7)[5]);
    shef_image_destroy_i16(&values);
    shef_image_destroy_i16(&before);
}

static void expect_refused(struct shef_filter_params params, const char *reason)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_filter_create(&filter, &params, SHEF_CPU_NONE, &err));
    TEST_ASSERT_NULL(filter);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_sentence(void)
{
    struct shef_filter_params params = shef_filter_default_params(0, 480);

    expect_refused(params, "sides must be 1 to 2048");
    params = shef_filter_default_params(640, 480);
    params.cutoff_rad_s = NAN;
    expect_refused(params, "cut-off");
    params.cutoff_rad_s = 5;
    expect_refused(params, "must be 8 to 2000");
    params = shef_filter_default_params(640, 480);
    params.off_gain = 0;
    expect_refused(params, "gains");
    params = shef_filter_default_params(640, 480);
    params.back_step_us = -1;
    expect_refused(params, "backward step");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_event_adds_a_step_that_decays_with_the_cutoff);
    RUN_TEST(test_gains_of_polarities_and_pixels_multiply);
    RUN_TEST(test_levels_saturate_instead_of_turning_round);
    RUN_TEST(test_small_steps_back_in_time_count_as_no_time);
    RUN_TEST(test_one_wrong_time_is_left_out_and_wipes_nothing);
    RUN_TEST(test_many_times_that_agree_start_a_new_epoch);
    RUN_TEST(test_a_long_gap_ahead_is_taken_after_confirmation_and_is_no_epoch);
    RUN_TEST(test_events_outside_the_sensor_are_counted_and_left_out);
    RUN_TEST(test_events_later_than_the_limit_are_left_for_the_next_call);
    RUN_TEST(test_the_state_depends_on_the_events_and_not_on_their_slicing);
    RUN_TEST(test_pixels_quiet_for_over_an_hour_wake_up_exactly);
    RUN_TEST(test_levels_stay_close_to_double_precision);
    RUN_TEST(test_images_show_what_the_pixels_hold_except_where_masked);
    RUN_TEST(test_accrued_sums_weigh_what_came_since_the_last_look);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_sentence);
    return UNITY_END();
}
