/* The rig's geometry: what both cameras see, against the truth about it. */
#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/time.h"
#include "shefsim/rig_parts.h"
#include "small_rig.h"
#include "support/support.h"

static struct sim_rig *rig;

void tearDown(void)
{
    sim_rig_destroy(rig);
    rig = NULL;
}

static void make(const struct sim_rig_settings *settings)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT_MESSAGE(
        SHEF_OK, sim_rig_create(&rig, settings, shef_cpu_features(), NULL, &err), err.text);
}

static double at(struct shef_image_f32 image, double x, double y)
{
    const int32_t x0 = (int32_t)x;
    const int32_t y0 = (int32_t)y;
    const float *upper = shef_row_f32(image, y0);
    const float *lower = shef_row_f32(image, y0 + 1);
    const double fx = x - x0;
    const double fy = y - y0;

    return (1 - fy) * ((1 - fx) * (double)upper[x0] + fx * (double)upper[x0 + 1]) +
           fy * ((1 - fx) * (double)lower[x0] + fx * (double)lower[x0 + 1]);
}

static bool is_inside(struct shef_image_f32 image, double x, double y)
{
    return x >= 0 && y >= 0 && x < image.width_px - 1 && y < image.height_px - 1;
}

/* Mean difference of the light (in logarithms) that both raw cameras see at points that truth says
 * are the same, with all disparities wrong by so much. */
static double mean_difference(double wrong_px, int32_t *out_n)
{
    const struct sim_rig_maps *truth = &rig->truth[SHEF_TRUTH_LEFT];
    double sum = 0;
    int32_t n = 0;

    for (int32_t y = 4; y < rig->left.height_px; y += 3)
        for (int32_t x = 4; x < rig->left.width_px; x += 3) {
            const double right_x = x - (double)shef_row_f32(truth->disparity_px, y)[x] - wrong_px;
            double fx, fy, ex, ey;

            if (shef_row_u8(truth->mask, y)[x] != SHEF_TRUTH_VALID ||
                !shef_rectification_project(&rig->left, x, y, &fx, &fy) ||
                !shef_rectification_project(&rig->right, right_x, y, &ex, &ey) ||
                !is_inside(rig->frame_light, fx, fy) || !is_inside(rig->event_light, ex, ey))
                continue;
            sum += fabs(log(at(rig->frame_light, fx, fy) + 0.01) -
                        log(at(rig->event_light, ex, ey) + 0.01));
            n++;
        }
    *out_n = n;
    return sum / n;
}

static void test_both_cameras_see_the_same_where_truth_says_so(void)
{
    struct sim_rig_settings settings = small_rig_settings();
    struct sim_rig_frame frame;
    int32_t n;

    settings.speed_m_s = 0.001;
    make(&settings);
    frame = sim_rig_frame_at(rig, 1);

    const int64_t middle_ns = (frame.start_ns + frame.end_ns) / 2;

    sim_rig_see_frame(rig, &frame);
    sim_rig_see_events(rig, middle_ns);
    sim_rig_see_truth(rig, middle_ns);

    const double right = mean_difference(0, &n);

    TEST_ASSERT_GREATER_THAN_INT32(25000, n);
    /* What is left is that one pixel of the event camera covers five of the frame camera. */
    TEST_ASSERT_TRUE(right < 0.03);
    TEST_ASSERT_TRUE(mean_difference(0.5, &n) > 1.3 * right);
    TEST_ASSERT_TRUE(mean_difference(-0.5, &n) > 1.3 * right);
    TEST_ASSERT_TRUE(mean_difference(2, &n) > 3 * right);
    TEST_ASSERT_TRUE(mean_difference(-2, &n) > 3 * right);
}

static void test_disparity_is_baseline_times_focal_length_by_depth(void)
{
    const struct sim_rig_settings settings = small_rig_settings();

    make(&settings);
    sim_rig_see_truth(rig, 50000000);
    TEST_ASSERT_DOUBLE_WITHIN(0.00005, 0.06544, rig->baseline_m);
    for (int32_t view = 0; view < SHEF_TRUTH_VIEWS; view++) {
        const struct sim_rig_maps *maps = &rig->truth[view];

        for (int32_t y = 0; y < rig->left.height_px; y++)
            for (int32_t x = 0; x < rig->left.width_px; x++) {
                const double depth_m = shef_row_f32(maps->depth_m, y)[x];

                TEST_ASSERT_TRUE(depth_m > 1.2 && depth_m < 3.3);
                TEST_ASSERT_DOUBLE_WITHIN(1e-4, 555 * rig->baseline_m / depth_m,
                                          (double)shef_row_f32(maps->disparity_px, y)[x]);
            }
    }
}

