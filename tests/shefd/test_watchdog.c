#include "shefd/watchdog.h"

#include "support/support.h"

#define STALLED_AFTER_NS (5 * SHEF_NS_PER_S)

static struct shef_watchdog watchdog;

void setUp(void)
{
    shef_watchdog_init(&watchdog, STALLED_AFTER_NS, (shef_host_time){ 0 });
}

static bool look(uint64_t n_steps, bool is_expected, int64_t at_s)
{
    const struct shef_service_progress progress = { .n_steps = n_steps,
                                                    .is_expected = is_expected };

    return shef_watchdog_is_alive(&watchdog, progress, (shef_host_time){ at_s * SHEF_NS_PER_S });
}

static void test_steps_keep_it_alive(void)
{
    for (int64_t t = 1; t < 100; t++)
        TEST_ASSERT_TRUE(look((uint64_t)t, true, t));
}

static void test_without_steps_it_lives_until_the_limit(void)
{
    TEST_ASSERT_TRUE(look(7, true, 1));
    TEST_ASSERT_TRUE(look(7, true, 6));
    TEST_ASSERT_FALSE(look(7, true, 7));
    TEST_ASSERT_FALSE(look(7, true, 100));
}

static void test_the_first_step_revives_it(void)
{
    TEST_ASSERT_FALSE(look(0, true, 6));
    TEST_ASSERT_TRUE(look(1, true, 7));
}

static void test_an_idle_service_needs_no_steps_and_a_new_source_gets_its_time(void)
{
    TEST_ASSERT_TRUE(look(0, false, 1000));
    TEST_ASSERT_TRUE(look(0, true, 1004));
    TEST_ASSERT_TRUE(look(0, true, 1005));
    TEST_ASSERT_FALSE(look(0, true, 1006));
}

static void test_a_counter_that_starts_again_counts_as_a_step(void)
{
    TEST_ASSERT_TRUE(look(900, true, 1));
    TEST_ASSERT_TRUE(look(3, true, 7));
    TEST_ASSERT_TRUE(look(3, true, 12));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_steps_keep_it_alive);
    RUN_TEST(test_without_steps_it_lives_until_the_limit);
    RUN_TEST(test_the_first_step_revives_it);
    RUN_TEST(test_an_idle_service_needs_no_steps_and_a_new_source_gets_its_time);
    RUN_TEST(test_a_counter_that_starts_again_counts_as_a_step);
    return UNITY_END();
}
