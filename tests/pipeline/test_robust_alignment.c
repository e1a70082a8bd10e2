/* The vertical residual and the declared bias inside the matcher: measured on the way, or given. */
#include "pipeline/robust.h"

#include <math.h>
#include <stdio.h>

#include "robust_cases.h"

#define WIDTH_PX  320
#define HEIGHT_PX 240
#define N_PAIRS   6

/* About the real rig's: tilted and bent, 0.2 to 2.6 px. */
static const struct shef_smooth_field rig = { .c = { 1.56, -0.63, 0.60, -0.06, -0.41, -0.21 },
                                              .width_px = WIDTH_PX,
                                              .height_px = HEIGHT_PX };

static struct shef_robust *matcher;
static struct shef_robust *other;

void tearDown(void)
{
    shef_robust_destroy(matcher);
    shef_robust_destroy(other);
    matcher = other = NULL;
}

static struct scene scene_at(enum shef_edge_kind kind, int i)
{
    return (struct scene){
        .kind = kind,
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .surface = SURFACE_SLANTED,
        .near_px = 22.0,
        .far_px = 10.0,
        .texture = 61,
        .pan_px = 2.0 * i,
        .noise = 0.4,
        .residual = &rig,
    };
}

static struct shef_robust *create_matcher(enum shef_edge_kind kind)
{
    const struct shef_robust_params params = shef_robust_defaults(WIDTH_PX, HEIGHT_PX, kind);

    return matcher_create(&params, NULL);
}

/* Mean distance between two fields over the image. */
static double distance_px(const struct shef_smooth_field *a, const struct shef_smooth_field *b)
{
    double sum = 0.0;
    int32_t n = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y += 8)
        for (int32_t x = 0; x < WIDTH_PX; x += 8, n++)
            sum += fabs(shef_field_at(a, x, y) - shef_field_at(b, x, y));
    return sum / n;
}

static void test_a_residual_is_measured_from_the_first_pair_on(void)
{
    for (int kind = 0; kind < 3; kind++) {
        matcher = create_matcher((enum shef_edge_kind)kind);
        shef_robust_align_auto(matcher);
        for (int i = 0; i < N_PAIRS; i++) {
            const struct scene scene = scene_at((enum shef_edge_kind)kind, i);
            struct edges edges = edges_of_scene(&scene);
            struct result result = match(matcher, &edges, i);
            const double away_px = distance_px(&result.report.alignment, &rig);

            printf("kind %d, pair %d: residual off by %.3f px, spread %.3f px\n", kind, i, away_px,
                   result.report.alignment_spread_px);
            expect_at_most(0.25, away_px, "distance from the true residual (px)");
            expect_at_most(0.4, result.report.alignment_spread_px, "spread of the blocks (px)");
            result_destroy(&result);
            edges_destroy(&edges);
        }
        tearDown();
    }
}

/* Edges are 3 px wide: what is 1.7 to 3.3 px away has little in common with them. */
static const struct shef_smooth_field far_off = { .c = { 2.5, -0.4, 0.4 },
                                                  .width_px = WIDTH_PX,
                                                  .height_px = HEIGHT_PX };

static double mean_error_px(enum shef_edge_kind kind, bool is_auto)
{
    struct scene scene = scene_at(kind, 0);

    scene.residual = &far_off;

    struct edges edges = edges_of_scene(&scene);
    double mean_px;

    matcher = create_matcher(kind);
    if (is_auto)
        shef_robust_align_auto(matcher);

    struct result result = match(matcher, &edges, 1);

    mean_px = error_of(&scene, &result, 12, 0).mean_px;
    result_destroy(&result);
    edges_destroy(&edges);
    tearDown();
    return mean_px;
}

static void test_alignment_helps_from_the_first_pair_on(void)
{
    for (int kind = 0; kind < 3; kind++) {
        const double without_px = mean_error_px((enum shef_edge_kind)kind, false);
        const double with_px = mean_error_px((enum shef_edge_kind)kind, true);

        printf("kind %d: mean error %.3f px aligned, %.3f px not\n", kind, with_px, without_px);
        expect_at_most(0.35, with_px, "mean error, aligned (px)");
        expect_at_most(without_px, 2.0 * with_px, "twice that (px)");
    }
}

/* A blank first pair tells nothing: it is matched as it is, and the next one measures. */
static void test_a_blank_pair_leaves_the_alignment_as_it_is(void)
{
    struct edges blank = edges_create(SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX);
    const struct shef_smooth_field none = { .width_px = WIDTH_PX, .height_px = HEIGHT_PX };

    matcher = create_matcher(SHEF_EDGE_UNSIGNED);
    shef_robust_align_auto(matcher);
    for (int i = 0; i < N_PAIRS; i++) {
        const struct scene scene = scene_at(SHEF_EDGE_UNSIGNED, i);
        struct edges edges = edges_of_scene(&scene);
        struct result result = match(matcher, i == 0 || i == 4 ? &blank : &edges, i);

        if (i < 2)
            TEST_ASSERT_EQUAL_MEMORY(&none, &result.report.alignment, sizeof none);
        else
            expect_at_most(0.4, distance_px(&result.report.alignment, &rig), "distance (px)");
        result_destroy(&result);
        edges_destroy(&edges);
    }
    edges_destroy(&blank);
}

/* What the right map is after its residual is taken out, by the definition: row y from row
 * y - v, the nearest, 8 px at a time. */
