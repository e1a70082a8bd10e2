/* The frame sensor: grey levels, noise and colours against what its parameters promise. */
#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/workers.h"
#include "shefsim/frame_sensor.h"
#include "support/support.h"

enum { WIDTH = 333, HEIGHT = 240, N_PIXELS = WIDTH * HEIGHT };

static struct shef_image_f32 light;
static struct shef_image_u8 frame;
static struct shef_image_i16 object;
static struct sim_frame_sensor_params params;

void setUp(void)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_f32(&light, WIDTH, HEIGHT, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_u8(&frame, WIDTH, HEIGHT, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_i16(&object, WIDTH, HEIGHT, &err));
    params = sim_frame_sensor_default(WIDTH, HEIGHT);
}

void tearDown(void)
{
    shef_image_destroy_f32(&light);
    shef_image_destroy_u8(&frame);
    shef_image_destroy_i16(&object);
}

static void paint(float radiance)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(light, y)[x] = radiance;
}

static void expose(uint64_t seed, uint64_t number, uint32_t features, struct shef_workers *workers,
                   const float (*tints)[3])
{
    struct sim_frame_sensor *sensor;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK,
                          sim_frame_sensor_create(&sensor, &params, seed, features, workers, &err));
    sim_frame_sensor_expose(sensor, number, light, tints, object, frame);
    sim_frame_sensor_destroy(sensor);
}

/* Mean and variance of the pixels whose place in the 2 x 2 pattern is this; -1: of all. */
static double mean_grey(int32_t place, double *out_variance)
{
    double sum = 0, squares = 0;
    int32_t n = 0;

    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++) {
            const double grey = shef_row_u8(frame, y)[x];

            if (place >= 0 && place != 2 * (y & 1) + (x & 1))
                continue;
            sum += grey;
            squares += grey * grey;
            n++;
        }
    if (out_variance)
        *out_variance = squares / n - sum / n * (sum / n);
    return sum / n;
}

static void expect_grey_and_noise(float radiance)
{
    const double electrons = radiance * 1600 * (double)params.exposure_ns * 1e-6;
    const double gain = 255 / params.full_well * pow(10, params.gain_mdb / 20000.0);
    double variance;

    paint(radiance);
    expose(1, 1, shef_cpu_features(), NULL, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 4 + electrons * gain, mean_grey(-1, &variance));
    /* Rounding adds about 1/12, less where there is little noise. */
    TEST_ASSERT_DOUBLE_WITHIN(0.06 * variance + 0.05, gain * gain * (electrons + 49) + 1 / 12.0,
                              variance);
}

static void test_grey_is_proportional_to_light_and_noise_to_its_root(void)
{
    expect_grey_and_noise(0.02f);
    expect_grey_and_noise(0.5f);
    expect_grey_and_noise(1);
    params.exposure_ns = 10000000;
    params.gain_mdb = 6000;
    expect_grey_and_noise(0.05f);
    expect_grey_and_noise(0.3f);
}

static void test_too_much_light_is_white_and_none_is_black(void)
{
    paint(50);
    expose(1, 1, shef_cpu_features(), NULL, NULL);
    TEST_ASSERT_EQUAL_DOUBLE(255, mean_grey(-1, NULL));
    paint(-1);
    expose(1, 1, shef_cpu_features(), NULL, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 4, mean_grey(-1, NULL));
}

static void test_noise_differs_between_frames_and_seeds(void)
{
    struct shef_image_u8 first;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_u8(&first, WIDTH, HEIGHT, &err));
    paint(0.5f);
    for (int32_t other = 0; other < 2; other++) {
        double product = 0;

        expose(1, 1, shef_cpu_features(), NULL, NULL);
        for (int32_t y = 0; y < HEIGHT; y++)
            memcpy(shef_row_u8(first, y), shef_row_u8(frame, y), WIDTH);

        const double mean = mean_grey(-1, NULL);

        expose(other == 0 ? 1 : 2, other == 0 ? 2 : 1, shef_cpu_features(), NULL, NULL);
        for (int32_t y = 0; y < HEIGHT; y++)
            for (int32_t x = 0; x < WIDTH; x++)
                product += (shef_row_u8(first, y)[x] - mean) * (shef_row_u8(frame, y)[x] - mean);
        /* Five deviations of the product of two independent noises with a variance of 2.5. */
        TEST_ASSERT_DOUBLE_WITHIN(5 * 2.5 / sqrt(N_PIXELS), 0, product / N_PIXELS);
    }
    shef_image_destroy_u8(&first);
}

