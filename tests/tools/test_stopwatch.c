/* Summaries of timings, and when a progress bar may be seen. */
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

#include "sheftool/progress.h"
#include "sheftool/stopwatch.h"
#include "support/support.h"

static struct shef_timings timings;

void tearDown(void)
{
    shef_timings_free(&timings);
}

static void add_ms(int64_t ms)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_timings_add(&timings, ms * 1000000));
}

static void test_no_readings_are_all_zero(void)
{
    const struct shef_timing_summary summary = shef_timings_summary(&timings);

    TEST_ASSERT_EQUAL_DOUBLE(0, summary.median_ms);
    TEST_ASSERT_EQUAL_DOUBLE(0, summary.min_ms);
}

static void test_one_reading_is_everything(void)
{
    add_ms(7);
    const struct shef_timing_summary summary = shef_timings_summary(&timings);

    TEST_ASSERT_EQUAL_DOUBLE(7, summary.median_ms);
    TEST_ASSERT_EQUAL_DOUBLE(7, summary.p95_ms);
    TEST_ASSERT_EQUAL_DOUBLE(7, summary.min_ms);
}

static void test_hundred_readings_in_any_order(void)
{
    for (int64_t i = 0; i < 100; i++)
        add_ms((i * 37) % 100 + 1); /* 1..100, shuffled: 37 and 100 have no common factor */
    const struct shef_timing_summary summary = shef_timings_summary(&timings);

    TEST_ASSERT_EQUAL_DOUBLE(50.5, summary.median_ms);
    TEST_ASSERT_EQUAL_DOUBLE(95, summary.p95_ms);
    TEST_ASSERT_EQUAL_DOUBLE(1, summary.min_ms);
}

static void test_p95_of_few_readings_is_the_largest(void)
{
    for (int64_t i = 1; i <= 3; i++)
        add_ms(i);
    TEST_ASSERT_EQUAL_DOUBLE(3, shef_timings_summary(&timings).p95_ms);
    TEST_ASSERT_EQUAL_DOUBLE(2, shef_timings_summary(&timings).median_ms);
}

/* What a bar of 100 steps writes after one step that took spent_ms. */
static size_t written_after(bool terminal, int64_t spent_ms)
{
    struct shef_progress progress;
    const int captured = memfd_create("stderr", 0);
    const int saved = dup(STDERR_FILENO);

    dup2(captured, STDERR_FILENO);
    shef_progress_begin(&progress, "working", 100);
    progress.terminal = terminal;
    progress.start_ns -= spent_ms * 1000000;
    shef_progress_step(&progress, 1);
    shef_progress_end(&progress);
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);

    const off_t n_bytes = lseek(captured, 0, SEEK_END);

    close(captured);
    return (size_t)n_bytes;
}

static void test_bar_is_seen_only_on_a_terminal_and_only_for_work_over_a_second(void)
{
    TEST_ASSERT_GREATER_THAN_size_t(0, written_after(true, 300)); /* of 30 s */
    TEST_ASSERT_EQUAL_size_t(0, written_after(false, 300));
    TEST_ASSERT_EQUAL_size_t(0, written_after(true, 5)); /* of half a second */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_readings_are_all_zero);
    RUN_TEST(test_one_reading_is_everything);
    RUN_TEST(test_hundred_readings_in_any_order);
    RUN_TEST(test_p95_of_few_readings_is_the_largest);
    RUN_TEST(test_bar_is_seen_only_on_a_terminal_and_only_for_work_over_a_second);
    return UNITY_END();
}
