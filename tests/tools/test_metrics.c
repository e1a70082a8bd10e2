/* Every figure of the metrics against numbers worked out by hand. */
#include <math.h>
#include <string.h>

#include "sheftool/metrics.h"
#include "support/support.h"

static const struct shef_rig rig = { 1301, 0.06544 };
static struct shef_tally tally;
static struct shef_depth_counts depth;

void setUp(void)
{
    tally = (struct shef_tally){ 0 };
    memset(&depth, 0, sizeof depth);
}

static void add(float estimate, float truth)
{
    shef_tally_add(&tally, estimate, truth, -1, &rig);
}

static struct shef_figures figures_of_closed_image(void)
{
    shef_tally_end_image(&tally);
    return shef_tally_figures(&tally);
}

static void test_errors_of_3_and_4_px_have_rmse_sqrt_12_5_and_epe_3_5(void)
{
    add(43, 40);
    add(36, 40);

    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, sqrt(12.5), figures.rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.5, figures.epe_px);
}

static void test_rmse_is_the_mean_over_images_and_not_over_pixels(void)
{
    add(41, 40); /* an image with one error of 1 px */
    shef_tally_end_image(&tally);
    for (int i = 0; i < 99; i++)
        add(45, 40); /* an image with 99 errors of 5 px */

    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.0, figures.rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4.96, figures.epe_px);
}

static void test_image_without_estimates_counts_as_seen_but_not_in_the_rmse(void)
{
    add(42, 40);
    shef_tally_end_image(&tally);

    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_EQUAL_INT64(2, tally.n_images);
    TEST_ASSERT_EQUAL_INT64(1, tally.n_images_scored);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0, figures.rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, figures.pixels_per_image);
}

