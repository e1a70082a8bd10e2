/* What each protocol counts, on small images made by hand. */
#include <math.h>

#include "core/memory.h"
#include "sheftool/protocol.h"
#include "support/support.h"

/* 100 px wide: columns 50..78 count. */
enum { WIDTH = 100, HEIGHT = 2 };

static const struct shef_score_rules rules = { { 1301, 0.06544 }, (float)SHEF_TRUTH_HOLE_PX };
static struct shef_image_f32 disparity;
static struct shef_image_f32 confidence;
static struct shef_image_f32 truth;
static struct shef_edge_map edges;
static struct shef_tally tally;
static struct shef_density_curve curve;

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&disparity, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&confidence, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&truth, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&edges, SHEF_EDGE_UNSIGNED, WIDTH, HEIGHT, NULL));
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(truth, y)[x] = 40;
    tally = (struct shef_tally){ 0 };
    curve = (struct shef_density_curve){ .ranked = false };
}

void tearDown(void)
{
    shef_image_destroy_f32(&disparity);
    shef_image_destroy_f32(&confidence);
    shef_image_destroy_f32(&truth);
    shef_edge_map_destroy(&edges);
}

static void set_edge(int32_t x, int32_t y)
{
    edges.plus[y * edges.stride_words + x / 64] |= UINT64_C(1) << (x % 64);
}

static void estimate(int32_t x, int32_t y, float value)
{
    shef_row_f32(disparity, y)[x] = value;
}

static struct shef_scored_map map_with(bool with_confidence)
{
    return (struct shef_scored_map){
        .disparity = disparity,
        .confidence = with_confidence ? confidence : (struct shef_image_f32){ 0 },
        .truth = truth,
        .frame_edges = &edges,
    };
}

static void score(enum shef_protocol_index protocol)
{
    const struct shef_scored_map map = map_with(false);

    shef_protocols[protocol].add(&tally, &map, &rules);
}

static void test_all_protocols_ignore_columns_left_of_50_and_right_of_width_minus_22(void)
{
    for (int32_t x = 0; x < WIDTH; x++) {
        estimate(x, 0, 40);
        set_edge(x, 0);
    }
    for (int protocol = 0; protocol < SHEF_N_PROTOCOLS; protocol++) {
        tally = (struct shef_tally){ 0 };
        score((enum shef_protocol_index)protocol);
        TEST_ASSERT_EQUAL_INT64(29, tally.n_scored);
    }
}

static void test_the_authors_last_column_at_640_px_is_618(void)
{
    TEST_ASSERT_EQUAL_INT32(618, 640 - SHEF_LAST_MARGIN_PX);
}

static void test_authors_scores_every_estimate_also_off_the_edges_and_on_truth_holes(void)
{
    estimate(60, 0, 41);
    estimate(61, 0, 41);
    shef_row_f32(truth, 0)[61] = 80; /* a hole, scored as truth */
    set_edge(60, 0);
    score(SHEF_AUTHORS);

    TEST_ASSERT_EQUAL_INT64(2, tally.n_scored);
    TEST_ASSERT_EQUAL_INT64(1, tally.n_bad[3]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, sqrt((1.0 + 39.0 * 39.0) / 2), tally.sum_rmse_px);
}

static void test_authors_coverage_is_the_share_of_edge_pixels_with_an_estimate(void)
{
    set_edge(60, 0);
    set_edge(61, 0);
    set_edge(62, 1);
    set_edge(10, 0); /* outside the columns */
    estimate(60, 0, 40);
    estimate(70, 0, 40); /* off the edges */
    score(SHEF_AUTHORS);

    TEST_ASSERT_EQUAL_INT64(3, tally.n_wanted);
    TEST_ASSERT_EQUAL_INT64(1, tally.n_found);
}

static void test_density_scores_edge_pixels_with_truth_below_the_hole_mark(void)
{
    set_edge(60, 0);
    set_edge(61, 0);
    set_edge(62, 0);
    estimate(60, 0, 42);
    estimate(61, 0, 42);
    estimate(63, 0, 42);             /* off the edges */
    shef_row_f32(truth, 0)[61] = 80; /* a hole */
    score(SHEF_DENSITY);

    TEST_ASSERT_EQUAL_INT64(1, tally.n_scored);
    TEST_ASSERT_EQUAL_INT64(2, tally.n_wanted);
}

