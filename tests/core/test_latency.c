#include "core/latency.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "core/time.h"
#include "support/support.h"

static struct shef_latency latency;
static struct shef_latency_counts counts;

void setUp(void)
{
    memset(&latency, 0, sizeof latency);
}

static int64_t percentile(double share)
{
    shef_latency_read(&latency, &counts);
    return shef_latency_percentile_ns(&counts, share);
}

static void test_an_empty_histogram_says_nothing_took_time(void)
{
    TEST_ASSERT_EQUAL_INT64(0, percentile(0.5));
    TEST_ASSERT_EQUAL_INT64(0, shef_latency_mean_ns(&counts));
    TEST_ASSERT_EQUAL_INT64(0, counts.max_ns);
    TEST_ASSERT_EQUAL_UINT64(0, counts.n_all);
}

static void test_one_entry_is_every_percentile_exactly(void)
{
    shef_latency_add(&latency, 7123456);
    TEST_ASSERT_EQUAL_INT64(7123456, percentile(0.0));
    TEST_ASSERT_EQUAL_INT64(7123456, percentile(0.5));
    TEST_ASSERT_EQUAL_INT64(7123456, percentile(1.0));
    TEST_ASSERT_EQUAL_INT64(7123456, shef_latency_mean_ns(&counts));
}

static int compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

static void test_percentiles_are_never_too_low_and_at_most_a_sixteenth_too_high(void)
{
    struct shef_test_random random = shef_test_random_start();
    static int64_t durations[5000];
    const int n = sizeof durations / sizeof durations[0];

    for (int i = 0; i < n; i++) {
        const int shift = shef_test_random_range(&random, 0, 22);

        durations[i] = shef_test_random_range(&random, 1000, 2000) * (INT64_C(1) << shift);
        shef_latency_add(&latency, durations[i]);
    }
    qsort(durations, (size_t)n, sizeof durations[0], compare);
    for (int i = 1; i <= 1000; i++) {
        const double share = i / 1000.0;
        const int64_t exact = durations[i * n / 1000 - 1];
        const int64_t found = percentile(share);

        TEST_ASSERT_GREATER_OR_EQUAL_INT64(exact, found);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(exact + exact / 16 + 1024, found);
    }
    TEST_ASSERT_EQUAL_INT64(durations[n - 1], percentile(1.0));
}

static void test_absurd_durations_stay_inside(void)
{
    shef_latency_add(&latency, -5);
    TEST_ASSERT_EQUAL_INT64(0, percentile(1.0));
    shef_latency_add(&latency, INT64_MAX / 2);
    TEST_ASSERT_EQUAL_INT64(INT64_MAX / 2, percentile(1.0));
    TEST_ASSERT_EQUAL_UINT64(2, counts.n_all);
}

static void test_two_copies_subtracted_show_only_what_came_between(void)
{
    struct shef_latency_counts before, window;

    for (int i = 0; i < 100; i++)
        shef_latency_add(&latency, SHEF_NS_PER_S);
    shef_latency_read(&latency, &before);
    for (int i = 0; i < 10; i++)
        shef_latency_add(&latency, SHEF_NS_PER_MS);
    shef_latency_read(&latency, &counts);
    shef_latency_window(&counts, &before, &window);
    TEST_ASSERT_EQUAL_UINT64(10, window.n_all);
    TEST_ASSERT_INT64_WITHIN(70000, SHEF_NS_PER_MS, shef_latency_percentile_ns(&window, 0.99));
    TEST_ASSERT_EQUAL_INT64(SHEF_NS_PER_MS, shef_latency_mean_ns(&window));
    TEST_ASSERT_EQUAL_INT64(SHEF_NS_PER_S, window.max_ns);
}

#define N_ADDED 200000

static void *add_many(void *argument)
{
    (void)argument;
    for (int i = 0; i < N_ADDED; i++)
        shef_latency_add(&latency, SHEF_NS_PER_MS);
    return NULL;
}

static void test_a_reader_meanwhile_sees_growing_counts_and_finally_all(void)
{
    pthread_t thread;
    uint64_t last = 0;

    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, add_many, NULL));
    for (int i = 0; i < 100; i++) {
        shef_latency_read(&latency, &counts);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(last, counts.n_all);
        last = counts.n_all;
    }
    pthread_join(thread, NULL);
    shef_latency_read(&latency, &counts);
    TEST_ASSERT_EQUAL_UINT64(N_ADDED, counts.n_all);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_histogram_says_nothing_took_time);
    RUN_TEST(test_one_entry_is_every_percentile_exactly);
    RUN_TEST(test_percentiles_are_never_too_low_and_at_most_a_sixteenth_too_high);
    RUN_TEST(test_absurd_durations_stay_inside);
    RUN_TEST(test_two_copies_subtracted_show_only_what_came_between);
    RUN_TEST(test_a_reader_meanwhile_sees_growing_counts_and_finally_all);
    return UNITY_END();
}
