/* The way out of the event sensor: rate limit, row bursts, loss. */
#include <string.h>

#include "shefsim/event_readout.h"
#include "support/support.h"

enum { HEIGHT = 32, MAX_EVENTS = 4096 };

static struct sim_event_readout readout;
static struct shef_event in[MAX_EVENTS];
static size_t n_in;
static struct shef_event served[MAX_EVENTS];
static struct sim_readout_out out;

static void begin(int64_t row_ns, int64_t event_ns, uint32_t capacity)
{
    const struct sim_event_readout_params params = { true, row_ns, event_ns, capacity };
    struct shef_error err;

    sim_event_readout_deinit(&readout);
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_event_readout_init(&readout, &params, HEIGHT, &err));
    n_in = 0;
    out = (struct sim_readout_out){ .events = served, .base_us = 1000 };
}

void tearDown(void)
{
    sim_event_readout_deinit(&readout);
}

static void add(uint32_t t_us, uint32_t x_px, uint32_t y_px)
{
    in[n_in++] = shef_event_make(t_us, x_px, y_px, x_px % 2 == 0);
}

static void run(int64_t until_us)
{
    sim_event_readout_run(&readout, in, n_in, 1000, until_us, &out);
    n_in = 0;
}

static void test_with_little_to_do_events_leave_at_once_and_as_they_came(void)
{
    begin(100, 20, 1000);
    for (uint32_t i = 0; i < 500; i++)
        add(3 * i, i % 64, (7 * i) % HEIGHT);

    struct shef_event expected[500];

    memcpy(expected, in, sizeof expected);
    run(1000 + 3 * 500);
    TEST_ASSERT_EQUAL_size_t(500, out.n);
    TEST_ASSERT_EQUAL_MEMORY(expected, served, sizeof expected);
    TEST_ASSERT_EQUAL_UINT64(0, readout.n_bursts);
    TEST_ASSERT_EQUAL_UINT64(0, readout.n_lost);
}

static void test_a_row_leaves_together_with_one_time(void)
{
    begin(1000, 100, 1000);
    /* Ten rows in turn, ten events each, all within a microsecond. */
    for (uint32_t i = 0; i < 100; i++)
        add(0, i, i % 10);
    run(1000 + 1000);
    TEST_ASSERT_EQUAL_size_t(100, out.n);
    TEST_ASSERT_EQUAL_UINT64(10, readout.n_bursts);
    for (uint32_t i = 0; i < 100; i++) {
        /* Row k waits for those before: 2 us each. */
        TEST_ASSERT_EQUAL_UINT32(2 * (i / 10), served[i].t_us);
        TEST_ASSERT_EQUAL_UINT16(i / 10, shef_event_y_px(served[i]));
        TEST_ASSERT_EQUAL_UINT16(i % 10 * 10 + i / 10, served[i].x_px);
    }
}

static void test_no_more_leave_than_the_rate_allows(void)
{
    uint32_t n_in_window = 0;
    size_t first = 0;

    begin(0, 1000, 4000);
    for (uint32_t i = 0; i < 3000; i++)
        add(i / 10, i % 64, i % HEIGHT);
    run(1000 + 4000);
    TEST_ASSERT_EQUAL_size_t(3000, out.n);
    for (size_t i = 0; i < out.n; i++) {
        n_in_window++;
        while (served[i].t_us - served[first].t_us > 500) {
            first++;
            n_in_window--;
        }
        /* 1 event a microsecond, and the last row as a burst. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(501 + 3000 / HEIGHT, n_in_window);
    }
    TEST_ASSERT_UINT32_WITHIN(3000 / HEIGHT, 3000, served[out.n - 1].t_us);
}

static void test_what_finds_no_room_is_lost_and_counted(void)
{
    begin(0, 1000, 100);
    for (uint32_t i = 0; i < 1000; i++)
        add(0, i % 64, i % HEIGHT);
    run(1000 + 100000);
    TEST_ASSERT_EQUAL_size_t(100, out.n);
    TEST_ASSERT_EQUAL_UINT64(900, readout.n_lost);
    /* Room is made again. */
    add(200000, 1, 1);
    run(1000 + 200001);
    TEST_ASSERT_EQUAL_size_t(101, out.n);
    TEST_ASSERT_EQUAL_UINT64(900, readout.n_lost);
}

static void test_what_waits_leaves_in_a_later_call_and_not_earlier_than_promised(void)
{
    begin(0, 10000, 1000);
    for (uint32_t i = 0; i < 100; i++)
        add(0, i, i % HEIGHT);
    run(1000 + 50);

    const size_t n_early = out.n;

    TEST_ASSERT_TRUE(n_early > 0 && n_early < 100);
    TEST_ASSERT_TRUE(served[n_early - 1].t_us < 50);
    run(1000 + 5000);
    TEST_ASSERT_EQUAL_size_t(100, out.n);
    TEST_ASSERT_TRUE(served[n_early].t_us >= 50);
}

static void test_random_loads_lose_nothing_but_what_is_counted(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int32_t round = 0; round < 200; round++) {
        const uint32_t n = (uint32_t)shef_test_random_range(&random, 1, MAX_EVENTS);
        uint32_t t_us = 0;
        int32_t balance[64][HEIGHT] = { { 0 } };
        int64_t missing = 0;

        begin(shef_test_random_range(&random, 0, 300), shef_test_random_range(&random, 1, 300),
              (uint32_t)shef_test_random_range(&random, 1, 2000));
        for (uint32_t i = 0; i < n; i++) {
            t_us += (uint32_t)(shef_test_random_range(&random, 0, 9) == 0);
            add(t_us, (uint32_t)shef_test_random_range(&random, 0, 63),
                (uint32_t)shef_test_random_range(&random, 0, HEIGHT - 1));
            balance[in[i].x_px][shef_event_y_px(in[i])]++;
        }
        run(1000 + 100000);
        TEST_ASSERT_EQUAL_UINT64(n, out.n + readout.n_lost);
        for (size_t i = 0; i < out.n; i++) {
            TEST_ASSERT_TRUE(i == 0 || served[i].t_us >= served[i - 1].t_us);
            balance[served[i].x_px][shef_event_y_px(served[i])]--;
        }
        for (int32_t x = 0; x < 64; x++)
            for (int32_t y = 0; y < HEIGHT; y++) {
                TEST_ASSERT_TRUE(balance[x][y] >= 0);
                missing += balance[x][y];
            }
        TEST_ASSERT_EQUAL_INT64((int64_t)readout.n_lost, missing);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_with_little_to_do_events_leave_at_once_and_as_they_came);
    RUN_TEST(test_a_row_leaves_together_with_one_time);
    RUN_TEST(test_no_more_leave_than_the_rate_allows);
    RUN_TEST(test_what_finds_no_room_is_lost_and_counted);
    RUN_TEST(test_what_waits_leaves_in_a_later_call_and_not_earlier_than_promised);
    RUN_TEST(test_random_loads_lose_nothing_but_what_is_counted);
    return UNITY_END();
}
