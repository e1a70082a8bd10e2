#include "pipeline/kernels/decay.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/cpu.h"
#include "kernel_check.h"

#define MAX_CELLS 700

static struct shef_decay_cell cells[MAX_CELLS];

static void fill_cells(struct shef_test_random *random, uint32_t now_us)
{
    static const int32_t extremes[] = { 0, 1, -1, INT32_MAX, -INT32_MAX, 1 << 25, -(1 << 25) };

    for (int i = 0; i < MAX_CELLS; i++) {
        const int32_t bits = shef_test_random_range(random, 0, 31);
        const int32_t level = (int32_t)shef_test_random_u64(random) >> bits;
        const uint32_t age_us =
            (uint32_t)shef_test_random_u64(random) >> shef_test_random_range(random, 8, 31);

        cells[i].level = i < 7 ? extremes[i] : level == INT32_MIN ? 0 : level;
        /* Some are newer than the instant, some far older than the horizon. */
        cells[i].t_us =
            shef_test_random_range(random, 0, 9) == 0 ? now_us + age_us : now_us - age_us;
    }
}

static const struct shef_decay *decay_at(uint32_t now_us, double cutoff_rad_s)
{
    static struct shef_decay decay;

    decay = (struct shef_decay){
        .at_us = now_us,
        .horizon_us = (int32_t)fmin(1 << 22, 64 * M_LN2 / (cutoff_rad_s * 1e-6)),
        .halvings_per_us = (float)(cutoff_rad_s * 1e-6 / M_LN2),
    };
    return &decay;
}

static void test_every_read_out_equals_the_reference(void)
{
    struct shef_test_random random = shef_test_random_start();
    int n_nonzero = 0;

    for (int round = 0; round < 200; round++) {
        static const double cutoffs[] = { 8, 120, 120, 2000 };
        const uint32_t now_us = (uint32_t)shef_test_random_u64(&random);
        const struct shef_decay *decay = decay_at(now_us, cutoffs[round % 4]);
        const int32_t n = shef_test_random_range(&random, 1, MAX_CELLS);
        int16_t expected[MAX_CELLS];

        fill_cells(&random, now_us);
        shef_decay_kernels_c.row(expected, cells, n, decay);
        for (int32_t i = 0; i < n; i++)
            n_nonzero += expected[i] != 0;
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_CELLS + 1];

            actual[n] = 12345;
            shef_decay_pick(features[k])->row(actual, cells, n, decay);
            TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n);
            TEST_ASSERT_EQUAL_INT16(12345, actual[n]);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(10000, n_nonzero);
}

static void test_the_reference_is_the_exponential_to_the_last_place(void)
{
    struct shef_test_random random = shef_test_random_start();
    const struct shef_decay *decay = decay_at(5000000, 120);
    double worst = 0;

    for (int round = 0; round < 100; round++) {
        int16_t values[MAX_CELLS];

        fill_cells(&random, 5000000);
        shef_decay_kernels_c.row(values, cells, MAX_CELLS, decay);
        for (int i = 0; i < MAX_CELLS; i++) {
            const int32_t age_us = (int32_t)(5000000 - cells[i].t_us);
            const double exact = cells[i].level / 1024.0 * exp(-120e-6 * (age_us > 0 ? age_us : 0));

            if (fabs(exact) <= SHEF_DECAY_MAX_VALUE)
                worst = fmax(worst, fabs(values[i] - exact));
            else
                TEST_ASSERT_INT_WITHIN(1, exact > 0 ? 32767 : -32767, values[i]);
        }
    }
    printf("worst difference %.3f of the last place\n", worst);
    TEST_ASSERT_TRUE(worst < 0.62);
}

static void test_every_accrual_equals_the_reference(void)
{
    struct shef_test_random random = shef_test_random_start();
    for (int round = 0; round < 100; round++) {
        const int32_t n = shef_test_random_range(&random, 1, MAX_CELLS);
        const int16_t weight = (int16_t)shef_test_random_range(&random, 0, 32767);
        int16_t start[3][MAX_CELLS];
        int16_t expected[2][MAX_CELLS];

        for (int i = 0; i < 3 * MAX_CELLS; i++)
            start[i / MAX_CELLS][i % MAX_CELLS] =
                (int16_t)((int16_t)shef_test_random_u64(&random) >>
                          (round % 3 == 0 ? 0 : shef_test_random_range(&random, 0, 8)));
        memcpy(expected, start, sizeof expected);
        shef_decay_kernels_c.accrue(expected[0], expected[1], start[2], n, weight);
        TEST_ASSERT_EQUAL_INT16_ARRAY(start[2], expected[1], n);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[2][MAX_CELLS];

            memcpy(actual, start, sizeof actual);
            shef_decay_pick(features[k])->accrue(actual[0], actual[1], start[2], n, weight);
            TEST_ASSERT_EQUAL_INT16_ARRAY(expected[0], actual[0], MAX_CELLS);
            TEST_ASSERT_EQUAL_INT16_ARRAY(expected[1], actual[1], MAX_CELLS);
        }
    }
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]), shef_decay_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_read_out_equals_the_reference);
    RUN_TEST(test_the_reference_is_the_exponential_to_the_last_place);
    RUN_TEST(test_every_accrual_equals_the_reference);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
