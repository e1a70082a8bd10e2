/* The event sensor's pixels: what their events say about the light, and what each kind of noise
 * adds. Images are made here: a texture that drifts, brightens and flickers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/time.h"
#include "core/workers.h"
#include "shefsim/event_sensor.h"
#include "shefsim/kernels/event_scan.h"
#include "support/support.h"

enum { WIDTH = 80, HEIGHT = 64, N_PIXELS = WIDTH * HEIGHT, STEP_US = 2000 };

static struct shef_image_f32 image;
static struct sim_event_sensor *sensor;
static struct sim_event_sensor_params params;

/* All events of a run. */
struct log {
    struct shef_event *events;
    int64_t *t_us;
    size_t n;
    size_t capacity;
    int64_t complete_us;
};

static struct log seen;

void setUp(void)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_f32(&image, WIDTH, HEIGHT, &err));
    TEST_ASSERT_TRUE(sim_event_sensor_preset("clean", &params));
    sensor = NULL;
    seen = (struct log){ .complete_us = INT64_MIN };
}

static void forget(void)
{
    sim_event_sensor_destroy(sensor);
    free(seen.events);
    free(seen.t_us);
    sensor = NULL;
    seen = (struct log){ .complete_us = INT64_MIN };
}

void tearDown(void)
{
    forget();
    shef_image_destroy_f32(&image);
}

/* Logarithm of the light at a pixel: waves of several lengths that move, each pixel a little
 * different, from deep black to white. */
static double light_log(int32_t x, int32_t y, double s)
{
    return -2 + 1.5 * sin(0.3 * x + 0.11 * y - 40 * s) + 0.8 * sin(0.9 * y + 0.2 * x + 65 * s) -
           0.2 * sin(0.01 * x * y + 200 * s);
}

static void paint(double s)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(image, y)[x] = (float)exp(light_log(x, y, s));
}

static void paint_constant(float light)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(image, y)[x] = light;
}

static void make_with(uint64_t seed, uint32_t features, struct shef_workers *workers)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT_MESSAGE(
        SHEF_OK,
        sim_event_sensor_create(&sensor, &params, WIDTH, HEIGHT, seed, features, workers, &err),
        err.text);
}

static void make(uint64_t seed)
{
    make_with(seed, shef_cpu_features(), NULL);
}

static void note(const struct sim_events *events)
{
    const size_t n = seen.n + events->n;

    if (n > seen.capacity) {
        seen.capacity = 2 * n;
        seen.events = reallocarray(seen.events, seen.capacity, sizeof *seen.events);
        seen.t_us = reallocarray(seen.t_us, seen.capacity, sizeof *seen.t_us);
        TEST_ASSERT_NOT_NULL(seen.events);
        TEST_ASSERT_NOT_NULL(seen.t_us);
    }
    for (size_t i = 0; i < events->n; i++) {
        const int64_t t_us = events->base_us + events->events[i].t_us;

        TEST_ASSERT_TRUE_MESSAGE(t_us >= seen.complete_us, "earlier than what was complete");
        TEST_ASSERT_TRUE(seen.n == 0 || t_us >= seen.t_us[seen.n - 1]);
        TEST_ASSERT_TRUE(events->events[i].x_px < WIDTH);
        TEST_ASSERT_TRUE(shef_event_y_px(events->events[i]) < HEIGHT);
        seen.events[seen.n] = events->events[i];
        seen.t_us[seen.n++] = t_us;
    }
    seen.complete_us = events->complete_us;
}

static void step(int64_t t_us)
{
    struct sim_events events;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK,
                          sim_event_sensor_step(sensor, t_us * 1000, image, &events, &err));
    note(&events);
}

static void flush(void)
{
    struct sim_events events;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_event_sensor_flush(sensor, &events, &err));
    note(&events);
}

/* Shows the moving texture for a while. */
static void run_texture(int32_t n_steps)
{
    for (int32_t i = 0; i <= n_steps; i++) {
        paint(i * STEP_US * 1e-6);
        step((int64_t)i * STEP_US);
    }
    flush();
}

static void run_constant(float light, int32_t n_steps)
{
    paint_constant(light);
    for (int32_t i = 0; i <= n_steps; i++)
        step((int64_t)i * 10 * STEP_US);
    flush();
}

