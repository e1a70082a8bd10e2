#include "pipeline/bias.h"

#include <math.h>
#include <string.h>

#include "core/memory.h"
#include "robust_cases.h"

#define WIDTH_PX  400
#define HEIGHT_PX 300
#define HOLE_PX   79.9f
#define N_SAMPLES 2

/* About the real rig's, 2 to 10 px. */
static const struct shef_smooth_field rig = { .c = { -3.1, -3.0, 2.1, -1.2, 5.7, 3.4 },
                                              .width_px = WIDTH_PX,
                                              .height_px = HEIGHT_PX };

static struct shef_bias_sample samples[N_SAMPLES];

void setUp(void)
{
    struct shef_error err = { 0 };

    for (int i = 0; i < N_SAMPLES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_image_create_f32(&samples[i].disparity, WIDTH_PX, HEIGHT_PX, &err));
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_image_create_f32(&samples[i].truth, WIDTH_PX, HEIGHT_PX, &err));
    }
}

void tearDown(void)
{
    for (int i = 0; i < N_SAMPLES; i++) {
        shef_image_destroy_f32(&samples[i].disparity);
        shef_image_destroy_f32(&samples[i].truth);
    }
}

/* Shares of all pixels. */
struct flaws {
    double missing;    /* without an estimate */
    double holes;      /* marked as holes in the truth, the estimate far from that */
    double mismatches; /* estimates that have nothing to do with the truth */
    double noise_px;   /* of the others, uniform from -noise to noise */
};

static void fill_samples(struct shef_test_random *random, const struct shef_smooth_field *bias,
                         struct flaws flaws)
{
    for (int i = 0; i < N_SAMPLES; i++)
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++) {
                float *d = &shef_row_f32(samples[i].disparity, y)[x];
                float *truth = &shef_row_f32(samples[i].truth, y)[x];
                const double noise = flaws.noise_px * (2.0 * shef_test_random_unit(random) - 1.0);

                *truth = (float)(20.0 + 10.0 * i + 0.1 * x);
                *d = (float)(*truth + shef_field_at(bias, x, y) + noise);
                if (shef_test_random_unit(random) < flaws.mismatches)
                    *d = (float)(1.0 + 78.0 * shef_test_random_unit(random));
                if (shef_test_random_unit(random) < flaws.holes)
                    *truth = 80.0f;
                if (shef_test_random_unit(random) < flaws.missing)
                    *d = 0.0f;
            }
}

/* The fit's distance from the truth, over the image and at its worst place, a corner. */
static void expect_recovered(struct flaws flaws, double mean_px, double largest_px)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_smooth_field fitted;
    struct shef_error err = { 0 };
    double sum = 0.0;
    double largest = 0.0;
    int32_t n = 0;

    fill_samples(&random, &rig, flaws);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_bias_fit(samples, N_SAMPLES, HOLE_PX, &fitted, &err),
                              err.text);
    TEST_ASSERT_EQUAL_INT32(WIDTH_PX, fitted.width_px);
    TEST_ASSERT_EQUAL_INT32(HEIGHT_PX, fitted.height_px);
    for (int32_t y = 0; y < HEIGHT_PX; y += 5)
        for (int32_t x = 0; x < WIDTH_PX; x += 5) {
            const double away = fabs(shef_field_at(&fitted, x, y) - shef_field_at(&rig, x, y));

            sum += away;
            largest = fmax(largest, away);
            n++;
        }
    expect_at_most(mean_px, sum / n, "mean error (px)");
    expect_at_most(largest_px, largest, "largest error (px)");
}

static void test_a_clean_bias_is_recovered_exactly(void)
{
    expect_recovered((struct flaws){ 0 }, 1e-4, 1e-3);
}

static void test_mismatches_holes_and_gaps_are_no_hindrance(void)
{
    expect_recovered((struct flaws){ .missing = 0.5, .holes = 0.05, .noise_px = 2.0 }, 0.05, 0.25);
    expect_recovered((struct flaws){ .mismatches = 0.25, .noise_px = 2.0 }, 0.05, 0.25);
    expect_recovered(
        (struct flaws){ .missing = 0.7, .holes = 0.05, .mismatches = 0.15, .noise_px = 2.0 }, 0.1,
        0.4);
}

static void expect_refused(int32_t n_samples)
{
    struct shef_smooth_field fitted = { .width_px = -7 };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_bias_fit(samples, n_samples, HOLE_PX, &fitted, &err));
    TEST_ASSERT_EQUAL_INT32_MESSAGE(-7, fitted.width_px, "out_bias was written");
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "do not determine six numbers"), err.text);
}

static void test_nothing_to_fit_is_refused(void)
{
    expect_refused(0);
    expect_refused(N_SAMPLES); /* no estimate anywhere */
}

static void test_too_few_pixels_are_refused(void)
{
    struct shef_test_random random = shef_test_random_start();

    fill_samples(&random, &rig, (struct flaws){ .missing = 0.995 });
    expect_refused(N_SAMPLES);
}

/* Thousands of pixels, but in a strip that says nothing about what lies above and below. */
static void test_estimates_in_one_strip_are_refused(void)
{
    struct shef_test_random random = shef_test_random_start();

    fill_samples(&random, &rig, (struct flaws){ 0 });
    for (int i = 0; i < N_SAMPLES; i++)
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            if (y < 40 || y >= 52)
                memset(shef_row_f32(samples[i].disparity, y), 0, WIDTH_PX * sizeof(float));
    expect_refused(N_SAMPLES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_clean_bias_is_recovered_exactly);
    RUN_TEST(test_mismatches_holes_and_gaps_are_no_hindrance);
    RUN_TEST(test_nothing_to_fit_is_refused);
    RUN_TEST(test_too_few_pixels_are_refused);
    RUN_TEST(test_estimates_in_one_strip_are_refused);
    return UNITY_END();
}
