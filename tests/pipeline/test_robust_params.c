/* Which matchers can be made, and what they take. */
#include "pipeline/robust.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/cpu.h"
#include "robust_cases.h"

static struct shef_robust_params base(void)
{
    return shef_robust_defaults(640, 480, SHEF_EDGE_UNSIGNED);
}

static void expect_refused(struct shef_robust_params params, const char *reason)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_NULL(shef_robust_create(&params, shef_cpu_features(), NULL, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_INVALID, err.code, err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
    TEST_ASSERT_NULL(strchr(err.text, '\n'));
    /* The sentence is optional. */
    TEST_ASSERT_NULL(shef_robust_create(&params, shef_cpu_features(), NULL, NULL));
}

static void expect_accepted(struct shef_robust_params params)
{
    shef_robust_destroy(matcher_create(&params, NULL));
}

/* Both ends of a range are in it, the next numbers outside are not. */
#define EXPECT_RANGE(field, low, high, below, above, reason)                                       \
    do {                                                                                           \
        struct shef_robust_params params = base();                                                 \
        params.field = (low);                                                                      \
        expect_accepted(params);                                                                   \
        params.field = (high);                                                                     \
        expect_accepted(params);                                                                   \
        params.field = (below);                                                                    \
        expect_refused(params, reason);                                                            \
        params.field = (above);                                                                    \
        expect_refused(params, reason);                                                            \
    } while (0)

static void test_every_parameter_has_a_range_and_a_sentence(void)
{
    EXPECT_RANGE(max_disparity_px, 16, 256, 14, 258, "largest disparity (px) is");
    EXPECT_RANGE(step_px, 1, 2, 0, 3, "disparity step (px) is");
    EXPECT_RANGE(window_width_cells, 1, 31, -1, 33, "window width (cells) is");
    EXPECT_RANGE(window_height_cells, 1, 31, -1, 33, "window height (cells) is");
    EXPECT_RANGE(regularisation, 0.005, 0.5, 0.0049, 0.51, "regularisation is");
    EXPECT_RANGE(p1, 1, base().p2, 0, 5000, "p1 is");
    EXPECT_RANGE(p2, base().p1, 4000, base().p1 - 1, 5000, "p2 is");
    EXPECT_RANGE(prior_cost_per_px, 0.0, 64.0, -0.1, 64.1, "prior cost per px is");
    EXPECT_RANGE(saturated_cost_per_px, 0.0, 64.0, -0.1, 64.1, "saturated cost per px is");
    EXPECT_RANGE(prior_cap_px, 0.0, 31.0, -0.1, 31.1, "prior cap (px) is");
    EXPECT_RANGE(score_weight, 0.0, 64.0, -0.1, 64.1, "score weight is");
    EXPECT_RANGE(confidence_scale, 0.1, 10.0, 0.05, 10.1, "confidence scale is");
    EXPECT_RANGE(confidence_offset, -10.0, 10.0, -10.1, 10.1, "confidence offset is");
    EXPECT_RANGE(jump_reach_px, 0, SHEF_ROBUST_MAX_REACH_PX, -1, SHEF_ROBUST_MAX_REACH_PX + 1,
                 "jump reach (px) is");
    EXPECT_RANGE(jump_least_px, 0.25, 16.0, 0.2, 16.1, "least jump (px) is");
    EXPECT_RANGE(jump_picture_weight, 0.0, 64.0, -0.1, 64.1, "jump picture weight is");
    EXPECT_RANGE(jump_growth_cost, 0.0, 64.0, -0.1, 64.1, "jump growth cost is");
    EXPECT_RANGE(saturated_share, 0.0, 1.0, -0.1, 1.1, "saturated share is");
}

static void test_sizes_have_a_range_and_a_sentence(void)
{
    struct shef_robust_params params = base();

    params.max_disparity_px = 16;
    params.width_px = 32;
    params.height_px = 32;
    expect_accepted(params);
    params.width_px = 4096;
    expect_accepted(params);
    params.width_px = 4097;
    expect_refused(params, "width (px) is 4097, must be 32 to 4096");
    params.width_px = 31;
    expect_refused(params, "width (px) is 31");
    params.width_px = 32;
    params.height_px = 4096;
    expect_accepted(params);
    params.height_px = 4097;
    expect_refused(params, "height (px) is");
    params.height_px = 31;
    expect_refused(params, "height (px) is");
    params.height_px = INT32_MIN;
    expect_refused(params, "height (px) is");
}

static void test_numbers_that_are_none_are_refused(void)
{
    struct shef_robust_params params = base();

    params.regularisation = (double)NAN;
    expect_refused(params, "regularisation is");
    params = base();
    params.prior_cap_px = (double)NAN;
    expect_refused(params, "prior cap (px) is");
    params = base();
    params.prior_cost_per_px = (double)INFINITY;
    expect_refused(params, "prior cost per px is");
}

static void test_parameters_that_do_not_fit_each_other_are_refused(void)
{
    struct shef_robust_params params = base();

    params.window_height_cells = 11;
    params.window_width_cells = 14;
    expect_refused(params, "14 x 11 cells has no centre");
    params.window_width_cells = 11;
    params.window_height_cells = 14;
    expect_refused(params, "11 x 14 cells has no centre");
    params = base();
    params.max_disparity_px = 81;
    expect_refused(params, "81 px is no multiple of the step, 2 px");
    params.step_px = 1;
    expect_accepted(params);
    params = base();
    params.width_px = 80;
    expect_refused(params, "more than the image is wide (80 px)");
    params.width_px = 81;
    expect_accepted(params);
}

static void test_the_instruction_set_is_the_best_that_is_allowed(void)
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const uint32_t features = shef_cpu_features_of(names[i]);
        const struct shef_robust_params params = base();
        struct shef_error err = { 0 };

        if ((features & shef_cpu_features()) != features)
            continue;

        struct shef_robust *matcher = shef_robust_create(&params, features, NULL, &err);

        TEST_ASSERT_NOT_NULL_MESSAGE(matcher, err.text);
        TEST_ASSERT_EQUAL_STRING(names[i], shef_robust_isa(matcher));
        shef_robust_destroy(matcher);
    }
}

