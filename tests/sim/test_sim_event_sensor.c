/* The event sensor's pixels: what their events say about the light. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/workers.h"
#include "event_runs.h"
#include "shefsim/kernels/event_scan.h"
#include "support/support.h"

/* Runs the texture beside a model of one line per pixel: n = floor(change / threshold). */
static void expect_counts_of_the_plain_model(void)
{
    static float reference[N_PIXELS];
    static int32_t on[N_PIXELS], off[N_PIXELS];
    struct shef_image_f32 log;
    struct shef_error err;

    memset(on, 0, sizeof on);
    memset(off, 0, sizeof off);
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_f32(&log, WIDTH, HEIGHT, &err));
    for (int32_t i = 0; i <= 200; i++) {
        image_paint(i * STEP_US * 1e-6);
        sensor_show((int64_t)i * STEP_US);
        sim_event_sensor_log(sensor, log);
        for (int32_t k = 0; k < N_PIXELS; k++) {
            const float level = shef_row_f32(log, k / WIDTH)[k % WIDTH];
            const float change = i == 0 ? 0 : level - reference[k];
            const int32_t n = (int32_t)(fabsf(change) / 0.3f);

            if (i == 0)
                reference[k] = level;
            reference[k] += change > 0 ? 0.3f * (float)n : -0.3f * (float)n;
            *(change > 0 ? &on[k] : &off[k]) += n;
        }
    }
    sensor_end();
    shef_image_destroy_f32(&log);

    int64_t n_model = 0;
    int32_t n_differ = 0;

    for (size_t i = 0; i < seen.n; i++)
        (*(shef_event_is_on(seen.events[i]) ? &on[pixel_of(i)] : &off[pixel_of(i)]))--;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        n_differ += on[k] != 0 || off[k] != 0;
        n_model += on[k] + off[k];
    }
    TEST_ASSERT_GREATER_THAN_size_t(100000, seen.n);
    /* Counts differ only where a level lies within rounding of a threshold. */
    TEST_ASSERT_TRUE(llabs((long long)n_model) * 10000 <= (long long)seen.n);
    TEST_ASSERT_LESS_THAN_INT32(N_PIXELS / 1000, n_differ);
}

static void test_without_noise_counts_are_those_of_the_plain_model(void)
{
    sensor_make(1);
    expect_counts_of_the_plain_model();
}

/* At any event, the sum of a pixel's events times its threshold is the change of the logarithm
 * since the start, to within a threshold; at the event itself it is exact. */
static void test_events_follow_the_light(void)
{
    static int32_t sum[N_PIXELS];
    double worst = 0;

    memset(sum, 0, sizeof sum);
    sensor_make(1);
    run_texture(200);
    TEST_ASSERT_GREATER_THAN_size_t(100000, seen.n);
    for (size_t i = 0; i < seen.n; i++) {
        const size_t k = pixel_of(i);
        const int32_t x = (int32_t)(k % WIDTH);
        const int32_t y = (int32_t)(k / WIDTH);
        const double now = log(exp(light_log(x, y, (double)seen.t_us[i] * 1e-6)) + params.dark);
        const double first = log(exp(light_log(x, y, 0)) + params.dark);

        sum[k] += shef_event_is_on(seen.events[i]) ? 1 : -1;
        worst = fmax(worst, fabs(sum[k] * 0.3 - (now - first)));
    }
    /* Between images the light is no straight line: 200 rad/s * 2 ms bend it by 0.2 * 0.4^2 / 8,
     * the other waves by less; a microsecond is at most 0.0002. */
    TEST_ASSERT_TRUE(worst < 0.02);
}

static void test_mismatch_spreads_thresholds_as_asked(void)
{
    static int32_t n[N_PIXELS];
    double sum = 0, squares = 0;

    memset(n, 0, sizeof n);
    params.mismatch = 0.10;
    sensor_make(3);
    image_paint_constant(1);
    sensor_show(0);
    /* e^9 brighter: some 30 events a pixel. */
    image_paint_constant(8103);
    sensor_show(1000000);
    sensor_end();
    for (size_t i = 0; i < seen.n; i++)
        n[pixel_of(i)]++;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        const double threshold = (log(8103.01) - log(1.01)) / (n[k] + 0.5);

        sum += threshold / N_PIXELS;
        squares += threshold * threshold / N_PIXELS;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.30, sum);
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.031, sqrt(squares - sum * sum));
}

static void test_on_and_off_have_thresholds_of_their_own(void)
{
    size_t n_on = 0;

    params.threshold_on = 0.2;
    params.threshold_off = 0.5;
    sensor_make(1);
    image_paint_constant(0.1f);
    sensor_show(0);
    image_paint_constant(1);
    sensor_show(10000);
    image_paint_constant(0.1f);
    sensor_show(20000);
    sensor_end();
    for (size_t i = 0; i < seen.n; i++)
        n_on += shef_event_is_on(seen.events[i]);
    /* ln(1.01 / 0.11) = 2.217: 11 steps up; down from there, 2.2 - 0.2 and so 4 of 0.5. */
    TEST_ASSERT_EQUAL_size_t(11 * N_PIXELS, n_on);
    TEST_ASSERT_EQUAL_size_t(4 * N_PIXELS, seen.n - n_on);
}

