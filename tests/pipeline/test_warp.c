#include "pipeline/warp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "filter_model.h"

static struct shef_warp_map map;
static struct shef_warp_shift shift;
static int16_t *source_pixels;
static struct shef_image_i16 source;
static struct shef_image_i16 out;

void tearDown(void)
{
    shef_warp_map_destroy(&map);
    shef_warp_shift_destroy(&shift);
    shef_image_destroy_i16(&out);
    free(source_pixels);
    source_pixels = NULL;
}

static void make(const struct shef_rectification *rectification)
{
    const int32_t width_px = rectification->sensor_width_px;
    const int32_t height_px = rectification->sensor_height_px;
    struct shef_error err = { 0 };

    tearDown();
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_warp_map_create(&map, rectification, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_shift_create(&shift, &map, &err));
    source_pixels = calloc((size_t)width_px * (size_t)height_px + SHEF_WARP_PAD_BYTES / 2,
                           sizeof *source_pixels);
    TEST_ASSERT_NOT_NULL(source_pixels);
    source = (struct shef_image_i16){ source_pixels, width_px, height_px, width_px * 2 };
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&out, rectification->width_px,
                                                     rectification->height_px, &err));
}

/* A smooth picture of which every position's value is known. */
static double scene(double x_px, double y_px)
{
    return 8000 * sin(x_px * .05) * cos(y_px * .04) + 10 * x_px;
}

static void paint_scene(void)
{
    for (int32_t y = 0; y < source.height_px; y++)
        for (int32_t x = 0; x < source.width_px; x++)
            shef_row_i16(source, y)[x] = (int16_t)lrint(scene(x, y));
}

static void run(const struct shef_warp_shift *by)
{
    shef_warp_run(&map, shef_warp_pick(shef_cpu_features()), by, source, out);
}

/* The rig's kind of lens and mount. */
static struct shef_rectification bent(void)
{
    struct shef_rectification r = shef_rectification_wide();
    const double a = .02;
    const double turn[9] = { cos(a), -sin(a), .01, sin(a), cos(a), -.01, -.01, .01, 1 };

    r.camera.fx_px = 560;
    r.camera.cx_px = 330;
    r.camera.distortion[0] = -.15;
    r.camera.distortion[1] = .08;
    r.camera.distortion[2] = .001;
    r.camera.distortion[3] = -.002;
    memcpy(r.r_camera_rectified, turn, sizeof turn);
    return r;
}

static void test_the_wide_profile_of_an_ideal_sensor_copies_it(void)
{
    const struct shef_rectification r = shef_rectification_wide();

    make(&r);
    TEST_ASSERT_EQUAL_INT32(640, out.width_px);
    TEST_ASSERT_EQUAL_INT32(480, out.height_px);
    paint_scene();
    run(NULL);
    for (int32_t y = 0; y < 480; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(source, y), shef_row_i16(out, y), 640);
}

static void test_the_paper_profile_enlarges_the_middle(void)
{
    const struct shef_rectification r = shef_rectification_paper();
    const double scale = 555.0 / 1301.0;

    make(&r);
    paint_scene();
    run(NULL);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const double expected = scene(319.5 + (x - 319.5) * scale, 239.5 + (y - 239.5) * scale);

            /* Bilinear mixing flattens curves by up to f'' / 8. */
            TEST_ASSERT_TRUE(fabs(shef_row_i16(out, y)[x] - expected) < 6);
        }
}

static void test_a_bent_turned_lens_is_undone(void)
{
    const struct shef_rectification r = bent();
    int n_seen = 0;

    make(&r);
    TEST_ASSERT_TRUE(map.max_error_px < .02);
    paint_scene();
    run(NULL);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            double x_px;
            double y_px;

            TEST_ASSERT_TRUE(shef_rectification_project(&r, x, y, &x_px, &y_px));
            if (x_px < 0 || y_px < 0 || x_px > 639 || y_px > 479)
                continue;
            n_seen++;
            /* 400 a pixel at most, times .02 px, plus the curve. */
            TEST_ASSERT_TRUE(fabs(shef_row_i16(out, y)[x] - scene(x_px, y_px)) < 14);
        }
    TEST_ASSERT_GREATER_THAN_INT(250000, n_seen);
}

static void test_projection_is_that_of_the_usual_lens_model(void)
{
    /* Worked out by hand: direction (.2, -.1), r2 = .05, k1 = -.2, p1 = .01, p2 = .02. */
    struct shef_rectification r = shef_rectification_wide();
    double x_px = 0;
    double y_px = 0;

    r.camera.distortion[0] = -.2;
    r.camera.distortion[2] = .01;
    r.camera.distortion[3] = .02;
    TEST_ASSERT_TRUE(shef_rectification_project(&r, 319.5 + 111, 239.5 - 55.5, &x_px, &y_px));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 319.5 + 555 * (.2 * .99 + 2 * .01 * -.02 + .02 * (.05 + .08)),
                              x_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 239.5 + 555 * (-.1 * .99 + .01 * (.05 + .02) + 2 * .02 * -.02),
                              y_px);
}

