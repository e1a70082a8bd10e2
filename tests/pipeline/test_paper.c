#include "pipeline/paper.h"

#include <stdbool.h>
#include <string.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "core/workers.h"

#define WIDTH_PX  320
#define HEIGHT_PX 120

/* A scene: the true disparity of every left pixel, and edge maps that obey it exactly. */
struct scene {
    struct shef_edge_map left;
    struct shef_edge_map right;
    int32_t disparity[WIDTH_PX];
};

static int32_t constant(int32_t x)
{
    (void)x;
    return 23;
}

/* Leans away to the right, 1 px in 40. */
static int32_t slanted(int32_t x)
{
    return 40 - x / 40;
}

static int32_t stepped(int32_t x)
{
    return x < WIDTH_PX / 2 ? 12 : 31;
}

static struct scene scene_of(int32_t (*disparity_at)(int32_t x), enum shef_edge_kind kind)
{
    struct shef_test_random random = shef_test_random_start();
    struct scene scene = {
        .left = shef_test_random_map(&random, kind, WIDTH_PX, HEIGHT_PX, 0.3),
        .right = shef_test_random_map(&random, kind, WIDTH_PX, HEIGHT_PX, 0),
    };

    for (int32_t x = 0; x < WIDTH_PX; x++) {
        scene.disparity[x] = disparity_at(x);
        for (int32_t y = 0; y < HEIGHT_PX; y++) {
            const int edge = shef_test_edge_at(&scene.left, x, y);

            if (edge != 0)
                shef_test_set_edge(&scene.right, x - scene.disparity[x], y, edge);
        }
    }
    return scene;
}

static void free_scene(struct scene *scene)
{
    shef_edge_map_destroy(&scene->left);
    shef_edge_map_destroy(&scene->right);
}

static struct shef_paper_params preset(const char *name)
{
    struct shef_paper_params params = { 0 };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_paper_preset(name, &params, &err), err.text);
    return params;
}

static struct shef_image_f32 match(const struct scene *scene,
                                   const struct shef_paper_params *params, uint32_t features,
                                   struct shef_workers *workers)
{
    struct shef_image_f32 disparity = shef_test_image_f32(WIDTH_PX, HEIGHT_PX);
    struct shef_paper_report report = { 0 };
    struct shef_paper *paper = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_paper_create(&paper, WIDTH_PX, HEIGHT_PX, params, features, workers, &err),
        err.text);
    TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features), shef_paper_isa(paper));
    TEST_ASSERT_TRUE(shef_paper_bytes(paper) > 0);
    /* Twice: a match must not leave traces in the workspace. */
    for (int i = 0; i < 2; i++)
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_paper_match(paper, &scene->left, &scene->right, disparity, &report));
    for (int i = 0; i < SHEF_PAPER_N_STAGES; i++)
        TEST_ASSERT_TRUE(report.stage_ns[i] >= 0);
    shef_paper_destroy(paper);
    return disparity;
}

/* Where the window of an edge pixel sees one disparity only, that one is found; elsewhere one of
 * those it sees. Columns whose match lies left of the event image are left out. */
static void expect_exact(int32_t (*disparity_at)(int32_t x), enum shef_edge_kind kind,
                         bool everywhere)
{
    struct scene scene = scene_of(disparity_at, kind);
    struct shef_paper_params params = preset("paper-ds");
    int64_t n_read_out = 0;
    int64_t n_pure = 0;

    params.window_px = 25;
    params.everywhere = everywhere;

    struct shef_image_f32 found = match(&scene, &params, shef_cpu_features(), NULL);
    const int32_t r = params.window_px / 2;

    for (int32_t x = 60; x < WIDTH_PX - r; x++) {
        int32_t low = scene.disparity[x];
        int32_t high = scene.disparity[x];

        for (int32_t i = x - r; i <= x + r; i++) {
            low = scene.disparity[i] < low ? scene.disparity[i] : low;
            high = scene.disparity[i] > high ? scene.disparity[i] : high;
        }
        n_pure += low == high;
        for (int32_t y = 0; y < HEIGHT_PX; y++) {
            const float d = shef_row_f32(found, y)[x];

            if (!everywhere && shef_test_edge_at(&scene.left, x, y) == 0) {
                TEST_ASSERT_EQUAL_FLOAT(0, d);
                continue;
            }
            n_read_out++;
            TEST_ASSERT_TRUE((float)low <= d && d <= (float)high);
        }
    }
    TEST_ASSERT_TRUE(n_read_out > 5000);
    TEST_ASSERT_TRUE(n_pure > 80);
    shef_image_destroy_f32(&found);
    free_scene(&scene);
}

