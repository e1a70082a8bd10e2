/* The robust matcher at the ends of what its header allows. */
#include "pipeline/robust.h"

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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_residual_higher_than_the_image_leaves_no_right_map);
    return UNITY_END();
}
