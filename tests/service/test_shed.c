#include "service/shed.h"

#include "core/time.h"
#include "publish/result.h"
#include "support/support.h"

static const int32_t after_ms[SHEF_SHED_LEVELS] = { 8, 10, 12, 16, 30 };

static struct shef_shed_decision next(struct shef_shed *shed, int32_t wait_ms)
{
    return shef_shed_next(shed, wait_ms * SHEF_NS_PER_MS, after_ms);
}

static void test_nothing_is_left_out_while_frames_hardly_wait(void)
{
    struct shef_shed shed = { 0 };

    for (int32_t wait_ms = 0; wait_ms <= 8; wait_ms++) {
        const struct shef_shed_decision decision = next(&shed, wait_ms);

        TEST_ASSERT_EQUAL_HEX32(0, decision.bits);
        TEST_ASSERT_FALSE(decision.drops_frame);
    }
}

static void test_work_goes_in_its_order_and_at_once(void)
{
    struct shef_shed shed = { 0 };

    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE, next(&shed, 9).bits);
    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE | SHEF_RESULT_SHED_CLOUD, next(&shed, 11).bits);
    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE | SHEF_RESULT_SHED_CLOUD |
                                SHEF_RESULT_SHED_FULL_GRID,
                            next(&shed, 13).bits);
    shed = (struct shef_shed){ 0 };
    TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE | SHEF_RESULT_SHED_CLOUD |
                                SHEF_RESULT_SHED_FULL_GRID | SHEF_RESULT_SHED_RANGE,
                            next(&shed, 17).bits);
}

static void test_a_frame_is_dropped_for_its_own_waiting_only(void)
{
    struct shef_shed shed = { 0 };

    TEST_ASSERT_TRUE(next(&shed, 31).drops_frame);
    TEST_ASSERT_FALSE(next(&shed, 30).drops_frame);
    TEST_ASSERT_FALSE(next(&shed, 0).drops_frame);
}

static void test_work_comes_back_slowly_one_kind_after_the_other(void)
{
    struct shef_shed shed = { 0 };

    (void)next(&shed, 17);
    for (int32_t level = 4; level > 0; level--) {
        for (int i = 1; i < SHEF_SHED_CALM_FRAMES; i++) {
            (void)next(&shed, 1);
            TEST_ASSERT_EQUAL_INT32(level, shed.n_levels);
        }
        (void)next(&shed, 1);
        TEST_ASSERT_EQUAL_INT32(level - 1, shed.n_levels);
    }
    TEST_ASSERT_EQUAL_HEX32(0, next(&shed, 1).bits);
}

static void test_just_below_a_threshold_nothing_comes_back(void)
{
    struct shef_shed shed = { 0 };

    (void)next(&shed, 9);
    for (int i = 0; i < 10 * SHEF_SHED_CALM_FRAMES; i++)
        TEST_ASSERT_EQUAL_HEX32(SHEF_RESULT_SHED_DENSE, next(&shed, 7).bits);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_left_out_while_frames_hardly_wait);
    RUN_TEST(test_work_goes_in_its_order_and_at_once);
    RUN_TEST(test_a_frame_is_dropped_for_its_own_waiting_only);
    RUN_TEST(test_work_comes_back_slowly_one_kind_after_the_other);
    RUN_TEST(test_just_below_a_threshold_nothing_comes_back);
    return UNITY_END();
}