static size_t pixel_of(size_t i)
{
    return (size_t)shef_event_y_px(seen.events[i]) * WIDTH + seen.events[i].x_px;
}

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
        paint(i * STEP_US * 1e-6);
        step((int64_t)i * STEP_US);
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
    flush();
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
    make(1);
    expect_counts_of_the_plain_model();
}

/* At any event, the sum of a pixel's events times its threshold is the change of the logarithm
 * since the start, to within a threshold; at the event itself it is exact. */
static void test_events_follow_the_light(void)
{
    static int32_t sum[N_PIXELS];
    double worst = 0;

    memset(sum, 0, sizeof sum);
    make(1);
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
    make(3);
    paint_constant(1);
    step(0);
    /* e^9 brighter: some 30 events a pixel. */
    paint_constant(8103);
    step(1000000);
    flush();
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
    make(1);
    paint_constant(0.1f);
    step(0);
    paint_constant(1);
    step(10000);
    paint_constant(0.1f);
    step(20000);
    flush();
    for (size_t i = 0; i < seen.n; i++)
        n_on += shef_event_is_on(seen.events[i]);
    /* ln(1.01 / 0.11) = 2.217: 11 steps up; down from there, 2.2 - 0.2 and so 4 of 0.5. */
    TEST_ASSERT_EQUAL_size_t(11 * N_PIXELS, n_on);
    TEST_ASSERT_EQUAL_size_t(4 * N_PIXELS, seen.n - n_on);
}

static void expect_gaps_of_at_least(int64_t gap_us)
{
    static int64_t last[N_PIXELS];

    for (int32_t k = 0; k < N_PIXELS; k++)
        last[k] = INT64_MIN / 2;
    TEST_ASSERT_GREATER_THAN_size_t(10000, seen.n);
    for (size_t i = 0; i < seen.n; i++) {
        /* Both times are rounded down to whole microseconds. */
        TEST_ASSERT_TRUE(seen.t_us[i] - last[pixel_of(i)] >= gap_us - 1);
        last[pixel_of(i)] = seen.t_us[i];
    }
}

static void test_a_pixel_is_silent_for_its_dead_time(void)
{
    params.dead_time_ns = 3000000;
    make(5);
    run_texture(200);
    expect_gaps_of_at_least(3000);
}

static void test_dead_time_holds_with_noise_jitter_and_mismatch_too(void)
{
    params.mismatch = 0.2;
    params.dead_time_ns = 700000;
    params.jitter_ns = 100000;
    params.background_hz = 20;
    params.hot_share = 0.02;
    make(5);
    run_texture(200);
    expect_gaps_of_at_least(700);
    /* Nothing comes later than the last image but by jitter. */
    TEST_ASSERT_TRUE(seen.t_us[seen.n - 1] <= 200 * STEP_US + 347);
}

static void test_what_a_dead_time_held_back_is_said_later(void)
{
    int32_t sum[N_PIXELS] = { 0 };

    params.dead_time_ns = 400000;
    make(1);
    for (int32_t i = 0; i <= 200; i++) {
        paint(i * STEP_US * 1e-6);
        step((int64_t)i * STEP_US);
    }
    /* The same image for a while: what is owed is paid. */
    for (int32_t i = 1; i <= 20; i++)
        step((int64_t)(200 + i) * STEP_US);
    flush();
    TEST_ASSERT_TRUE(seen.t_us[seen.n - 1] <= 220 * STEP_US);
    for (size_t i = 0; i < seen.n; i++)
        sum[pixel_of(i)] += shef_event_is_on(seen.events[i]) ? 1 : -1;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        const double now = log(exp(light_log(k % WIDTH, k / WIDTH, 0.4)) + params.dark);
        const double first = log(exp(light_log(k % WIDTH, k / WIDTH, 0)) + params.dark);

        TEST_ASSERT_DOUBLE_WITHIN(0.301, now - first, 0.3 * sum[k]);
    }
}

static void test_latency_shifts_and_jitter_spreads_times(void)
{
    double mean = 0, squares = 0;

    params.latency_ns = 500000;
    params.jitter_ns = 40000;
    make(7);
    paint_constant(1);
    step(0);
    /* One event each, half-way up: ln rises by 0.6 within the step. */
    paint_constant(1.0f + 1.01f * (float)(exp(0.45) - 1));
    step(100000);
    paint_constant(1.0f + 1.01f * (float)(exp(0.45) - 1));
    step(110000);
    flush();
    TEST_ASSERT_EQUAL_size_t(N_PIXELS, seen.n);
    for (size_t i = 0; i < seen.n; i++) {
        const double late = (double)seen.t_us[i] - 100000 * 0.3 / 0.45;

        mean += late / N_PIXELS;
        squares += late * late / N_PIXELS;
    }
    TEST_ASSERT_DOUBLE_WITHIN(3, 500, mean);
    TEST_ASSERT_DOUBLE_WITHIN(2, 40, sqrt(squares - mean * mean));
}

