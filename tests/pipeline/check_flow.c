#include "pipeline/kernels/flow.h"

#include <string.h>

#include "core/cpu.h"
#include "kernel_check.h"

#define MAX_VALUES 300
#define STRIDE     71

static void fill(int16_t *values, int32_t n, int32_t limit, bool is_extreme)
{
    for (int32_t i = 0; i < n; i++)
        values[i] = (int16_t)(is_extreme ? limit * (any(0, 1) * 2 - 1) : any(-limit, limit));
}

static void test_halved_and_shrunk_rows_equal_the_reference(void)
{
    for (int round = 0; round < 200; round++) {
        const int32_t n = any(0, MAX_VALUES);
        int8_t values[2][2 * MAX_VALUES];
        int16_t slopes[MAX_VALUES];
        int16_t halved[MAX_VALUES];
        int16_t shrunk[MAX_VALUES];

        for (int32_t i = 0; i < 2 * MAX_VALUES; i++)
            for (int row = 0; row < 2; row++)
                values[row][i] = (int8_t)(any(0, 2) ? any(-127, 127) : 127 * (any(0, 1) * 2 - 1));
        fill(slopes, n, 30908, round % 2);
        shef_flow_kernels_c.halve(halved, values[0], values[1], n);
        shef_flow_kernels_c.shrink(shrunk, slopes, n);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_VALUES + 1];

            actual[n] = 7777;
            shef_flow_pick(features[k])->halve(actual, values[0], values[1], n);
            for (int32_t i = 0; i < n; i++)
                TEST_ASSERT_EQUAL_INT16(halved[i], actual[i]);
            TEST_ASSERT_EQUAL_INT16(7777, actual[n]);
            memcpy(actual, slopes, (size_t)n * sizeof slopes[0]);
            shef_flow_pick(features[k])->shrink(actual, actual, n);
            for (int32_t i = 0; i < n; i++)
                TEST_ASSERT_EQUAL_INT16(shrunk[i], actual[i]);
            TEST_ASSERT_EQUAL_INT16(7777, actual[n]);
        }
    }
}

static void test_sums_over_a_block_equal_the_reference_up_to_the_largest(void)
{
    static int16_t events[STRIDE * SHEF_FLOW_BLOCK_PX];
    static int16_t gx[STRIDE * SHEF_FLOW_BLOCK_PX];
    static int16_t gy[STRIDE * SHEF_FLOW_BLOCK_PX];
    const int32_t n = STRIDE * SHEF_FLOW_BLOCK_PX;

    for (int round = 0; round < 100; round++) {
        fill(events, n, SHEF_FLOW_VALUE_MAX, round % 2);
        fill(gx, n, SHEF_FLOW_SLOPE_MAX, round % 2);
        fill(gy, n, SHEF_FLOW_SLOPE_MAX, round % 2);
        if (round == 0)
            for (int32_t i = 0; i < n; i++)
                gx[i] = gy[i] = SHEF_FLOW_SLOPE_MAX;

        const struct shef_flow_sums expected =
            shef_flow_kernels_c.correlate(events + 3, gx + 3, gy + 3, STRIDE);
        const struct shef_flow_slope_sums measured =
            shef_flow_kernels_c.measure(gx + 3, gy + 3, STRIDE);

        TEST_ASSERT_GREATER_THAN_INT32(0, measured.xx);
        for (int k = 0; k < n_features; k++) {
            const struct shef_flow_sums actual =
                shef_flow_pick(features[k])->correlate(events + 3, gx + 3, gy + 3, STRIDE);
            const struct shef_flow_slope_sums again =
                shef_flow_pick(features[k])->measure(gx + 3, gy + 3, STRIDE);

            TEST_ASSERT_EQUAL_MEMORY(&expected, &actual, sizeof actual);
            TEST_ASSERT_EQUAL_MEMORY(&measured, &again, sizeof again);
        }
    }
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]), shef_flow_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_halved_and_shrunk_rows_equal_the_reference);
    RUN_TEST(test_sums_over_a_block_equal_the_reference_up_to_the_largest);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
