#include "calib/rectification.h"

#include <math.h>
#include <string.h>

#include "calib/calibration.h"
#include "support/support.h"

/* The paper's rig as it might have been put together: lenses bend, cameras are turned by up to
 * two degrees and sit a little up and ahead of each other. */
static struct shef_calibration crooked_rig(void)
{
    struct shef_calibration rig = {
        .frame = { .width_px = 2048,
                   .height_px = 1536,
                   .model = { .fx_px = 1301,
                              .fy_px = 1303,
                              .cx_px = 1030,
                              .cy_px = 760,
                              .distortion = { -.12, .05, .0004, -.0006, 0 } } },
        .event = { .width_px = 640,
                   .height_px = 480,
                   .model = { .fx_px = 556,
                              .fy_px = 554,
                              .cx_px = 325,
                              .cy_px = 236,
                              .distortion = { -.08, .03, -.0003, .0005, 0 } } },
    };

    rig.t_event_frame = shef_rigid_from_rotation_vector((double[3]){ .01, -.03, .02 },
                                                        (double[3]){ -.065, .0008, -.002 });
    return rig;
}

/* Where a point in frame camera axes appears in both rectified views, by the raw cameras. */
static void see(const struct shef_calibration *rig, const struct shef_rectification *left,
                const struct shef_rectification *right, const double p_frame_m[3],
                double out_left_px[2], double out_right_px[2])
{
    double p_event_m[3];
    double x_px = 0;
    double y_px = 0;

    TEST_ASSERT_TRUE(shef_camera_project(&rig->frame.model, p_frame_m, &x_px, &y_px));
    TEST_ASSERT_TRUE(
        shef_rectification_unproject(left, x_px, y_px, &out_left_px[0], &out_left_px[1]));
    shef_rigid_apply(&rig->t_event_frame, p_frame_m, p_event_m);
    TEST_ASSERT_TRUE(shef_camera_project(&rig->event.model, p_event_m, &x_px, &y_px));
    TEST_ASSERT_TRUE(
        shef_rectification_unproject(right, x_px, y_px, &out_right_px[0], &out_right_px[1]));
}

static void expect_rows_and_depths(const char *profile, double f_px)
{
    const struct shef_calibration rig = crooked_rig();
    struct shef_test_random randomness = shef_test_random_start();
    struct shef_rectification left;
    struct shef_rectification right;
    struct shef_error err = { 0 };
    double baseline_m = 0;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_rectification_pair(&rig, profile, &left, &right, &baseline_m, &err),
        err.text);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(.065 * .065 + .0008 * .0008 + .002 * .002), baseline_m);
    TEST_ASSERT_EQUAL_INT32(2048, left.sensor_width_px);
    TEST_ASSERT_EQUAL_INT32(480, right.sensor_height_px);
    TEST_ASSERT_EQUAL_DOUBLE(f_px, left.f_px);
    for (int i = 0; i < 1000; i++) {
        const double z_m = 1 + 4 * shef_test_random_unit(&randomness);
        const double p_m[3] = { z_m * .6 * (shef_test_random_unit(&randomness) - .5),
                                z_m * .5 * (shef_test_random_unit(&randomness) - .5), z_m };
        const double *r = left.r_camera_rectified;
        /* Depth along the rectified axis, which is the third column. */
        const double depth_m = r[2] * p_m[0] + r[5] * p_m[1] + r[8] * p_m[2];
        double left_px[2];
        double right_px[2];

        see(&rig, &left, &right, p_m, left_px, right_px);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, left_px[1], right_px[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, f_px * baseline_m / depth_m, left_px[0] - right_px[0]);
    }
}

static void test_points_lie_on_the_same_row_with_the_disparity_of_their_depth(void)
{
    expect_rows_and_depths("wide", 555);
    expect_rows_and_depths("paper", 1301);
}

static void test_the_views_look_where_the_cameras_look(void)
{
    const struct shef_calibration rig = crooked_rig();
    struct shef_rectification left;
    struct shef_rectification right;
    double baseline_m;
    double x_px = 0;
    double y_px = 0;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_rectification_pair(&rig, "wide", &left, &right, &baseline_m, NULL));
    /* Two degrees are 20 px; neither view is turned over or away. */
    TEST_ASSERT_TRUE(shef_rectification_project(&left, 319.5, 239.5, &x_px, &y_px));
    TEST_ASSERT_DOUBLE_WITHIN(70, 1030, x_px);
    TEST_ASSERT_DOUBLE_WITHIN(70, 760, y_px);
    TEST_ASSERT_TRUE(shef_rectification_project(&right, 319.5, 239.5, &x_px, &y_px));
    TEST_ASSERT_DOUBLE_WITHIN(30, 325, x_px);
    TEST_ASSERT_DOUBLE_WITHIN(30, 236, y_px);
}

static void test_an_aligned_rig_needs_no_rotation(void)
{
    struct shef_calibration rig = crooked_rig();
    const struct shef_rigid identity = shef_rigid_identity();
    struct shef_rectification left;
    struct shef_rectification right;
    double baseline_m;

    rig.t_event_frame = identity;
    rig.t_event_frame.t_m[0] = -.06544;
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_rectification_pair(&rig, "wide", &left, &right, &baseline_m, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(.06544, baseline_m);
    for (int i = 0; i < 9; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(identity.r[i], left.r_camera_rectified[i]);
        TEST_ASSERT_EQUAL_DOUBLE(identity.r[i], right.r_camera_rectified[i]);
    }
}

static void expect_refused(const struct shef_calibration *rig, const char *profile,
                           const char *reason)
{
    struct shef_rectification left;
    struct shef_rectification right;
    struct shef_error err = { 0 };
    double baseline_m;

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_rectification_pair(rig, profile, &left, &right, &baseline_m, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_what_is_no_stereo_pair_is_refused_with_a_sentence(void)
{
    struct shef_calibration rig = crooked_rig();

    expect_refused(&rig, "narrow", "'wide' and 'paper'");
    rig.t_event_frame.t_m[0] = .065; /* left and right mixed up */
    expect_refused(&rig, "wide", "to its right");
    rig.t_event_frame.t_m[0] = -65.44; /* millimetres */
    expect_refused(&rig, "wide", "0.001 to 1 m");
    rig = crooked_rig();
    rig.t_event_frame =
        shef_rigid_from_rotation_vector((double[3]){ .6, 0, 0 }, (double[3]){ -.065, 0, 0 });
    expect_refused(&rig, "wide", "more than 30 degrees apart");
    rig = crooked_rig();
    rig.event.model.fx_px = 0;
    expect_refused(&rig, "wide", "focal lengths");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_points_lie_on_the_same_row_with_the_disparity_of_their_depth);
    RUN_TEST(test_the_views_look_where_the_cameras_look);
    RUN_TEST(test_an_aligned_rig_needs_no_rotation);
    RUN_TEST(test_what_is_no_stereo_pair_is_refused_with_a_sentence);
    return UNITY_END();
}
