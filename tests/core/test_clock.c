#include "core/clock.h"

#include <pthread.h>

#include "support/support.h"

static void test_instants_add_subtract_and_compare(void)
{
    const shef_event_time start = { 5 };
    const shef_event_time later = shef_event_time_add(start, 2 * SHEF_NS_PER_MS);

    TEST_ASSERT_EQUAL_INT64(2000005, later.ns);
    TEST_ASSERT_EQUAL_INT64(2000000, shef_event_time_since(later, start));
    TEST_ASSERT_EQUAL_INT64(-2000000, shef_event_time_since(start, later));
    TEST_ASSERT_TRUE(shef_event_time_before(start, later));
    TEST_ASSERT_FALSE(shef_event_time_before(later, start));
    TEST_ASSERT_FALSE(shef_event_time_before(start, start));
}

static void test_the_units_fit_together(void)
{
    TEST_ASSERT_EQUAL_INT64(SHEF_NS_PER_S, 1000 * SHEF_NS_PER_MS);
    TEST_ASSERT_EQUAL_INT64(SHEF_NS_PER_MS, 1000 * SHEF_NS_PER_US);
}

static void test_the_real_clock_never_goes_back(void)
{
    const struct shef_clock *clock = shef_clock_monotonic();
    shef_host_time last = shef_clock_now(clock);

    TEST_ASSERT_GREATER_THAN_INT64(0, last.ns);
    for (int i = 0; i < 1000; i++) {
        const shef_host_time now = shef_clock_now(clock);

        TEST_ASSERT_FALSE(shef_host_time_before(now, last));
        last = now;
    }
}

static void test_a_manual_clock_moves_only_when_told_to(void)
{
    struct shef_manual_clock manual;

    shef_manual_clock_init(&manual, (shef_host_time){ 100 });
    TEST_ASSERT_EQUAL_INT64(100, shef_clock_now(&manual.clock).ns);
    TEST_ASSERT_EQUAL_INT64(100, shef_clock_now(&manual.clock).ns);
    shef_manual_clock_advance(&manual, 23);
    TEST_ASSERT_EQUAL_INT64(123, shef_clock_now(&manual.clock).ns);
    shef_manual_clock_advance(&manual, 0);
    TEST_ASSERT_EQUAL_INT64(123, shef_clock_now(&manual.clock).ns);
}

struct handover {
    struct shef_manual_clock manual;
    int prepared; /* plain memory: the thread sanitizer sees it if the clock does not order it */
};

static void *prepare_then_advance(void *argument)
{
    struct handover *handover = argument;

    handover->prepared = 42;
    shef_manual_clock_advance(&handover->manual, 1);
    return NULL;
}

static void test_who_sees_the_new_time_sees_what_was_prepared_before_it(void)
{
    struct handover handover = { .prepared = 0 };
    pthread_t thread;

    shef_manual_clock_init(&handover.manual, (shef_host_time){ 0 });
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, prepare_then_advance, &handover));
    while (shef_clock_now(&handover.manual.clock).ns == 0)
        sched_yield();
    TEST_ASSERT_EQUAL_INT(42, handover.prepared);
    pthread_join(thread, NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_instants_add_subtract_and_compare);
    RUN_TEST(test_the_units_fit_together);
    RUN_TEST(test_the_real_clock_never_goes_back);
    RUN_TEST(test_a_manual_clock_moves_only_when_told_to);
    RUN_TEST(test_who_sees_the_new_time_sees_what_was_prepared_before_it);
    return UNITY_END();
}
