/* Random numbers of the simulator: what they promise, measured; and that they never change. */
#include <math.h>

#include "shefsim/random.h"
#include "support/support.h"

enum { N = 200000 };

/* Mean, deviation and the number correlated with its neighbour. */
struct moments {
    double mean;
    double deviation;
    double neighbour;
    double largest;
};

static struct moments measure(double (*draw)(uint64_t key, uint64_t index), uint64_t key)
{
    struct moments m = { 0 };
    double last = draw(key, N);

    for (uint64_t i = 0; i < N; i++) {
        const double x = draw(key, i);

        m.mean += x / N;
        m.deviation += x * x / N;
        m.neighbour += x * last / N;
        m.largest = fmax(m.largest, fabs(x));
        last = x;
    }
    m.deviation = sqrt(m.deviation - m.mean * m.mean);
    return m;
}

static double draw_bell(uint64_t key, uint64_t index)
{
    return sim_bell(sim_random(key, index));
}

static double draw_unit(uint64_t key, uint64_t index)
{
    return sim_unit(sim_random(key, index)) - 0.5;
}

static void expect_moments(struct moments m, double deviation, double largest)
{
    /* Five deviations of the estimates. */
    const double tolerance = 5 * deviation / sqrt(N);

    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0, m.mean);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, deviation, m.deviation);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0, m.neighbour);
    TEST_ASSERT_TRUE(m.largest <= largest);
}

static void test_normal_numbers_have_mean_0_and_deviation_1(void)
{
    expect_moments(measure(sim_normal, sim_key(1, SIM_STREAM_JITTER, 2)), 1, 6);
    expect_moments(measure(draw_bell, sim_key(1, SIM_STREAM_JITTER, 3)), 1, 3.47);
}

static void test_even_numbers_fill_their_range_evenly(void)
{
    expect_moments(measure(draw_unit, sim_key(9, SIM_STREAM_LEAK, 0)), sqrt(1 / 12.0), 0.5);
}

static void expect_poisson(double mean)
{
    const uint64_t key = sim_key(4, SIM_STREAM_BACKGROUND, 7);
    double sum = 0;
    double squares = 0;

    for (uint64_t i = 0; i < N; i++) {
        const double n = (double)sim_poisson(key, i, mean);

        sum += n / N;
        squares += n * n / N;
    }
    TEST_ASSERT_DOUBLE_WITHIN(5 * sqrt(mean / N) + 1e-9, mean, sum);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * mean + 1e-9, mean, squares - sum * sum);
}

static void test_counts_have_the_mean_and_the_variance_of_poisson(void)
{
    expect_poisson(0);
    expect_poisson(0.3);
    expect_poisson(4);
    expect_poisson(16);
    expect_poisson(1000);
}

static void test_the_exponential_agrees_with_the_library(void)
{
    for (double x = -50; x < 50; x += 0.37)
        TEST_ASSERT_DOUBLE_WITHIN(1e-13 * exp(x), exp(x), sim_exp(x));
    TEST_ASSERT_EQUAL_DOUBLE(1, sim_exp(0));
}

static void test_seed_stream_step_and_index_each_change_the_number(void)
{
    const uint64_t key = sim_key(1, SIM_STREAM_JITTER, 1);
    const uint64_t number = sim_random(key, 1);

    TEST_ASSERT_NOT_EQUAL_UINT64(number, sim_random(sim_key(2, SIM_STREAM_JITTER, 1), 1));
    TEST_ASSERT_NOT_EQUAL_UINT64(number, sim_random(sim_key(1, SIM_STREAM_LEAK, 1), 1));
    TEST_ASSERT_NOT_EQUAL_UINT64(number, sim_random(sim_key(1, SIM_STREAM_JITTER, 2), 1));
    TEST_ASSERT_NOT_EQUAL_UINT64(number, sim_random(key, 2));
}

/* Recordings made from a seed are compared between machines and versions: a change here is a
 * change of all of them. */
static void test_numbers_are_the_same_for_ever(void)
{
    const uint64_t key = sim_key(42, SIM_STREAM_FRAME_NOISE, 7);

    TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x63fb1b7e35d06dab), key);
    TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x3c8638ad8baf14d2), sim_random(key, 3));
    TEST_ASSERT_EQUAL_HEX32(0x912efcf7u, sim_mix32(12345));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_normal_numbers_have_mean_0_and_deviation_1);
    RUN_TEST(test_even_numbers_fill_their_range_evenly);
    RUN_TEST(test_counts_have_the_mean_and_the_variance_of_poisson);
    RUN_TEST(test_the_exponential_agrees_with_the_library);
    RUN_TEST(test_seed_stream_step_and_index_each_change_the_number);
    RUN_TEST(test_numbers_are_the_same_for_ever);
    return UNITY_END();
}
