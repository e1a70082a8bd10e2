/* What may change while a matcher runs, and the parameters that the depth chain sets. */
#include "core/workers.h"
#include "robust_cases.h"

static struct shef_robust_params params_of(enum shef_edge_kind kind)
{
    struct shef_robust_params params = shef_robust_defaults(200, 96, kind);

    params.max_disparity_px = 47;
    params.step_px = 1;
    params.window_width_cells = params.window_height_cells = 5;
    params.use_past = false;
    return params;
}

static struct scene scene_at(double disparity_px)
{
    return (struct scene){ .kind = SHEF_EDGE_GRADED,
                           .width_px = 200,
                           .height_px = 96,
                           .surface = SURFACE_CONSTANT,
                           .near_px = disparity_px,
                           .texture = 7,
                           .noise = 0.05 };
}

static void test_a_cut_range_is_like_a_matcher_made_for_it(void)
{
    const struct scene scene = scene_at(11.3);
    struct edges edges = edges_of_scene(&scene);
    struct shef_workers *workers = shef_workers_create(3, NULL);
    struct shef_robust_params params = params_of(SHEF_EDGE_GRADED);
    struct shef_robust *whole = matcher_create(&params, workers);
    struct shef_robust *small;
    struct result first = match(whole, &edges, 1);

    params.max_disparity_px = 23;
    small = matcher_create(&params, NULL);
    shef_robust_set_max_disparity(whole, 23);

    struct result expected = match(small, &edges, 1);
    struct result cut = match(whole, &edges, 3);

    expect_same_result(&expected, &cut);
    shef_robust_set_max_disparity(whole, 47);

    struct result again = match(whole, &edges, 5);

    expect_same_result(&first, &again);
    result_destroy(&first);
    result_destroy(&expected);
    result_destroy(&cut);
    result_destroy(&again);
    shef_robust_destroy(small);
    shef_robust_destroy(whole);
    shef_workers_destroy(workers);
    edges_destroy(&edges);
}

static void test_the_pairs_own_scores_make_fractions_more_exact(void)
{
    double sums_px = 0;
    double scores_px = 0;

    for (int i = 0; i < 8; i++) {
        const struct scene scene = scene_at(12 + i / 8.0);
        struct edges edges = edges_of_scene(&scene);
        struct shef_robust_params params = params_of(SHEF_EDGE_GRADED);

        for (int has_scores = 0; has_scores < 2; has_scores++) {
            params.score_weight = has_scores ? 16 : 0;
            struct shef_robust *matcher = matcher_create(&params, NULL);
            struct result result = match(matcher, &edges, 1);

            *(has_scores ? &scores_px : &sums_px) += error_of(&scene, &result, 12, 0).mean_px / 8;
            result_destroy(&result);
            shef_robust_destroy(matcher);
        }
        edges_destroy(&edges);
    }
    expect_at_most(sums_px, scores_px, "mean error with the scores");
    expect_at_most(0.12, scores_px, "mean error with the scores");
}

static void test_confidence_moves_as_told(void)
{
    const struct scene scene = scene_at(11.3);
    struct edges edges = edges_of_scene(&scene);
    struct shef_robust_params params = params_of(SHEF_EDGE_GRADED);
    struct shef_robust *plain = matcher_create(&params, NULL);
    struct result before = match(plain, &edges, 1);

    params.confidence_offset = -1;
    struct shef_robust *doubtful = matcher_create(&params, NULL);
    struct result after = match(doubtful, &edges, 1);
    int64_t n_less = 0;
    int64_t n = 0;

    for (int32_t y = 0; y < scene.height_px; y++)
        for (int32_t x = 0; x < scene.width_px; x++) {
            const float was = shef_row_f32(before.images.dense_confidence, y)[x];
            const float is = shef_row_f32(after.images.dense_confidence, y)[x];

            TEST_ASSERT_EQUAL_FLOAT(shef_row_f32(before.images.dense_disparity, y)[x],
                                    shef_row_f32(after.images.dense_disparity, y)[x]);
            TEST_ASSERT_TRUE(is <= was);
            n_less += is < was;
            n++;
        }
    TEST_ASSERT_EQUAL_INT64(n, n_less);
    result_destroy(&before);
    result_destroy(&after);
    shef_robust_destroy(plain);
    shef_robust_destroy(doubtful);
    edges_destroy(&edges);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_cut_range_is_like_a_matcher_made_for_it);
    RUN_TEST(test_the_pairs_own_scores_make_fractions_more_exact);
    RUN_TEST(test_confidence_moves_as_told);
    return UNITY_END();
}