static uint64_t fingerprint(void)
{
    uint64_t sum = 14695981039346656037u;

    for (size_t i = 0; i < seen.n; i++) {
        const uint64_t parts[] = { (uint64_t)seen.t_us[i], seen.events[i].x_px,
                                   seen.events[i].y_on };

        for (int k = 0; k < 3; k++)
            sum = (sum ^ parts[k]) * 1099511628211u;
    }
    return sum;
}

static uint64_t run_typical(uint64_t seed, uint32_t features, int32_t n_threads)
{
    struct shef_error err;
    struct shef_workers *workers = shef_workers_create(n_threads, &err);

    TEST_ASSERT_NOT_NULL(workers);
    TEST_ASSERT_TRUE(sim_event_sensor_preset("hard", &params));
    sensor_make_with(seed, features, workers);
    run_texture(100);
    TEST_ASSERT_GREATER_THAN_size_t(10000, seen.n);

    const uint64_t sum = fingerprint();

    sensor_forget();
    shef_workers_destroy(workers);
    return sum;
}

static void test_events_depend_on_the_seed_but_not_on_threads_or_instructions(void)
{
    static const char *const isas[] = { "c", "avx2", "avx512", "neon" };
    const uint64_t expected = run_typical(1, SHEF_CPU_NONE, 1);

    TEST_ASSERT_EQUAL_HEX64(expected, run_typical(1, SHEF_CPU_NONE, 1));
    for (size_t i = 0; i < sizeof isas / sizeof isas[0]; i++) {
        const uint32_t features = shef_cpu_features_of(isas[i]) & shef_cpu_features();

        TEST_ASSERT_EQUAL_HEX64(expected, run_typical(1, features, 1));
        TEST_ASSERT_EQUAL_HEX64(expected, run_typical(1, features, 2));
    }
    TEST_ASSERT_NOT_EQUAL_UINT64(expected, run_typical(2, SHEF_CPU_NONE, 1));
}

static void test_grain_is_small_centred_and_the_same_for_all_instructions(void)
{
    static const char *const isas[] = { "c", "avx2", "avx512", "neon" };
    enum { N = 100003 };
    static float expected[N], actual[N];
    double sum = 0, largest = 0;

    for (int32_t i = 0; i < N; i++)
        expected[i] = 0.5f;
    sim_event_scan_pick(SHEF_CPU_NONE)->grain(expected, 17, N);
    for (int32_t i = 0; i < N; i++) {
        const double share = (double)expected[i] / 0.5 - 1;

        sum += share / N;
        largest = fmax(largest, fabs(share));
    }
    TEST_ASSERT_DOUBLE_WITHIN(5 * SIM_GRAIN / sqrt(3.0 * N), 0, sum);
    TEST_ASSERT_TRUE(largest <= SIM_GRAIN && largest > 0.99 * SIM_GRAIN);
    for (size_t k = 0; k < sizeof isas / sizeof isas[0]; k++) {
        const uint32_t features = shef_cpu_features_of(isas[k]) & shef_cpu_features();

        for (int32_t i = 0; i < N; i++)
            actual[i] = 0.5f;
        sim_event_scan_pick(features)->grain(actual, 17, N);
        TEST_ASSERT_EQUAL_MEMORY(expected, actual, sizeof actual);
    }
}

static void test_impossible_parameters_are_refused_by_name(void)
{
    struct shef_error err;

    params.mismatch = NAN;
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_INVALID, sim_event_sensor_create(&sensor, &params, WIDTH, HEIGHT,
                                                                    1, 0, NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "mismatch"));
    params.mismatch = 0;
    params.threshold_off = 0;
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_INVALID, sim_event_sensor_create(&sensor, &params, WIDTH, HEIGHT,
                                                                    1, 0, NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "OFF threshold"));
    TEST_ASSERT_FALSE(sim_event_sensor_preset("loud", &params));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_noise_counts_are_those_of_the_plain_model);
    RUN_TEST(test_events_follow_the_light);
    RUN_TEST(test_mismatch_spreads_thresholds_as_asked);
    RUN_TEST(test_on_and_off_have_thresholds_of_their_own);
    RUN_TEST(test_events_depend_on_the_seed_but_not_on_threads_or_instructions);
    RUN_TEST(test_grain_is_small_centred_and_the_same_for_all_instructions);
    RUN_TEST(test_impossible_parameters_are_refused_by_name);
    return UNITY_END();
}