static void test_dense_wants_every_pixel_with_truth(void)
{
    shef_row_f32(truth, 0)[60] = 79.95f; /* a hole */
    shef_row_f32(truth, 0)[61] = 0;      /* no truth */
    estimate(60, 0, 40);
    estimate(61, 0, 40);
    estimate(62, 0, 40);
    score(SHEF_DENSE);

    TEST_ASSERT_EQUAL_INT64(2 * 29 - 2, tally.n_wanted);
    TEST_ASSERT_EQUAL_INT64(1, tally.n_scored);
}

/* Eight edges with estimates; the error grows as the confidence falls. */
static void make_ranked_row(void)
{
    for (int32_t i = 0; i < 8; i++) {
        set_edge(50 + 2 * i, 0);
        estimate(50 + 2 * i, 0, 40 + (float)i);
        shef_row_f32(confidence, 0)[50 + 2 * i] = 0.9f - 0.1f * (float)i;
    }
}

static void test_curve_keeps_the_most_confident_first(void)
{
    make_ranked_row();
    const struct shef_scored_map map = map_with(true);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    TEST_ASSERT_TRUE(curve.ranked);
    /* 25 % are the errors 0, 1; 50 % are 0..3; 75 % 0..5; 100 % 0..7. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, shef_tally_figures(&curve.level[0]).epe_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5, shef_tally_figures(&curve.level[1]).epe_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.5, shef_tally_figures(&curve.level[2]).epe_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.5, shef_tally_figures(&curve.level[3]).epe_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, sqrt(140 / 8.0), curve.level[3].sum_rmse_px);
}

static void test_curve_states_the_real_density_where_estimates_are_missing(void)
{
    make_ranked_row();
    for (int32_t i = 3; i < 8; i++)
        estimate(50 + 2 * i, 0, 0); /* 3 of 8 are left */
    const struct shef_scored_map map = map_with(true);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.25, shef_tally_figures(&curve.level[0]).coverage);
    for (int i = 1; i < SHEF_N_LEVELS; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.375, shef_tally_figures(&curve.level[i]).coverage);
}

static void test_equal_confidences_are_kept_in_raster_order(void)
{
    make_ranked_row();
    for (int32_t i = 0; i < 8; i++)
        shef_row_f32(confidence, 0)[50 + 2 * i] = 0.5f;
    const struct shef_scored_map map = map_with(true);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, shef_tally_figures(&curve.level[0]).epe_px);
}

static void test_without_confidence_only_the_full_density_is_known(void)
{
    make_ranked_row();
    const struct shef_scored_map map = map_with(false);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    TEST_ASSERT_FALSE(curve.ranked);
    TEST_ASSERT_EQUAL_INT64(0, curve.level[0].n_scored);
    TEST_ASSERT_EQUAL_INT64(8, curve.level[3].n_scored);
}

static void test_curve_ranks_within_each_image(void)
{
    make_ranked_row();
    struct shef_scored_map map = map_with(true);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    for (int32_t i = 0; i < 8; i++)
        shef_row_f32(confidence, 0)[50 + 2 * i] *= 0.01f; /* a second, unsure image */
    TEST_ASSERT_EQUAL(SHEF_OK, shef_density_curve_add(&curve, &map, &rules));
    TEST_ASSERT_EQUAL_INT64(4, curve.level[0].n_scored);
    TEST_ASSERT_EQUAL_INT64(2, curve.level[0].n_images_scored);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_protocols_ignore_columns_left_of_50_and_right_of_width_minus_22);
    RUN_TEST(test_the_authors_last_column_at_640_px_is_618);
    RUN_TEST(test_authors_scores_every_estimate_also_off_the_edges_and_on_truth_holes);
    RUN_TEST(test_authors_coverage_is_the_share_of_edge_pixels_with_an_estimate);
    RUN_TEST(test_density_scores_edge_pixels_with_truth_below_the_hole_mark);
    RUN_TEST(test_dense_wants_every_pixel_with_truth);
    RUN_TEST(test_curve_keeps_the_most_confident_first);
    RUN_TEST(test_curve_states_the_real_density_where_estimates_are_missing);
    RUN_TEST(test_equal_confidences_are_kept_in_raster_order);
    RUN_TEST(test_without_confidence_only_the_full_density_is_known);
    RUN_TEST(test_curve_ranks_within_each_image);
    return UNITY_END();
}