static void test_threads_and_instructions_do_not_change_a_byte(void)
{
    static const char *const isas[] = { "c", "avx2", "avx512", "neon" };
    struct shef_error err;
    struct shef_image_u8 expected;
    struct shef_workers *workers = shef_workers_create(2, &err);

    TEST_ASSERT_NOT_NULL(workers);
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_u8(&expected, WIDTH, HEIGHT, &err));
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(light, y)[x] = (float)(x * y % 1000) * 0.0013f;
    expose(5, 5, SHEF_CPU_NONE, NULL, NULL);
    for (int32_t y = 0; y < HEIGHT; y++)
        memcpy(shef_row_u8(expected, y), shef_row_u8(frame, y), WIDTH);
    for (size_t i = 0; i < 2 * sizeof isas / sizeof isas[0]; i++) {
        expose(5, 5, shef_cpu_features_of(isas[i / 2]) & shef_cpu_features(),
               i & 1 ? workers : NULL, NULL);
        for (int32_t y = 0; y < HEIGHT; y++)
            TEST_ASSERT_EQUAL_MEMORY(shef_row_u8(expected, y), shef_row_u8(frame, y), WIDTH);
    }
    shef_image_destroy_u8(&expected);
    shef_workers_destroy(workers);
}

static void test_a_colour_sensor_sees_the_colours_of_objects(void)
{
    static const float tints[2][3] = { { 2, 0.5f, 0.5f }, { 0.5f, 0.5f, 2 } };
    /* Filters, see frame_sensor.c. */
    static const double filters[4] = { 0.75, 1, 1, 0.65 };

    params.format = SIM_FRAME_BAYER_RG8;
    paint(0.5f);
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_i16(object, y)[x] = 1;
    expose(1, 1, shef_cpu_features(), NULL, tints);
    for (int32_t place = 0; place < 4; place++) {
        const double tint = place == 3 ? 2 : 0.5;
        const double grey = 4 + 255 / 10500.0 * 4000 * filters[place] * tint;

        TEST_ASSERT_DOUBLE_WITHIN(0.1, grey, mean_grey(place, NULL));
    }
}

static void test_the_gain_brings_the_brightest_percent_near_white(void)
{
    paint(0.05f);
    for (int32_t x = 0; x < WIDTH; x++)
        for (int32_t y = 0; y < 6; y++)
            shef_row_f32(light, y)[x] = 0.2f;
    params.gain_mdb = sim_frame_sensor_gain_mdb(&params, light);
    TEST_ASSERT_GREATER_THAN_UINT32(0, params.gain_mdb);
    TEST_ASSERT_EQUAL_UINT32(0, params.gain_mdb % 100);
    expose(1, 1, shef_cpu_features(), NULL, NULL);

    double top = 0;

    for (int32_t x = 0; x < WIDTH; x++)
        top += (double)shef_row_u8(frame, 2)[x] / WIDTH;
    TEST_ASSERT_DOUBLE_WITHIN(4, 227, top);
    paint(2);
    TEST_ASSERT_EQUAL_UINT32(0, sim_frame_sensor_gain_mdb(&params, light));
}

static void test_instants_are_close_enough_and_centred(void)
{
    TEST_ASSERT_EQUAL_INT32(4, sim_frame_sensor_n_instants(0));
    TEST_ASSERT_EQUAL_INT32(4, sim_frame_sensor_n_instants(2));
    TEST_ASSERT_EQUAL_INT32(9, sim_frame_sensor_n_instants(4.2));
    TEST_ASSERT_EQUAL_INT32(16, sim_frame_sensor_n_instants(1e9));
    TEST_ASSERT_EQUAL_INT64(625000, sim_frame_sensor_instant_ns(&params, 0, 4));
    TEST_ASSERT_EQUAL_INT64(4375000, sim_frame_sensor_instant_ns(&params, 3, 4));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grey_is_proportional_to_light_and_noise_to_its_root);
    RUN_TEST(test_too_much_light_is_white_and_none_is_black);
    RUN_TEST(test_noise_differs_between_frames_and_seeds);
    RUN_TEST(test_threads_and_instructions_do_not_change_a_byte);
    RUN_TEST(test_a_colour_sensor_sees_the_colours_of_objects);
    RUN_TEST(test_the_gain_brings_the_brightest_percent_near_white);
    RUN_TEST(test_instants_are_close_enough_and_centred);
    return UNITY_END();
}
