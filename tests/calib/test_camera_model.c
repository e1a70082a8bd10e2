#include "calib/camera_model.h"

#include <math.h>
#include <stddef.h>

#include "support/support.h"

static const struct shef_camera_model barrel = {
    .fx_px = 1301,
    .fy_px = 1303,
    .cx_px = 1030,
    .cy_px = 760,
    .distortion = { -.22, .11, .0008, -.0012, -.02 },
};

static const struct shef_camera_model pincushion = {
    .fx_px = 555,
    .fy_px = 555,
    .cx_px = 319.5,
    .cy_px = 239.5,
    .distortion = { .1, -.02, -.001, .002, .01 },
};

static void test_the_axis_is_seen_at_the_principal_point(void)
{
    double x_px = 0;
    double y_px = 0;

    TEST_ASSERT_TRUE(shef_camera_project(&barrel, (double[3]){ 0, 0, 2.5 }, &x_px, &y_px));
    TEST_ASSERT_EQUAL_DOUBLE(1030, x_px);
    TEST_ASSERT_EQUAL_DOUBLE(760, y_px);
}

static void test_projection_is_that_of_the_usual_lens_model(void)
{
    /* Worked out by hand: direction (.2, -.1), r2 = .05. */
    const struct shef_camera_model lens = {
        .fx_px = 500,
        .fy_px = 400,
        .cx_px = 10,
        .cy_px = 20,
        .distortion = { -.2, 0, .01, .02, 0 },
    };
    double x_px = 0;
    double y_px = 0;

    TEST_ASSERT_TRUE(shef_camera_project(&lens, (double[3]){ .6, -.3, 3 }, &x_px, &y_px));
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 10 + 500 * (.2 * .99 + 2 * .01 * -.02 + .02 * (.05 + .08)),
                              x_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 20 + 400 * (-.1 * .99 + .01 * (.05 + .02) + 2 * .02 * -.02),
                              y_px);
}

static void expect_every_pixel_to_come_back(const struct shef_camera_model *camera, int width_px,
                                            int height_px)
{
    int n = 0;

    for (int y = -20; y < height_px + 20; y += 7)
        for (int x = -20; x < width_px + 20; x += 7) {
            double ray[3];
            double x_px = 0;
            double y_px = 0;

            TEST_ASSERT_TRUE(shef_camera_unproject(camera, x, y, ray));
            TEST_ASSERT_EQUAL_DOUBLE(1, ray[2]);
            TEST_ASSERT_TRUE(shef_camera_project(camera, ray, &x_px, &y_px));
            TEST_ASSERT_DOUBLE_WITHIN(2e-9, x, x_px);
            TEST_ASSERT_DOUBLE_WITHIN(2e-9, y, y_px);
            n++;
        }
    TEST_ASSERT_GREATER_THAN_INT(5000, n);
}

static void test_every_pixel_of_a_sensor_has_a_direction_that_is_seen_there(void)
{
    expect_every_pixel_to_come_back(&barrel, 2048, 1536);
    expect_every_pixel_to_come_back(&pincushion, 640, 480);
}

static void test_directions_come_back_from_their_pixels(void)
{
    struct shef_test_random randomness = shef_test_random_start();

    for (int i = 0; i < 2000; i++) {
        const double direction[3] = { 1.4 * (shef_test_random_unit(&randomness) - .5),
                                      1.0 * (shef_test_random_unit(&randomness) - .5), 1 };
        double x_px = 0;
        double y_px = 0;
        double ray[3];

        TEST_ASSERT_TRUE(shef_camera_project(&barrel, direction, &x_px, &y_px));
        TEST_ASSERT_TRUE(shef_camera_unproject(&barrel, x_px, y_px, ray));
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, direction[0], ray[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, direction[1], ray[1]);
    }
}

static void test_nothing_is_seen_behind_or_past_the_fold(void)
{
    struct shef_camera_model folding = pincushion;
    double x_px;
    double y_px;
    double ray[3];

    TEST_ASSERT_FALSE(shef_camera_project(&barrel, (double[3]){ 0, 0, -1 }, &x_px, &y_px));
    TEST_ASSERT_FALSE(shef_camera_project(&barrel, (double[3]){ 1, 0, 0 }, &x_px, &y_px));
    TEST_ASSERT_FALSE(shef_camera_project(&barrel, (double[3]){ 0, 0, NAN }, &x_px, &y_px));
    /* The distorted radius is largest, 0.385, at 0.577. */
    for (size_t i = 0; i < 5; i++)
        folding.distortion[i] = 0;
    folding.distortion[0] = -1;
    TEST_ASSERT_TRUE(shef_camera_project(&folding, (double[3]){ .57, 0, 1 }, &x_px, &y_px));
    TEST_ASSERT_FALSE(shef_camera_project(&folding, (double[3]){ .58, 0, 1 }, &x_px, &y_px));
    TEST_ASSERT_TRUE(shef_camera_unproject(&folding, 319.5 + .384 * 555, 239.5, ray));
    TEST_ASSERT_TRUE(ray[0] < .577);
    TEST_ASSERT_FALSE(shef_camera_unproject(&folding, 319.5 + .386 * 555, 239.5, ray));
    TEST_ASSERT_FALSE(shef_camera_unproject(&folding, 319.5 + 2 * 555, 239.5, ray));
    TEST_ASSERT_FALSE(shef_camera_unproject(&folding, NAN, 239.5, ray));
    /* One that folds and then unfolds again is past the fold for good. */
    folding.distortion[1] = .4;
    TEST_ASSERT_TRUE(shef_camera_project(&folding, (double[3]){ .6, 0, 1 }, &x_px, &y_px));
    TEST_ASSERT_FALSE(shef_camera_project(&folding, (double[3]){ .9, 0, 1 }, &x_px, &y_px));
    TEST_ASSERT_FALSE(shef_camera_project(&folding, (double[3]){ 1.5, 0, 1 }, &x_px, &y_px));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_axis_is_seen_at_the_principal_point);
    RUN_TEST(test_projection_is_that_of_the_usual_lens_model);
    RUN_TEST(test_every_pixel_of_a_sensor_has_a_direction_that_is_seen_there);
    RUN_TEST(test_directions_come_back_from_their_pixels);
    RUN_TEST(test_nothing_is_seen_behind_or_past_the_fold);
    return UNITY_END();
}
