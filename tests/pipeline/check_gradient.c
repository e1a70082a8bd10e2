#include "pipeline/kernels/gradient.h"

#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "kernel_check.h"

#define MAX_VALUES 700
#define MAX_WORDS  ((MAX_VALUES + 63) / 64)
#define CANARY     12345

/* Values within limits, the limits themselves and plateaus included. */
static void fill(int16_t *values, int32_t n, int32_t lowest, int32_t highest)
{
    for (int32_t i = 0; i < n; i++) {
        const int32_t kind = any(0, 4);

        values[i] = (int16_t)(kind == 0            ? lowest
                              : kind == 1          ? highest
                              : kind == 2 && i > 0 ? values[i - 1]
                                                   : any(lowest, highest));
    }
}

static void same(const int16_t *expected, const int16_t *actual, int32_t n)
{
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n);
    TEST_ASSERT_EQUAL_INT16(CANARY, actual[n]);
}

static void test_pixels_are_widened_and_looked_up_alike(void)
{
    int16_t table[256];

    fill(table, 256, -32768, 32767);
    for (int round = 0; round < 100; round++) {
        const int32_t n = any(1, MAX_VALUES);
        uint8_t pixels[MAX_VALUES];

        for (int32_t i = 0; i < n; i++)
            pixels[i] = (uint8_t)any(0, 255);
        for (int k = 0; k < n_features; k++) {
            int16_t wide[MAX_VALUES + 1];
            int16_t found[MAX_VALUES + 1];

            wide[n] = found[n] = CANARY;
            shef_gradient_pick(features[k])->widen(wide, pixels, n);
            shef_gradient_pick(features[k])->look_up(found, pixels, n, table);
            for (int32_t i = 0; i < n; i++) {
                TEST_ASSERT_EQUAL_INT16(pixels[i], wide[i]);
                TEST_ASSERT_EQUAL_INT16(table[pixels[i]], found[i]);
            }
            TEST_ASSERT_EQUAL_INT16(CANARY, wide[n]);
            TEST_ASSERT_EQUAL_INT16(CANARY, found[n]);
        }
    }
}

static void test_slopes_equal_the_reference_up_to_the_largest(void)
{
    for (int round = 0; round < 200; round++) {
        static int16_t levels[3][MAX_VALUES + 2];
        const int16_t *const rows[3] = { levels[0] + 1, levels[1] + 1, levels[2] + 1 };
        const int32_t n = any(1, MAX_VALUES);
        int16_t gx[MAX_VALUES];
        int16_t gy[MAX_VALUES];

        for (int r = 0; r < 3; r++)
            fill(levels[r], MAX_VALUES + 2, 0, round % 2 ? 255 : SHEF_GRADIENT_LOG_MAX);
        shef_gradient_kernels_c.sobel(gx, gy, rows, n);
        for (int k = 0; k < n_features; k++) {
            int16_t actual_gx[MAX_VALUES + 1];
            int16_t actual_gy[MAX_VALUES + 1];

            actual_gx[n] = actual_gy[n] = CANARY;
            shef_gradient_pick(features[k])->sobel(actual_gx, actual_gy, rows, n);
            same(gx, actual_gx, n);
            same(gy, actual_gy, n);
        }
    }
}

static void test_lengths_equal_the_reference(void)
{
    for (int round = 0; round < 200; round++) {
        const int32_t n = any(1, MAX_VALUES);
        int16_t gx[MAX_VALUES];
        int16_t gy[MAX_VALUES];
        int16_t expected[MAX_VALUES];

        fill(gx, n, -1020, 1020);
        fill(gy, n, -1020, 1020);
        shef_gradient_kernels_c.length(expected, gx, gy, n);
        for (int32_t i = 0; i < n; i++)
            TEST_ASSERT_TRUE(fabs(expected[i] - 8 * hypot(gx[i], gy[i])) <= 0.501);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_VALUES + 1];

            actual[n] = CANARY;
            shef_gradient_pick(features[k])->length(actual, gx, gy, n);
            same(expected, actual, n);
        }
    }
}

static void test_slopes_along_a_direction_equal_the_reference(void)
{
    for (int round = 0; round < 200; round++) {
        const int32_t n = any(1, MAX_VALUES);
        const double angle = any(0, 359) * 0.017453292519943295;
        const int16_t ux = (int16_t)lrint(SHEF_GRADIENT_DIRECTION_ONE * cos(angle));
        const int16_t uy = (int16_t)lrint(SHEF_GRADIENT_DIRECTION_ONE * sin(angle));
        int16_t gx[MAX_VALUES];
        int16_t gy[MAX_VALUES];
        int16_t expected[MAX_VALUES];

        fill(gx, n, -30908, 30908);
        fill(gy, n, -30908, 30908);
        shef_gradient_kernels_c.along(expected, gx, gy, n, ux, uy);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_VALUES + 1];

            actual[n] = CANARY;
            shef_gradient_pick(features[k])->along(actual, gx, gy, n, ux, uy);
            same(expected, actual, n);
        }
    }
}