static void test_every_stage_has_a_name_of_its_own(void)
{
    for (int a = 0; a < SHEF_ROBUST_N_STAGES; a++)
        for (int b = 0; b < a; b++)
            TEST_ASSERT_TRUE(strcmp(shef_robust_stage_name((enum shef_robust_stage)a),
                                    shef_robust_stage_name((enum shef_robust_stage)b)) != 0);
}

static double bytes_for(int32_t width_px, int32_t height_px, int32_t max_disparity_px)
{
    struct shef_robust_params params =
        shef_robust_defaults(width_px, height_px, SHEF_EDGE_UNSIGNED);

    params.max_disparity_px = max_disparity_px;

    struct shef_robust *matcher = matcher_create(&params, NULL);
    const double bytes = (double)shef_robust_memory_bytes(matcher);

    shef_robust_destroy(matcher);
    return bytes;
}

/* Two volumes of 16 bits for a quarter of the pixels and every second disparity (and up to 16
 * more): 4 / 4 * (80 / 2 + 8) = 48 bytes a pixel at 80 px. All else is below 24 bytes a pixel. */
static void test_memory_is_as_stated(void)
{
    printf("640x480, 80 px: %.1f MB; 1280x720, 256 px: %.1f MB\n", bytes_for(640, 480, 80) / 1e6,
           bytes_for(1280, 720, 256) / 1e6);
    expect_at_most((48.0 + 24.0) * 640 * 480, bytes_for(640, 480, 80), "bytes at 640x480");
    expect_at_most((144.0 + 24.0) * 1280 * 720, bytes_for(1280, 720, 256), "bytes at 1280x720");
}

/* Within 5 %: a few buffers grow with one side only. Levels that, with the lane that ends them,
 * fill whole vectors, so that padding does not show. */
static void test_memory_grows_linearly_in_pixels_and_disparities(void)
{
    const double at_62 = bytes_for(640, 480, 62);
    const double at_126 = bytes_for(640, 480, 126);
    const double at_254 = bytes_for(640, 480, 254);

    TEST_ASSERT_DOUBLE_WITHIN(0.1 * (at_126 - at_62), 2.0 * (at_126 - at_62), at_254 - at_126);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * at_62, 2.0 * at_62, bytes_for(640, 960, 62));
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * at_62, 2.0 * at_62, bytes_for(1280, 480, 62));
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * at_62, 4.0 * at_62, bytes_for(1280, 960, 62));
}

static void test_no_matcher_can_be_destroyed(void)
{
    shef_robust_destroy(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_parameter_has_a_range_and_a_sentence);
    RUN_TEST(test_sizes_have_a_range_and_a_sentence);
    RUN_TEST(test_numbers_that_are_none_are_refused);
    RUN_TEST(test_parameters_that_do_not_fit_each_other_are_refused);
    RUN_TEST(test_the_instruction_set_is_the_best_that_is_allowed);
    RUN_TEST(test_every_stage_has_a_name_of_its_own);
    RUN_TEST(test_memory_is_as_stated);
    RUN_TEST(test_memory_grows_linearly_in_pixels_and_disparities);
    RUN_TEST(test_no_matcher_can_be_destroyed);
    return UNITY_END();
}