static void test_constant_slanted_and_stepped_disparities_are_recovered_exactly(void)
{
    expect_exact(constant, SHEF_EDGE_UNSIGNED, false);
    expect_exact(slanted, SHEF_EDGE_UNSIGNED, false);
    expect_exact(stepped, SHEF_EDGE_UNSIGNED, false);
    expect_exact(stepped, SHEF_EDGE_UNSIGNED, true);
}

static void test_ternary_maps_are_recovered_exactly(void)
{
    expect_exact(constant, SHEF_EDGE_TERNARY, false);
    expect_exact(slanted, SHEF_EDGE_TERNARY, false);
    expect_exact(stepped, SHEF_EDGE_TERNARY, true);
}

/* Levels round their disparities to whole pixels of their own size, so the pyramid's average is
 * within half a coarse pixel. */
static void test_the_pyramid_recovers_a_constant_disparity(void)
{
    struct scene scene = scene_of(constant, SHEF_EDGE_UNSIGNED);
    struct shef_paper_params params = preset("paper-dp");
    int64_t n_edges = 0;

    params.window_px = 41;

    struct shef_image_f32 found = match(&scene, &params, shef_cpu_features(), NULL);

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 60; x < WIDTH_PX; x++) {
            if (shef_test_edge_at(&scene.left, x, y) == 0) {
                TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(found, y)[x]);
                continue;
            }
            n_edges++;
            TEST_ASSERT_FLOAT_WITHIN(0.5f / (0.9f * 0.9f * 0.9f * 0.9f), 23,
                                     shef_row_f32(found, y)[x]);
        }
    TEST_ASSERT_TRUE(n_edges > 5000);
    shef_image_destroy_f32(&found);
    free_scene(&scene);
}

/* Two levels by hand: 20 and 10 columns, window 1, d up to 8 and up to 4. Half size takes the odd
 * columns; its column i lies under columns 2 i and 2 i + 1. */
static void test_levels_are_averaged_where_both_have_an_estimate(void)
{
    const struct shef_paper_params params = { 2, 0.5, 1, 1, 8, false };
    struct shef_image_f32 found = shef_test_image_f32(20, 1);
    struct shef_edge_map left;
    struct shef_edge_map right;
    struct shef_paper *paper = NULL;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&left, SHEF_EDGE_UNSIGNED, 20, 1, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&right, SHEF_EDGE_UNSIGNED, 20, 1, &err));
    shef_test_set_edge(&left, 10, 0, 1);
    shef_test_set_edge(&left, 11, 0, 1);
    shef_test_set_edge(&left, 16, 0, 1); /* only at full size */
    shef_test_set_edge(&left, 19, 0, 1); /* has no partner within 8 px */
    shef_test_set_edge(&right, 5, 0, 1);
    shef_test_set_edge(&right, 6, 0, 1);
    shef_test_set_edge(&right, 9, 0, 1);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_paper_create(&paper, 20, 1, &params, SHEF_CPU_NONE, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_paper_match(paper, &left, &right, found, NULL));

    /* Full size: 10 meets 9 at d = 1; 11 meets 9 at 2; 16 meets 9 at 7.
     * Half size: right columns 2 (from 5) and 4 (from 9); left 5 (from 11) meets 4 at d = 1, that
     * is 2; left 9 (from 19) meets nothing within 4. */
    for (int32_t x = 0; x < 20; x++) {
        const float expected = x == 10   ? 0.5f * 1 + 0.5f * 2
                               : x == 11 ? 0.5f * 2 + 0.5f * 2
                               : x == 16 ? 7
                                         : 0;

        TEST_ASSERT_EQUAL_FLOAT(expected, shef_row_f32(found, 0)[x]);
    }
    shef_paper_destroy(paper);
    shef_image_destroy_f32(&found);
    shef_edge_map_destroy(&left);
    shef_edge_map_destroy(&right);
}

