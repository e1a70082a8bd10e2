#include "calib/rectification.h"

#include <math.h>
#include <string.h>

#include "support/support.h"

/* A frame camera: large, distorted, turned by about a degree about every axis. */
static struct shef_rectification frame_side(void)
{
    struct shef_rectification r = shef_rectification_wide();
    const double a = .02;
    /* Turns about z, then about x. */
    const double turn[9] = {
        cos(a),          -sin(a),         0,      sin(a) * cos(a), cos(a) * cos(a), -sin(a),
        sin(a) * sin(a), cos(a) * sin(a), cos(a),
    };

    r.sensor_width_px = 2048;
    r.sensor_height_px = 1536;
    r.camera = (struct shef_camera_model){
        .fx_px = 1301,
        .fy_px = 1301,
        .cx_px = 1023.5,
        .cy_px = 767.5,
        .distortion = { -.2, .1, .001, -.001, 0 },
    };
    memcpy(r.r_camera_rectified, turn, sizeof turn);
    return r;
}

static void test_profiles_are_those_of_the_paper(void)
{
    const struct shef_rectification wide = shef_rectification_wide();
    const struct shef_rectification paper = shef_rectification_paper();

    TEST_ASSERT_EQUAL_DOUBLE(555, wide.f_px);
    TEST_ASSERT_EQUAL_DOUBLE(1301, paper.f_px);
    TEST_ASSERT_EQUAL_INT32(640, wide.width_px);
    TEST_ASSERT_EQUAL_INT32(480, paper.height_px);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_rectification_check(&wide, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_rectification_check(&paper, NULL));
}

static void test_the_paper_profile_is_a_crop_of_the_wide_one(void)
{
    const struct shef_rectification paper = shef_rectification_paper();
    double x_px = 0;
    double y_px = 0;

    TEST_ASSERT_TRUE(shef_rectification_project(&paper, 319.5 + 130.1, 239.5, &x_px, &y_px));
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 319.5 + 55.5, x_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 239.5, y_px);
}

static void test_unprojecting_undoes_projecting(void)
{
    const struct shef_rectification r = frame_side();
    int n_moved = 0;

    for (int y = 0; y < 480; y += 5)
        for (int x = 0; x < 640; x += 5) {
            double sensor_x_px = 0;
            double sensor_y_px = 0;
            double x_px = 0;
            double y_px = 0;

            TEST_ASSERT_TRUE(shef_rectification_project(&r, x, y, &sensor_x_px, &sensor_y_px));
            TEST_ASSERT_TRUE(
                shef_rectification_unproject(&r, sensor_x_px, sensor_y_px, &x_px, &y_px));
            TEST_ASSERT_DOUBLE_WITHIN(1e-8, x, x_px);
            TEST_ASSERT_DOUBLE_WITHIN(1e-8, y, y_px);
            n_moved += fabs(sensor_x_px - x) > 100;
        }
    TEST_ASSERT_GREATER_THAN_INT(9000, n_moved);
}

static void test_what_the_rectified_view_does_not_face_has_no_place_in_it(void)
{
    struct shef_rectification r = shef_rectification_wide();
    double x_px;
    double y_px;

    TEST_ASSERT_TRUE(shef_rectification_unproject(&r, 100, 100, &x_px, &y_px));
    r.r_camera_rectified[0] = r.r_camera_rectified[8] = -1;
    TEST_ASSERT_FALSE(shef_rectification_unproject(&r, 100, 100, &x_px, &y_px));
}

static void test_impossible_rectifications_are_refused_with_a_sentence(void)
{
    struct shef_error err = { 0 };
    struct shef_rectification r = frame_side();

    r.sensor_width_px = r.sensor_height_px = 4096;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_rectification_check(&r, &err));
    r.sensor_width_px = 4097;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_rectification_check(&r, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "4097 x 4096 px sensor"));
    r = frame_side();
    r.height_px = 2049;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_rectification_check(&r, &err));
    r = frame_side();
    r.camera.fy_px = NAN;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_rectification_check(&r, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "focal lengths"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_profiles_are_those_of_the_paper);
    RUN_TEST(test_the_paper_profile_is_a_crop_of_the_wide_one);
    RUN_TEST(test_unprojecting_undoes_projecting);
    RUN_TEST(test_what_the_rectified_view_does_not_face_has_no_place_in_it);
    RUN_TEST(test_impossible_rectifications_are_refused_with_a_sentence);
    return UNITY_END();
}
