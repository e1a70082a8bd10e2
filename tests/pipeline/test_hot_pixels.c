#include "pipeline/hot_pixels.h"

#include <math.h>
#include <string.h>

#include "filter_model.h"

#define WIDTH_PX  20
#define HEIGHT_PX 10

static struct shef_hot_pixels *hot;
static int64_t now_us;
static uint32_t n_sent;

void tearDown(void)
{
    shef_hot_pixels_destroy(hot);
    hot = NULL;
}

/* 3 windows of 100 ms, 1000 events a second. */
static void start(void)
{
    struct shef_hot_pixels_params params = shef_hot_pixels_default_params(WIDTH_PX, HEIGHT_PX);

    tearDown();
    params.limit_per_s = 1000;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_create(&hot, &params, NULL));
    now_us = 500000;
    shef_hot_pixels_start(hot, shef_test_us(now_us));
}

static void send(uint32_t x_px, uint32_t y_px)
{
    const struct shef_event event = shef_event_make(0, x_px, y_px, n_sent++ % 2 != 0);

    shef_hot_pixels_count(hot, &event, 1);
}

/* One window in which (3, 4) fires n times and 60 other pixels 50 times in all. */
static bool window_with(int n)
{
    struct shef_test_random random = { (uint64_t)n_sent + 1 };

    for (int i = 0; i < n; i++) {
        send(3, 4);
        if (i % 2 == 0)
            send((uint32_t)shef_test_random_range(&random, 0, WIDTH_PX - 1), 9);
    }
    now_us += 100000;
    TEST_ASSERT_EQUAL_INT64(now_us * 1000, shef_hot_pixels_due(hot).ns);
    return shef_hot_pixels_learn(hot, shef_test_us(now_us));
}

static uint32_t list(const struct shef_hot_pixel **out_pixels)
{
    const uint32_t *indices;
    const uint32_t n = shef_hot_pixels_list(hot, out_pixels, &indices);

    for (uint32_t i = 0; i < n; i++)
        TEST_ASSERT_EQUAL_UINT32((*out_pixels)[i].y_px * WIDTH_PX + (*out_pixels)[i].x_px,
                                 indices[i]);
    return n;
}

static void test_a_pixel_is_hot_after_three_windows_above_the_limit(void)
{
    const struct shef_hot_pixel *pixels;

    start();
    TEST_ASSERT_FALSE(window_with(300));
    TEST_ASSERT_FALSE(window_with(300));
    TEST_ASSERT_EQUAL_UINT32(0, list(&pixels));
    TEST_ASSERT_TRUE(window_with(300));
    TEST_ASSERT_EQUAL_UINT32(1, list(&pixels));
    TEST_ASSERT_EQUAL_UINT16(3, pixels[0].x_px);
    TEST_ASSERT_EQUAL_UINT16(4, pixels[0].y_px);
    TEST_ASSERT_FLOAT_WITHIN(600, 3000, pixels[0].per_s);
}

static void test_a_busy_moment_is_not_enough(void)
{
    const struct shef_hot_pixel *pixels;

    start();
    for (int i = 0; i < 10; i++) {
        TEST_ASSERT_FALSE(window_with(500));
        TEST_ASSERT_FALSE(window_with(500));
        TEST_ASSERT_FALSE(window_with(20));
    }
    TEST_ASSERT_EQUAL_UINT32(0, list(&pixels));
}

static void test_a_pixel_that_cools_down_is_let_go(void)
{
    const struct shef_hot_pixel *pixels;

    start();
    for (int i = 0; i < 3; i++)
        window_with(300);
    for (int i = 0; i < 23; i++)
        TEST_ASSERT_FALSE(window_with(0));
    /* Above half the limit once: it all starts again. */
    TEST_ASSERT_FALSE(window_with(90));
    for (int i = 0; i < 23; i++)
        TEST_ASSERT_FALSE(window_with(10));
    TEST_ASSERT_EQUAL_UINT32(1, list(&pixels));
    TEST_ASSERT_TRUE(window_with(0));
    TEST_ASSERT_EQUAL_UINT32(0, list(&pixels));
    /* And can be learnt anew. */
    for (int i = 0; i < 3; i++)
        window_with(300);
    TEST_ASSERT_EQUAL_UINT32(1, list(&pixels));
}

