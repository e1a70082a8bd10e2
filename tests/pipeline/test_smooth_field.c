#include "pipeline/smooth_field.h"

#include <math.h>

#include "support/support.h"

static const struct shef_smooth_field field = {
    .c = { 1.5, -0.6, 0.25, -0.125, 0.75, -2.0 },
    .width_px = 640,
    .height_px = 480,
};

static void test_values_at_centre_and_borders_by_hand(void)
{
    /* The centre of 640 px lies between pixels 319 and 320, and half the width is one unit. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5, shef_field_at(&field, 319.5, 239.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 - 0.6 + 0.75, shef_field_at(&field, 639.5, 239.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 + 0.6 + 0.75, shef_field_at(&field, -0.5, 239.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 + 0.25 - 2.0, shef_field_at(&field, 319.5, 479.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 - 0.6 - 0.25 + 0.125 + 0.75 - 2.0,
                              shef_field_at(&field, 639.5, -0.5));
}

static void test_an_odd_size_has_its_centre_on_a_pixel(void)
{
    const struct shef_smooth_field odd = { .c = { 3.0, 1.0, 1.0, 1.0, 1.0, 1.0 },
                                           .width_px = 33,
                                           .height_px = 37 };

    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.0, shef_field_at(&odd, 16.0, 18.0));
}

static void test_a_row_is_the_field_at_its_pixels(void)
{
    enum { N = 40 };
    float row[N + 1];

    row[N] = -99.0f;
    for (int32_t y = -3; y < 490; y += 29) {
        shef_field_row(&field, y, 3.5, 16.0, N, row);
        for (int32_t i = 0; i < N; i++)
            TEST_ASSERT_FLOAT_WITHIN(1e-5f, (float)shef_field_at(&field, 3.5 + 16.0 * i, y),
                                     row[i]);
    }
    TEST_ASSERT_EQUAL_FLOAT(-99.0f, row[N]);
}

static void expect_field(const struct shef_smooth_field *actual, double within)
{
    TEST_ASSERT_EQUAL_INT32(field.width_px, actual->width_px);
    TEST_ASSERT_EQUAL_INT32(field.height_px, actual->height_px);
    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        TEST_ASSERT_DOUBLE_WITHIN(within, field.c[i], actual->c[i]);
}

static void test_a_fit_to_samples_of_a_field_is_that_field(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_field_fit fit = shef_field_fit_begin(640, 480);
    struct shef_smooth_field fitted;

    for (int i = 0; i < 50; i++) {
        const double x = shef_test_random_range(&random, 0, 639);
        const double y = shef_test_random_range(&random, 0, 479);

        shef_field_fit_add(&fit, x, y, shef_field_at(&field, x, y),
                           0.1 + shef_test_random_unit(&random));
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_field_fit_solve(&fit, &fitted));
    expect_field(&fitted, 1e-9);
}

/* Adds the field on a grid of 4 x 4 places. */
static void add_grid(struct shef_field_fit *fit, double offset_px, double weight)
{
    for (int i = 0; i < 16; i++) {
        const double x = 40.0 + 180.0 * (i % 4);
        const double y = 30.0 + 140.0 * (i / 4);

        shef_field_fit_add(fit, x, y, shef_field_at(&field, x, y) + offset_px, weight);
    }
}

static void test_samples_count_by_their_weight(void)
{
    struct shef_field_fit fit = shef_field_fit_begin(640, 480);
    struct shef_smooth_field fitted;

    add_grid(&fit, -1.0, 3.0);
    add_grid(&fit, 3.0, 1.0); /* the weighted mean of the offsets is 0 */
    add_grid(&fit, 1000.0, 0.0);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_field_fit_solve(&fit, &fitted));
    expect_field(&fitted, 1e-9);
}

static void expect_undetermined(const struct shef_field_fit *fit)
{
    struct shef_smooth_field fitted = { .width_px = -7 };

    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_field_fit_solve(fit, &fitted));
    TEST_ASSERT_EQUAL_INT32_MESSAGE(-7, fitted.width_px, "out_field was written");
}

static void test_too_few_or_badly_placed_samples_are_refused(void)
{
    struct shef_field_fit nothing = shef_field_fit_begin(640, 480);
    struct shef_field_fit five = nothing;
    struct shef_field_fit line = nothing;
    struct shef_field_fit weightless = nothing;

    for (int i = 0; i < 5; i++)
        shef_field_fit_add(&five, 100.0 * i, 90.0 * (i * i % 5), 1.0, 1.0);
    for (int i = 0; i < 1000; i++)
        shef_field_fit_add(&line, i % 640, (i % 640) * 0.75, 1.0, 1.0);
    add_grid(&weightless, 0.0, 0.0);
    expect_undetermined(&nothing);
    expect_undetermined(&five);
    expect_undetermined(&line);
    expect_undetermined(&weightless);
}

static void test_samples_that_are_no_numbers_are_refused(void)
{
    struct shef_field_fit fit = shef_field_fit_begin(640, 480);

    add_grid(&fit, 0.0, 1.0);
    shef_field_fit_add(&fit, 10.0, 10.0, 1.0, NAN);
    expect_undetermined(&fit);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_values_at_centre_and_borders_by_hand);
    RUN_TEST(test_an_odd_size_has_its_centre_on_a_pixel);
    RUN_TEST(test_a_row_is_the_field_at_its_pixels);
    RUN_TEST(test_a_fit_to_samples_of_a_field_is_that_field);
    RUN_TEST(test_samples_count_by_their_weight);
    RUN_TEST(test_too_few_or_badly_placed_samples_are_refused);
    RUN_TEST(test_samples_that_are_no_numbers_are_refused);
    return UNITY_END();
}