static void test_threads_and_instruction_sets_never_show(void)
{
    static const char *const names[] = { "paper-ds", "paper-dp" };
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    for (int i = 0; i < 4; i++) {
        struct scene scene = scene_of(stepped, i < 2 ? SHEF_EDGE_UNSIGNED : SHEF_EDGE_TERNARY);
        const struct shef_paper_params params = preset(names[i % 2]);
        struct shef_image_f32 expected = match(&scene, &params, SHEF_CPU_NONE, NULL);

        for (int isa = 0; isa < n_isas; isa++)
            for (int32_t n_threads = 1; n_threads <= 5; n_threads += 2) {
                struct shef_error err;
                struct shef_workers *workers = shef_workers_create(n_threads, &err);
                struct shef_image_f32 actual = match(&scene, &params, isas[isa], workers);

                for (int32_t y = 0; y < HEIGHT_PX; y++)
                    TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(expected, y), shef_row_f32(actual, y),
                                             WIDTH_PX * sizeof(float));
                shef_image_destroy_f32(&actual);
                shef_workers_destroy(workers);
            }
        shef_image_destroy_f32(&expected);
        free_scene(&scene);
    }
}

static void test_empty_maps_give_no_estimate(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct scene scene = {
        .left = shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX, 0.3),
        .right = shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX, 0),
    };
    const struct shef_paper_params params = preset("paper-dp");
    struct shef_image_f32 found = match(&scene, &params, shef_cpu_features(), NULL);

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        TEST_ASSERT_EACH_EQUAL_FLOAT(0, shef_row_f32(found, y), WIDTH_PX);
    shef_image_destroy_f32(&found);
    free_scene(&scene);
}

static void test_graded_maps_are_refused_and_the_output_is_kept(void)
{
    const struct shef_paper_params params = preset("paper-ds");
    struct shef_image_f32 found = shef_test_image_f32(WIDTH_PX, HEIGHT_PX);
    struct shef_edge_map graded;
    struct shef_paper *paper = NULL;
    struct shef_error err;

    shef_row_f32(found, 7)[7] = 7;
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&graded, SHEF_EDGE_GRADED, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_paper_create(&paper, WIDTH_PX, HEIGHT_PX, &params,
                                                 SHEF_CPU_NONE, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_UNSUPPORTED, shef_paper_match(paper, &graded, &graded, found, NULL));
    TEST_ASSERT_EQUAL_FLOAT(7, shef_row_f32(found, 7)[7]);
    shef_paper_destroy(paper);
    shef_edge_map_destroy(&graded);
    shef_image_destroy_f32(&found);
}

static void expect_refused(struct shef_paper_params params, const char *reason)
{
    struct shef_paper *paper = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_paper_create(&paper, 64, 48, &params, SHEF_CPU_NONE, NULL, &err));
    TEST_ASSERT_NULL(paper);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_reason(void)
{
    struct shef_paper_params params = { 0 };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_paper_preset("paper-dx", &params, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "paper-dx"), err.text);
    expect_refused((struct shef_paper_params){ 0, 0.9, 51, 1, 40, false }, "0 levels");
    expect_refused((struct shef_paper_params){ 5, 1.5, 51, 1, 40, false }, "scale 1.5");
    expect_refused((struct shef_paper_params){ 5, 0.9, 50, 1, 40, false }, "50 px");
    expect_refused((struct shef_paper_params){ 5, 0.9, 51, 0, 40, false }, "0 means none");
    expect_refused((struct shef_paper_params){ 1, 0.9, 51, 1, 64, false }, "64 px wide");
    expect_refused((struct shef_paper_params){ 1, 0.9, 51, 9, 5, false }, "9..5");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_constant_slanted_and_stepped_disparities_are_recovered_exactly);
    RUN_TEST(test_ternary_maps_are_recovered_exactly);
    RUN_TEST(test_the_pyramid_recovers_a_constant_disparity);
    RUN_TEST(test_levels_are_averaged_where_both_have_an_estimate);
    RUN_TEST(test_threads_and_instruction_sets_never_show);
    RUN_TEST(test_empty_maps_give_no_estimate);
    RUN_TEST(test_graded_maps_are_refused_and_the_output_is_kept);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_reason);
    return UNITY_END();
}