static void test_given_pixels_stay_and_others_beside_them_come_and_go(void)
{
    const struct shef_hot_pixel *pixels;
    struct shef_error err = { 0 };

    start();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_add(hot, 0, 0, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_add(hot, 19, 9, &err));
    for (int i = 0; i < 3; i++)
        window_with(300);
    TEST_ASSERT_EQUAL_UINT32(3, list(&pixels));
    for (int i = 0; i < 100; i++)
        window_with(0);
    TEST_ASSERT_EQUAL_UINT32(2, list(&pixels));
    TEST_ASSERT_EQUAL_FLOAT(0, pixels[0].per_s);
    /* A learnt one can be made to stay. */
    for (int i = 0; i < 3; i++)
        window_with(300);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_add(hot, 3, 4, &err));
    for (int i = 0; i < 100; i++)
        window_with(0);
    TEST_ASSERT_EQUAL_UINT32(3, list(&pixels));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_hot_pixels_add(hot, 20, 4, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "only 20 x 10 px"));
}

static void test_events_outside_the_sensor_are_passed_over(void)
{
    const struct shef_hot_pixel *pixels;

    start();
    for (int window = 0; window < 5; window++) {
        for (int i = 0; i < 1000; i++) {
            send(20, 0);
            send(3, 10);
            send(65535, 32767);
        }
        window_with(0);
    }
    TEST_ASSERT_EQUAL_UINT32(0, list(&pixels));
}

static void test_slicing_makes_no_difference(void)
{
    enum { N_EVENTS = 30000 };
    static struct shef_event events[N_EVENTS];
    struct shef_test_random random = shef_test_random_start();
    struct shef_hot_pixel whole[SHEF_HOT_PIXELS_MAX];
    const struct shef_hot_pixel *pixels;
    uint32_t n_whole = 0;

    for (int i = 0; i < N_EVENTS; i++) {
        const bool is_hot = shef_test_random_range(&random, 0, 2) == 0;
        const int32_t x = shef_test_random_range(&random, 0, is_hot ? 4 : WIDTH_PX - 1);

        events[i] = shef_event_make(
            0, (uint32_t)x, is_hot ? 2 : (uint32_t)shef_test_random_range(&random, 0, 9), true);
    }
    for (int round = 0; round < 2; round++) {
        start();
        for (int window = 0; window < 3; window++) {
            for (uint32_t at = 0; at < N_EVENTS / 3;) {
                const uint32_t left = N_EVENTS / 3 - at;
                const uint32_t n =
                    round == 0 ? left : (uint32_t)shef_test_random_range(&random, 1, 30);

                shef_hot_pixels_count(hot, events + window * N_EVENTS / 3 + at,
                                      n < left ? n : left);
                at += n < left ? n : left;
            }
            now_us += 100000;
            shef_hot_pixels_learn(hot, shef_test_us(now_us));
        }
        const uint32_t n = list(&pixels);

        if (round == 0) {
            n_whole = n;
            memcpy(whole, pixels, n * sizeof *whole);
        } else {
            TEST_ASSERT_EQUAL_UINT32(n_whole, n);
            TEST_ASSERT_EQUAL_MEMORY(whole, pixels, n * sizeof *whole);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(5, n_whole);
}

static void expect_refused(struct shef_hot_pixels_params params, const char *reason)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_hot_pixels_create(&hot, &params, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_sentence(void)
{
    struct shef_hot_pixels_params params = shef_hot_pixels_default_params(3000, 10);

    expect_refused(params, "sides must be");
    params = shef_hot_pixels_default_params(20, 10);
    params.limit_per_s = NAN;
    expect_refused(params, "the limit must be");
    params = shef_hot_pixels_default_params(20, 10);
    params.n_windows = 16;
    expect_refused(params, "1 to 15 windows");
    params = shef_hot_pixels_default_params(20, 10);
    params.window_ms = 2;
    expect_refused(params, "take longer windows");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_pixel_is_hot_after_three_windows_above_the_limit);
    RUN_TEST(test_a_busy_moment_is_not_enough);
    RUN_TEST(test_a_pixel_that_cools_down_is_let_go);
    RUN_TEST(test_given_pixels_stay_and_others_beside_them_come_and_go);
    RUN_TEST(test_events_outside_the_sensor_are_passed_over);
    RUN_TEST(test_slicing_makes_no_difference);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_sentence);
    return UNITY_END();
}