static void test_what_the_lens_cannot_see_stays_zero(void)
{
    struct shef_rectification r = shef_rectification_wide();
    double x_px;
    double y_px;

    /* A lens whose distortion folds back at a radius of 0.58, inside the picture's corners. */
    r.camera.distortion[0] = -1.0;
    TEST_ASSERT_FALSE(shef_rectification_project(&r, 0, 0, &x_px, &y_px));
    TEST_ASSERT_TRUE(shef_rectification_project(&r, 319.5, 0, &x_px, &y_px));
    make(&r);
    for (int i = 0; i < 640 * 480; i++)
        source_pixels[i] = 1000;
    run(NULL);
    TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(out, 0)[0]);
    TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(out, 479)[639]);
    TEST_ASSERT_EQUAL_INT16(1000, shef_row_i16(out, 240)[320]);

    /* A camera that looks backwards. */
    r = shef_rectification_wide();
    r.r_camera_rectified[0] = r.r_camera_rectified[8] = -1;
    TEST_ASSERT_FALSE(shef_rectification_project(&r, 319, 239, &x_px, &y_px));
}

static void test_a_shift_moves_the_picture_along_the_flow(void)
{
    const struct shef_rectification r = shef_rectification_wide();

    make(&r);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 100; x < 640; x += 200)
            shef_row_i16(source, y)[x] = 1000;

    /* The camera moves to the right: the picture moves to the left. */
    shef_warp_shift_set(&shift, (double[3]){ 2, 0, 0 }, 3);
    run(&shift);
    TEST_ASSERT_EQUAL_INT16(1000, shef_row_i16(out, 7)[97]);
    TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(out, 7)[100]);
    shef_warp_shift_set(&shift, (double[3]){ -.001, 0, 0 }, 1.25);
    run(&shift);
    TEST_ASSERT_EQUAL_INT16(750, shef_row_i16(out, 7)[101]);
    TEST_ASSERT_EQUAL_INT16(250, shef_row_i16(out, 7)[102]);
    /* Up and down leaves an upright line where it is. */
    shef_warp_shift_set(&shift, (double[3]){ 0, 5, 0 }, 3);
    run(&shift);
    TEST_ASSERT_EQUAL_INT16(1000, shef_row_i16(out, 7)[100]);
    /* Forward: everything moves away from the middle. */
    shef_warp_shift_set(&shift, (double[3]){ 0, 0, 1 }, 2);
    run(&shift);
    TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(out, 239)[100]);
    TEST_ASSERT_TRUE(shef_row_i16(out, 239)[98] > 900);
    TEST_ASSERT_TRUE(shef_row_i16(out, 239)[502] > 900);
    /* At rest: no shift. */
    shef_warp_shift_set(&shift, (double[3]){ 0, 0, 0 }, 2);
    run(&shift);
    for (int32_t y = 0; y < 480; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(source, y), shef_row_i16(out, y), 640);
}

static void test_a_shift_is_in_pixels_of_the_sensor_in_any_profile(void)
{
    const struct shef_rectification r = shef_rectification_paper();

    make(&r);
    paint_scene();
    shef_warp_shift_set(&shift, (double[3]){ 1, 0, 0 }, 2);
    run(&shift);
    for (int32_t x = 20; x < 620; x++) {
        const double x_px = 319.5 + (x - 319.5) * 555 / 1301 + 2;

        TEST_ASSERT_TRUE(
            fabs(shef_row_i16(out, 200)[x] - scene(x_px, 239.5 + (200 - 239.5) * 555 / 1301)) < 6);
    }
}

static void test_impossible_rectifications_are_refused_with_a_sentence(void)
{
    struct shef_rectification r = shef_rectification_wide();
    struct shef_error err = { 0 };

    r.width_px = 0;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_warp_map_create(&map, &r, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "sides must be 1 to 4096 on the sensor and 1 to 2048"));
    r = shef_rectification_wide();
    r.f_px = NAN;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_warp_map_create(&map, &r, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "focal lengths"));
    r = shef_rectification_wide();
    r.f_px = 60; /* a fish-eye's view through a strong lens */
    r.camera.fx_px = r.camera.fy_px = 60;
    r.camera.distortion[0] = .5;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_warp_map_create(&map, &r, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "bends rows"));
    TEST_ASSERT_NULL(map.nodes);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_wide_profile_of_an_ideal_sensor_copies_it);
    RUN_TEST(test_the_paper_profile_enlarges_the_middle);
    RUN_TEST(test_a_bent_turned_lens_is_undone);
    RUN_TEST(test_projection_is_that_of_the_usual_lens_model);
    RUN_TEST(test_what_the_lens_cannot_see_stays_zero);
    RUN_TEST(test_a_shift_moves_the_picture_along_the_flow);
    RUN_TEST(test_a_shift_is_in_pixels_of_the_sensor_in_any_profile);
    RUN_TEST(test_impossible_rectifications_are_refused_with_a_sentence);
    return UNITY_END();
}