static void test_slopes_along_rays_equal_the_reference_through_the_pole(void)
{
    for (int round = 0; round < 300; round++) {
        const int32_t n = any(1, MAX_VALUES);
        struct shef_gradient_rays rays = {
            .first_x = (float)(2 * shef_test_random_unit(&random_numbers) - 1),
            .step_x = (float)(0.004 * shef_test_random_unit(&random_numbers) - 0.002),
            .y = (float)(2 * shef_test_random_unit(&random_numbers) - 1),
        };
        int16_t gx[MAX_VALUES];
        int16_t gy[MAX_VALUES];
        int16_t expected[MAX_VALUES];

        if (round % 5 == 0) /* a pixel to which the camera moves exactly */
            rays = (struct shef_gradient_rays){ -0.25F, 0.25F / 64, 0 };
        if (round % 5 == 1) /* a camera at rest */
            rays = (struct shef_gradient_rays){ 0, 0, 0 };
        fill(gx, n, -21000, 21000);
        fill(gy, n, -21000, 21000);
        shef_gradient_kernels_c.along_rays(expected, gx, gy, n, &rays);
        if (round % 5 == 0 && n > 64)
            TEST_ASSERT_EQUAL_INT16(0, expected[64]);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_VALUES + 1];

            actual[n] = CANARY;
            shef_gradient_pick(features[k])->along_rays(actual, gx, gy, n, &rays);
            same(expected, actual, n);
        }
    }
}

static void test_differences_equal_the_reference(void)
{
    for (int round = 0; round < 100; round++) {
        const int32_t n = any(1, MAX_VALUES);
        int16_t a[MAX_VALUES];
        int16_t b[MAX_VALUES];
        int16_t expected[MAX_VALUES];

        fill(a, n, 0, SHEF_GRADIENT_LOG_MAX);
        fill(b, n, 0, SHEF_GRADIENT_LOG_MAX);
        shef_gradient_kernels_c.difference(expected, a, b, n);
        for (int k = 0; k < n_features; k++) {
            int16_t actual[MAX_VALUES + 1];

            actual[n] = CANARY;
            shef_gradient_pick(features[k])->difference(actual, a, b, n);
            same(expected, actual, n);
        }
    }
}

static void test_thin_edges_equal_the_reference(void)
{
    int64_t n_thin = 0;

    for (int round = 0; round < 300; round++) {
        static int16_t lengths[3][MAX_VALUES + 2];
        const int16_t *const rows[3] = { lengths[0] + 1, lengths[1] + 1, lengths[2] + 1 };
        const int32_t n = any(1, MAX_VALUES);
        const size_t n_words = (size_t)(n + 63) / 64;
        const int32_t threshold = any(1, 300);
        int16_t gx[MAX_VALUES];
        int16_t gy[MAX_VALUES];
        uint64_t expected[MAX_WORDS];

        for (int r = 0; r < 3; r++)
            fill(lengths[r], MAX_VALUES + 2, 0, round % 3 ? 400 : 32767);
        fill(gx, n, round % 2 ? -8 : -1020, round % 2 ? 8 : 1020);
        fill(gy, n, round % 2 ? -8 : -1020, round % 2 ? 8 : 1020);
        shef_gradient_kernels_c.thin(expected, rows, gx, gy, n, threshold);
        for (size_t i = 0; i < n_words; i++)
            n_thin += __builtin_popcountll(expected[i]);
        for (int k = 0; k < n_features; k++) {
            uint64_t actual[MAX_WORDS];

            memset(actual, 0xff, sizeof actual);
            shef_gradient_pick(features[k])->thin(actual, rows, gx, gy, n, threshold);
            TEST_ASSERT_EQUAL_HEX64_ARRAY(expected, actual, n_words);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT64(1000, n_thin);
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]),
                                 shef_gradient_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_pixels_are_widened_and_looked_up_alike);
    RUN_TEST(test_slopes_equal_the_reference_up_to_the_largest);
    RUN_TEST(test_lengths_equal_the_reference);
    RUN_TEST(test_slopes_along_a_direction_equal_the_reference);
    RUN_TEST(test_slopes_along_rays_equal_the_reference_through_the_pole);
    RUN_TEST(test_differences_equal_the_reference);
    RUN_TEST(test_thin_edges_equal_the_reference);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