static struct shef_edge_map moved(const struct shef_edge_map *map,
                                  const struct shef_smooth_field *field)
{
    struct edges edges = edges_create(map->kind, map->width_px, map->height_px);

    shef_edge_map_destroy(&edges.left);
    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++) {
            const double v = shef_field_at(field, x / 8 * 8 + 3.5, y);

            edge_set(&edges.right, x, y, edge_at(map, x, y - (int32_t)lrint(v)));
        }
    return edges.right;
}

static void expect_alignment_does_what_the_field_says(enum shef_edge_kind kind,
                                                      const struct shef_smooth_field *field)
{
    const struct scene scene = scene_at(kind, 0);
    struct edges edges = edges_of_scene(&scene);
    struct edges by_hand = { edges.left, moved(&edges.right, field) };

    matcher = create_matcher(kind);
    other = create_matcher(kind);
    shef_robust_align_fixed(matcher, field);

    struct result actual = match(matcher, &edges, 1);
    struct result expected = match(other, &by_hand, 1);

    expect_same_result(&expected, &actual);
    TEST_ASSERT_EQUAL_MEMORY(field, &actual.report.alignment, sizeof *field);
    result_destroy(&actual);
    result_destroy(&expected);
    shef_edge_map_destroy(&by_hand.right);
    edges_destroy(&edges);
    tearDown();
}

static void test_a_given_field_moves_the_right_map_as_it_says(void)
{
    static const double shifts[] = { 3.0, -2.0, 0.4, 300.0 };

    for (size_t i = 0; i < sizeof shifts / sizeof shifts[0]; i++) {
        const struct shef_smooth_field flat = { .c = { shifts[i] },
                                                .width_px = WIDTH_PX,
                                                .height_px = HEIGHT_PX };

        expect_alignment_does_what_the_field_says(SHEF_EDGE_UNSIGNED, &flat);
    }
    for (int kind = 0; kind < 3; kind++)
        expect_alignment_does_what_the_field_says((enum shef_edge_kind)kind, &rig);
}

static void test_a_given_field_can_be_taken_back(void)
{
    const struct scene scene = scene_at(SHEF_EDGE_UNSIGNED, 0);
    struct edges edges = edges_of_scene(&scene);

    matcher = create_matcher(SHEF_EDGE_UNSIGNED);
    other = create_matcher(SHEF_EDGE_UNSIGNED);
    shef_robust_align_fixed(matcher, &rig);
    shef_robust_align_fixed(matcher, NULL);

    struct result actual = match(matcher, &edges, 1);
    struct result expected = match(other, &edges, 1);

    expect_same_result(&expected, &actual);
    result_destroy(&actual);
    result_destroy(&expected);
    edges_destroy(&edges);
}

static void test_a_bias_is_taken_off_every_disparity(void)
{
    const struct scene scene = scene_at(SHEF_EDGE_UNSIGNED, 0);
    const struct shef_smooth_field bias = { .c = { -3.1, -3.0, 2.1, -1.2, 5.7, 3.4 },
                                            .width_px = WIDTH_PX,
                                            .height_px = HEIGHT_PX };
    struct edges edges = edges_of_scene(&scene);

    matcher = create_matcher(SHEF_EDGE_UNSIGNED);
    other = create_matcher(SHEF_EDGE_UNSIGNED);
    shef_robust_set_bias(matcher, &bias);

    struct result with = match(matcher, &edges, 1);
    struct result without = match(other, &edges, 1);

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const float d = shef_row_f32(without.images.dense_disparity, y)[x];
            const float expected = d - (float)shef_field_at(&bias, x, y);

            TEST_ASSERT_FLOAT_WITHIN(1e-3f, expected > 0.0f ? expected : 0.0f,
                                     shef_row_f32(with.images.dense_disparity, y)[x]);
        }
    result_destroy(&with);
    result_destroy(&without);
    edges_destroy(&edges);
}

/* A bias larger than the disparity itself: beyond infinity there is nothing to report. */
static void test_a_bias_beyond_infinity_leaves_no_estimate(void)
{
    const struct scene scene = scene_at(SHEF_EDGE_UNSIGNED, 0);
    const struct shef_smooth_field bias = { .c = { 16.0 },
                                            .width_px = WIDTH_PX,
                                            .height_px = HEIGHT_PX };
    struct edges edges = edges_of_scene(&scene);
    int64_t n_none = 0;

    matcher = create_matcher(SHEF_EDGE_UNSIGNED);
    shef_robust_set_bias(matcher, &bias);

    struct result result = match(matcher, &edges, 1);

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const float d = shef_row_f32(result.images.dense_disparity, y)[x];
            const float p = shef_row_f32(result.images.dense_confidence, y)[x];

            TEST_ASSERT_TRUE(d >= 0.0f);
            TEST_ASSERT_EQUAL(d > 0.0f, p > 0.0f);
            n_none += d == 0.0f;
        }
    TEST_ASSERT_GREATER_THAN_INT64(WIDTH_PX * HEIGHT_PX / 4, n_none);
    result_destroy(&result);
    edges_destroy(&edges);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_residual_is_measured_from_the_first_pair_on);
    RUN_TEST(test_alignment_helps_from_the_first_pair_on);
    RUN_TEST(test_a_blank_pair_leaves_the_alignment_as_it_is);
    RUN_TEST(test_a_given_field_moves_the_right_map_as_it_says);
    RUN_TEST(test_a_given_field_can_be_taken_back);
    RUN_TEST(test_a_bias_is_taken_off_every_disparity);
    RUN_TEST(test_a_bias_beyond_infinity_leaves_no_estimate);
    return UNITY_END();
}
