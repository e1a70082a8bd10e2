/* An evaluation sorts images into scenes, filters copies only, and sums up. */

#include "sheftool/evaluation.h"
#include "support/support.h"

enum { WIDTH = 160, HEIGHT = 120 };

static const struct shef_scenes scenes = {
    .at = { { "near", 1, 2 }, { "far", 3, 9 } },
    .n = 2,
};
static struct shef_evaluation evaluation;
static struct shef_image_f32 disparity;
static struct shef_image_f32 truth;

static void fill(struct shef_image_f32 map, float value)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(map, y)[x] = value;
}

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&disparity, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&truth, WIDTH, HEIGHT, NULL));
    fill(truth, 40);
}

void tearDown(void)
{
    shef_evaluation_destroy(&evaluation);
    shef_image_destroy_f32(&disparity);
    shef_image_destroy_f32(&truth);
}

static void create(bool filter)
{
    const struct shef_evaluation_settings settings = {
        .protocol = SHEF_AUTHORS,
        .filter = filter,
        .rules = { { 1301, 0.06544 }, (float)SHEF_TRUTH_HOLE_PX },
    };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_evaluation_create(&evaluation, &settings, &scenes, NULL));
}

static struct shef_image_f32 add(int64_t number)
{
    const struct shef_scored_map map = { .disparity = disparity, .truth = truth };
    struct shef_image_f32 scored;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_evaluation_add(&evaluation, number, &map, &scored, NULL));
    return scored;
}

static void test_images_go_to_their_scene_and_into_the_overall_mean(void)
{
    create(false);
    fill(disparity, 41);
    add(1);
    fill(disparity, 42);
    add(2);
    fill(disparity, 46);
    add(3);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.5, shef_tally_figures(&evaluation.tallies[0]).rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 6, shef_tally_figures(&evaluation.tallies[1]).rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3, shef_evaluation_overall(&evaluation).rmse_px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1 / 3.0, shef_evaluation_overall(&evaluation).bad[3]);
}

static void test_summing_up_twice_counts_nothing_twice(void)
{
    create(false);
    fill(disparity, 41);
    add(1);
    (void)shef_evaluation_overall(&evaluation);
    (void)shef_evaluation_overall(&evaluation);
    TEST_ASSERT_EQUAL_INT64(1, evaluation.tallies[2].n_images);
}

static void test_filter_removes_a_lone_outlier_from_a_copy(void)
{
    create(true);
    fill(disparity, 41);
    shef_row_f32(disparity, 60)[80] = 70; /* more than 10 px from its diagonal's median */
    const struct shef_image_f32 scored = add(1);

    TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(scored, 60)[80]);
    TEST_ASSERT_EQUAL_FLOAT(41, shef_row_f32(scored, 60)[81]);
    TEST_ASSERT_EQUAL_FLOAT(70, shef_row_f32(disparity, 60)[80]);
    TEST_ASSERT_EQUAL_INT64(0, evaluation.tallies[0].n_bad[3]);
}

static void test_without_filter_the_outlier_counts(void)
{
    create(false);
    fill(disparity, 41);
    shef_row_f32(disparity, 60)[80] = 70;
    add(1);
    TEST_ASSERT_EQUAL_INT64(1, evaluation.tallies[0].n_bad[3]);
}

static void test_json_has_null_for_what_is_unknown(void)
{
    create(false);
    fill(disparity, 41);
    add(1);
    json_t *root = shef_evaluation_json(&evaluation);
    const json_t *all = json_object_get(root, "overall");

    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1, json_number_value(json_object_get(all, "rmse_px")));
    TEST_ASSERT_TRUE(json_is_null(json_object_get(all, "coverage_percent")));
    TEST_ASSERT_TRUE(json_is_null(json_object_get(all, "calibration_error")));
    TEST_ASSERT_NULL(json_object_get(root, "density_curve"));
    TEST_ASSERT_EQUAL_STRING("none", json_string_value(json_object_get(root, "filter")));
    json_decref(root);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_images_go_to_their_scene_and_into_the_overall_mean);
    RUN_TEST(test_summing_up_twice_counts_nothing_twice);
    RUN_TEST(test_filter_removes_a_lone_outlier_from_a_copy);
    RUN_TEST(test_without_filter_the_outlier_counts);
    RUN_TEST(test_json_has_null_for_what_is_unknown);
    return UNITY_END();
}