/* Going from left to right and back ends where it began, unless something is in front. */
static void test_occlusion_is_where_views_disagree(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    int32_t n_occluded = 0;
    int32_t n_visible = 0;
    int32_t n_lost = 0;

    make(&settings);
    sim_rig_see_truth(rig, 0);
    for (int32_t y = 0; y < rig->left.height_px; y++)
        for (int32_t x = 0; x < rig->left.width_px; x++) {
            const uint8_t mask = shef_row_u8(rig->truth[SHEF_TRUTH_LEFT].mask, y)[x];
            const double d = shef_row_f32(rig->truth[SHEF_TRUTH_LEFT].disparity_px, y)[x];
            const int32_t right_x = (int32_t)(x - d + 0.5);

            if (!(mask & SHEF_TRUTH_VALID) || right_x < 0)
                continue;

            const double back =
                d - (double)shef_row_f32(rig->truth[SHEF_TRUTH_RIGHT].disparity_px, y)[right_x];

            /* What hides something is nearer: the way back from it is longer. */
            if (mask & SHEF_TRUTH_OCCLUDED) {
                n_occluded++;
                TEST_ASSERT_TRUE(back < 1 || right_x <= 1);
            } else {
                n_visible++;
                n_lost += fabs(back) > 1;
            }
        }
    TEST_ASSERT_GREATER_THAN_INT32(200000, n_visible);
    /* The box hides 555 * 0.06544 * (1 / 1.4 - 1 / 3) or so, that is 14 px, along 260 rows. */
    TEST_ASSERT_INT32_WITHIN(2500, 14 * 260, n_occluded);
    /* Pixels at the box's outline may go either way. */
    TEST_ASSERT_LESS_THAN_INT32(1000, n_lost);
}

static void test_the_reported_hand_carries_the_camera_along_the_path(void)
{
    const struct sim_rig_settings settings = small_rig_settings();

    make(&settings);
    for (int64_t t_ns = 0; t_ns < SHEF_NS_PER_S; t_ns += 90000000) {
        const struct shef_rigid hand = sim_rig_hand(rig, t_ns);
        const struct shef_rigid camera = shef_rigid_compose(&hand, &rig->calibration.t_hand_frame);
        const struct shef_rigid base = sim_path_base();
        const struct shef_rigid world = shef_rigid_compose(&base, &camera);
        const struct shef_rigid expected = sim_path_pose(rig->path, t_ns);

        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected.t_m[i], world.t_m[i]);
        for (int i = 0; i < 9; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected.r[i], world.r[i]);
    }
}

static void test_nothing_moves_more_than_half_a_pixel_in_a_step(void)
{
    struct sim_rig_settings settings = small_rig_settings();

    settings.without_frames = true;
    settings.speed_m_s = 0.35;
    make(&settings);
    TEST_ASSERT_TRUE(rig->largest_speed_px_s > 0.35 * 555 / 1.6);
    TEST_ASSERT_TRUE(rig->largest_speed_px_s * (double)rig->step_ns * 1e-9 <= 0.5);
    TEST_ASSERT_TRUE(rig->largest_speed_px_s * (double)rig->step_ns * 1e-9 > 0.49);
    tearDown();
    settings.speed_m_s = 0.01;
    make(&settings);
    TEST_ASSERT_EQUAL_INT64(SIM_RIG_MAX_STEP_NS, rig->step_ns);
}

static void test_a_calibration_can_be_wrong_by_what_is_asked(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    const struct sim_miscalibration wrong = { .vertical_px = 0.5, .roll_deg = 0.1 };
    struct shef_calibration calibration;
    struct shef_rectification left, right;
    struct shef_error err;
    double baseline_m;
    double x, y, wrong_x, wrong_y;

    make(&settings);
    calibration = rig->calibration;
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_rig_miscalibrate(&calibration, &wrong, &err));
    TEST_ASSERT_NOT_EQUAL_INT(0, strcmp(calibration.id, rig->calibration.id));
    TEST_ASSERT_EQUAL_INT(
        SHEF_OK, shef_rectification_pair(&calibration, "wide", &left, &right, &baseline_m, &err));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, rig->baseline_m, baseline_m);
    TEST_ASSERT_TRUE(shef_rectification_project(&rig->right, 320, 240, &x, &y));
    TEST_ASSERT_TRUE(shef_rectification_project(&right, 320, 240, &wrong_x, &wrong_y));
    TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.5, wrong_y - y);
    TEST_ASSERT_TRUE(shef_rectification_project(&rig->right, 600, 240, &x, &y));
    TEST_ASSERT_TRUE(shef_rectification_project(&right, 600, 240, &wrong_x, &wrong_y));
    /* 280 px from the middle, 0.1 degrees are 0.49 px. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.49, fabs(wrong_y - y - 0.5));
}

static void test_impossible_settings_are_refused_in_a_sentence(void)
{
    struct sim_rig_settings settings = small_rig_settings();
    struct shef_error err;

    settings.exposure_ms = 24.9;
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_INVALID,
                          sim_rig_create(&rig, &settings, shef_cpu_features(), NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "too long"));
    settings = small_rig_settings();
    settings.path_size_m = 1;
    settings.tilt_deg = -60;
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_INVALID,
                          sim_rig_create(&rig, &settings, shef_cpu_features(), NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "reach"));
    settings = small_rig_settings();
    settings.scene = "no_such_scene";
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_NOT_FOUND,
                          sim_rig_create(&rig, &settings, shef_cpu_features(), NULL, &err));
    TEST_ASSERT_NULL(rig);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_both_cameras_see_the_same_where_truth_says_so);
    RUN_TEST(test_disparity_is_baseline_times_focal_length_by_depth);
    RUN_TEST(test_occlusion_is_where_views_disagree);
    RUN_TEST(test_the_reported_hand_carries_the_camera_along_the_path);
    RUN_TEST(test_nothing_moves_more_than_half_a_pixel_in_a_step);
    RUN_TEST(test_a_calibration_can_be_wrong_by_what_is_asked);
    RUN_TEST(test_impossible_settings_are_refused_in_a_sentence);
    return UNITY_END();
}
