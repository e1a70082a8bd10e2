/* The robust matcher at the ends of what its header allows. */
#include "pipeline/robust.h"

#include <stdlib.h>

#include "robust_cases.h"

#define WIDTH_PX  96
#define HEIGHT_PX 64

static const struct scene scene = {
    .kind = SHEF_EDGE_UNSIGNED,
    .width_px = WIDTH_PX,
    .height_px = HEIGHT_PX,
    .surface = SURFACE_CONSTANT,
    .near_px = 16.0,
    .texture = 17,
};

static struct result match_with_field(const struct edges *edges,
                                      const struct shef_smooth_field *field)
{
    const struct shef_robust_params params =
        shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_UNSIGNED);
    struct shef_robust *matcher = matcher_create(&params, NULL);

    shef_robust_align_fixed(matcher, field);

    struct result result = match(matcher, edges, 1);

    shef_robust_destroy(matcher);
    return result;
}

static void test_a_residual_higher_than_the_image_leaves_no_right_map(void)
{
    static const double far_px[] = { HEIGHT_PX, -HEIGHT_PX, 3e9, -3e9, 1e300, -1e300 };
    struct edges edges = edges_of_scene(&scene);
    struct edges blank = edges_create(SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX);
    const struct edges no_right = { edges.left, blank.right };
    struct result expected = match_with_field(&no_right, NULL);

    for (size_t i = 0; i < sizeof far_px / sizeof far_px[0]; i++) {
        const struct shef_smooth_field field = { .c = { far_px[i] },
                                                 .width_px = WIDTH_PX,
                                                 .height_px = HEIGHT_PX };
        struct result result = match_with_field(&edges, &field);

        expect_same_result(&expected, &result);
        result_destroy(&result);
    }
    result_destroy(&expected);
    edges_destroy(&edges);
    edges_destroy(&blank);
}

static void test_measuring_anew_forgets_the_spread(void)
{
    const struct shef_robust_params params = shef_robust_defaults(320, 240, SHEF_EDGE_UNSIGNED);
    const struct scene large = {
        .width_px = 320, .height_px = 240, .near_px = 16.0, .texture = 17, .noise = 0.3
    };
    struct edges edges = edges_of_scene(&large);
    struct edges blank = edges_create(SHEF_EDGE_UNSIGNED, 320, 240);
    struct shef_robust *matcher = matcher_create(&params, NULL);

    shef_robust_align_auto(matcher);

    struct result measured = match(matcher, &edges, 1);

    TEST_ASSERT_TRUE(measured.report.alignment_spread_px > 0.0);
    shef_robust_align_auto(matcher);

    struct result unknown = match(matcher, &blank, 2);

    TEST_ASSERT_EQUAL_DOUBLE(0.0, unknown.report.alignment_spread_px);
    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        TEST_ASSERT_EQUAL_DOUBLE(0.0, unknown.report.alignment.c[i]);
    result_destroy(&measured);
    result_destroy(&unknown);
    edges_destroy(&edges);
    edges_destroy(&blank);
    shef_robust_destroy(matcher);
}

static void test_faint_graded_edges_have_no_estimate(void)
{
    const struct shef_robust_params params =
        shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_GRADED);
    struct edges edges = edges_create(SHEF_EDGE_GRADED, WIDTH_PX, HEIGHT_PX);
    struct shef_robust *matcher = matcher_create(&params, NULL);

    for (int32_t value = -127; value <= 127; value++)
        edge_set(&edges.left, (value + 127) % 64 + 20, (value + 127) / 64 * 8 + 8, value);

    struct result result = match(matcher, &edges, 1);

    for (int32_t value = -127; value <= 127; value++) {
        const float *row = shef_row_f32(result.images.disparity, (value + 127) / 64 * 8 + 8);

        TEST_ASSERT_EQUAL(abs(value) >= 6, row[(value + 127) % 64 + 20] > 0.0f);
    }
    result_destroy(&result);
    edges_destroy(&edges);
    shef_robust_destroy(matcher);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_measuring_anew_forgets_the_spread);
    RUN_TEST(test_faint_graded_edges_have_no_estimate);
    RUN_TEST(test_a_residual_higher_than_the_image_leaves_no_right_map);
    return UNITY_END();
}