static void test_leak_makes_on_events_at_its_rate(void)
{
    params.leak_hz = 2;
    make(1);
    run_constant(0.4f, 500); /* 10 s */
    TEST_ASSERT_UINT32_WITHIN(N_PIXELS / 50, 20 * N_PIXELS, seen.n);
    for (size_t i = 0; i < seen.n; i++)
        TEST_ASSERT_TRUE(shef_event_is_on(seen.events[i]));
    /* Not all at once, from the first period on. */
    for (size_t i = 0; i < 10; i++)
        TEST_ASSERT_INT64_WITHIN(60000, 500000 * (int64_t)i / 10,
                                 seen.t_us[(size_t)N_PIXELS * i / 10]);
}

static void test_a_long_leak_does_not_overflow(void)
{
    params.leak_hz = 100;
    params.threshold_on = 10;
    make(1);
    run_constant(0.4f, 200); /* 4 s: twice what 32 bits of levels hold */
    TEST_ASSERT_UINT32_WITHIN(N_PIXELS, 400 * N_PIXELS, seen.n);
}

static void test_background_comes_at_its_rate_evenly_in_space_and_sign(void)
{
    size_t n_on = 0, n_left = 0;

    params.background_hz = 3;
    make(11);
    run_constant(0.4f, 500); /* 10 s */
    TEST_ASSERT_DOUBLE_WITHIN(5 * sqrt(30.0 * N_PIXELS), 30.0 * N_PIXELS, (double)seen.n);
    TEST_ASSERT_EQUAL_size_t(seen.n, sim_event_sensor_stats(sensor).n_background);
    for (size_t i = 0; i < seen.n; i++) {
        n_on += shef_event_is_on(seen.events[i]);
        n_left += seen.events[i].x_px < WIDTH / 2;
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.5 * sqrt((double)seen.n), (double)seen.n / 2, (double)n_on);
    TEST_ASSERT_DOUBLE_WITHIN(2.5 * sqrt((double)seen.n), (double)seen.n / 2, (double)n_left);
}

static void test_hot_pixels_are_few_and_fast(void)
{
    int32_t n[N_PIXELS] = { 0 };
    int32_t n_hot = 0;

    params.hot_share = 0.01;
    make(11);
    run_constant(0.4f, 500); /* 10 s */
    for (size_t i = 0; i < seen.n; i++)
        n[pixel_of(i)]++;
    for (int32_t k = 0; k < N_PIXELS; k++) {
        TEST_ASSERT_TRUE(n[k] == 0 || n[k] >= 999);
        n_hot += n[k] > 0;
    }
    /* Two that were drawn on the same pixel count once. */
    TEST_ASSERT_INT32_WITHIN(3, N_PIXELS / 100 - 2, n_hot);
    TEST_ASSERT_UINT32_WITHIN(1500 * n_hot / 4, 3000 * n_hot, seen.n);
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
    make_with(seed, features, workers);
    run_texture(100);
    TEST_ASSERT_GREATER_THAN_size_t(10000, seen.n);

    const uint64_t sum = fingerprint();

    forget();
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
    RUN_TEST(test_a_pixel_is_silent_for_its_dead_time);
    RUN_TEST(test_dead_time_holds_with_noise_jitter_and_mismatch_too);
    RUN_TEST(test_what_a_dead_time_held_back_is_said_later);
    RUN_TEST(test_latency_shifts_and_jitter_spreads_times);
    RUN_TEST(test_leak_makes_on_events_at_its_rate);
    RUN_TEST(test_a_long_leak_does_not_overflow);
    RUN_TEST(test_background_comes_at_its_rate_evenly_in_space_and_sign);
    RUN_TEST(test_hot_pixels_are_few_and_fast);
    RUN_TEST(test_events_depend_on_the_seed_but_not_on_threads_or_instructions);
    RUN_TEST(test_grain_is_small_centred_and_the_same_for_all_instructions);
    RUN_TEST(test_impossible_parameters_are_refused_by_name);
    return UNITY_END();
}