static void test_a_pixel_is_bad_above_the_limit_and_not_at_it(void)
{
    add(41, 40);       /* exactly 1 */
    add(42, 40);       /* exactly 2: bad-1 */
    add(37, 40);       /* exactly 3: bad-1, bad-2 */
    add(45, 40);       /* exactly 5: all but bad-5 */
    add(45.0625f, 40); /* bad everywhere */

    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 / 5.0, figures.bad[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3 / 5.0, figures.bad[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2 / 5.0, figures.bad[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1 / 5.0, figures.bad[3]);
}

static void test_delta_takes_the_larger_ratio_and_excludes_the_limit(void)
{
    add(50, 40); /* 1.25 exactly: not within delta 1 */
    add(32, 40); /* the same, the other way round */
    add(49, 40); /* 1.225: within all */
    add(60, 40); /* 1.5: within delta 2 = 1.5625 */
    add(21, 40); /* 1.905: within delta 3 = 1.953125 */
    add(20, 40); /* 2: outside */

    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1 / 6.0, figures.delta[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 / 6.0, figures.delta[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5 / 6.0, figures.delta[2]);
}

static void test_coverage_is_found_over_wanted(void)
{
    for (int i = 0; i < 8; i++)
        shef_tally_want(&tally, i < 6);

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.75, figures_of_closed_image().coverage);
}

static void test_calibration_error_of_two_bins(void)
{
    /* Bin 0.9..1: promised 0.95 each, kept 1 of 2: |1.9 - 1| = 0.9.
     * Bin 0.2..0.3: promised 0.25 each, kept 1 of 2: |0.5 - 1| = 0.5. Sum 1.4 over 4 pixels. */
    shef_tally_add(&tally, 40, 40, 0.9375f, &rig);
    shef_tally_add(&tally, 50, 40, 0.9625f, &rig);
    shef_tally_add(&tally, 43, 40, 0.25f, &rig); /* an error of exactly 3 px is a hit */
    shef_tally_add(&tally, 43.5f, 40, 0.25f, &rig);

    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.35, figures_of_closed_image().calibration_error);
    TEST_ASSERT_EQUAL_INT64(2, tally.confidence[9].n);
    TEST_ASSERT_EQUAL_INT64(1, tally.confidence[2].n_hits);
}

static void test_confidence_of_one_belongs_to_the_last_bin(void)
{
    shef_tally_add(&tally, 40, 40, 1, &rig);
    shef_tally_add(&tally, 40, 40, 0, &rig);

    TEST_ASSERT_EQUAL_INT64(1, tally.confidence[9].n);
    TEST_ASSERT_EQUAL_INT64(1, tally.confidence[0].n);
}

static void test_pixels_without_confidence_leave_the_calibration_unknown(void)
{
    add(40, 40);

    TEST_ASSERT_TRUE(isnan(figures_of_closed_image().calibration_error));
}

static void test_depth_error_is_the_difference_of_bf_over_d(void)
{
    /* b f = 85.13744 px m, so 40 px are 212.84 cm, 41 px 207.65 cm: 5.19 cm apart. */
    tally.depth = &depth;
    add(41, 40);
    add(40, 40);
    add(41, 40);

    TEST_ASSERT_DOUBLE_WITHIN(0.006, 5.191, figures_of_closed_image().depth_median_cm);
}

static void test_median_depth_error_beyond_the_counted_range_is_infinite(void)
{
    tally.depth = &depth;
    add(1, 80); /* 85 m against 1.06 m */

    TEST_ASSERT_TRUE(isinf(figures_of_closed_image().depth_median_cm));
}

static void test_nothing_scored_is_unknown_and_not_zero(void)
{
    const struct shef_figures figures = figures_of_closed_image();

    TEST_ASSERT_TRUE(isnan(figures.rmse_px));
    TEST_ASSERT_TRUE(isnan(figures.epe_px));
    TEST_ASSERT_TRUE(isnan(figures.bad[3]));
    TEST_ASSERT_TRUE(isnan(figures.delta[0]));
    TEST_ASSERT_TRUE(isnan(figures.coverage));
}

static void test_merged_tallies_equal_one_tally_of_all_images(void)
{
    static struct shef_depth_counts part_depth[2];
    static struct shef_depth_counts sum_depth;
    struct shef_tally parts[2] = { { .depth = &part_depth[0] }, { .depth = &part_depth[1] } };
    struct shef_tally sum = { .depth = &sum_depth };
    struct shef_test_random random = shef_test_random_start();

    tally.depth = &depth;
    for (int image = 0; image < 6; image++) {
        for (int i = 0; i < 50; i++) {
            const float truth = (float)shef_test_random_range(&random, 17, 79);
            const float estimate = truth + (float)shef_test_random_range(&random, -9, 9);
            const float confidence = (float)shef_test_random_unit(&random);

            shef_tally_add(&parts[image % 2], estimate, truth, confidence, &rig);
            shef_tally_want(&parts[image % 2], i % 3);
            shef_tally_add(&tally, estimate, truth, confidence, &rig);
            shef_tally_want(&tally, i % 3);
        }
        shef_tally_end_image(&parts[image % 2]);
        shef_tally_end_image(&tally);
    }
    shef_tally_merge(&sum, &parts[0]);
    shef_tally_merge(&sum, &parts[1]);

    const struct shef_figures merged = shef_tally_figures(&sum);
    const struct shef_figures whole = shef_tally_figures(&tally);

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, whole.rmse_px, merged.rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, whole.epe_px, merged.epe_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, whole.calibration_error, merged.calibration_error);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.depth_median_cm, merged.depth_median_cm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.coverage, merged.coverage);
    for (int i = 0; i < SHEF_N_BAD; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.bad[i], merged.bad[i]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_errors_of_3_and_4_px_have_rmse_sqrt_12_5_and_epe_3_5);
    RUN_TEST(test_rmse_is_the_mean_over_images_and_not_over_pixels);
    RUN_TEST(test_image_without_estimates_counts_as_seen_but_not_in_the_rmse);
    RUN_TEST(test_a_pixel_is_bad_above_the_limit_and_not_at_it);
    RUN_TEST(test_delta_takes_the_larger_ratio_and_excludes_the_limit);
    RUN_TEST(test_coverage_is_found_over_wanted);
    RUN_TEST(test_calibration_error_of_two_bins);
    RUN_TEST(test_confidence_of_one_belongs_to_the_last_bin);
    RUN_TEST(test_pixels_without_confidence_leave_the_calibration_unknown);
    RUN_TEST(test_depth_error_is_the_difference_of_bf_over_d);
    RUN_TEST(test_median_depth_error_beyond_the_counted_range_is_infinite);
    RUN_TEST(test_nothing_scored_is_unknown_and_not_zero);
    RUN_TEST(test_merged_tallies_equal_one_tally_of_all_images);
    return UNITY_END();
}
