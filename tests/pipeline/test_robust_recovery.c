/* Synthetic surfaces of known disparity, found again to a fraction of the step between candidates.
 *
 * The bounds are what was measured over these scenes and a third more. The errors that remain are
 * those of the parabola through three costs: none on a candidate, and halfway between two. */
#include "pipeline/robust.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "robust_cases.h"

#define BORDER_PX 16 /* half a window: cut windows know less */

static const char *const kind_names[] = { "unsigned", "ternary", "graded" };

/* The worst of several scenes, in steps between candidates. */
struct worst {
    double mean_steps;
    double largest_steps;
    double share_bad;
};

static void match_scene(const struct scene *scene, int32_t step_px, int32_t from_step_px,
                        struct worst *worst)
{
    struct shef_robust_params params =
        shef_robust_defaults(scene->width_px, scene->height_px, scene->kind);

    params.step_px = step_px;
    params.max_disparity_px = 64;

    struct shef_robust *matcher = matcher_create(&params, NULL);
    struct edges edges = edges_of_scene(scene);
    struct result result = match(matcher, &edges, 1);
    const struct scene_error error = error_of(scene, &result, BORDER_PX, from_step_px);

    worst->mean_steps = fmax(worst->mean_steps, error.mean_px / step_px);
    worst->largest_steps = fmax(worst->largest_steps, error.largest_px / step_px);
    worst->share_bad = fmax(worst->share_bad, error.share_bad);
    result_destroy(&result);
    edges_destroy(&edges);
    shef_robust_destroy(matcher);
}

static void print_worst(const char *what, enum shef_edge_kind kind, const struct worst *worst)
{
    printf("%s, %s: mean error up to %.3f, largest %.3f steps; above 3 px: %.2f %%\n", what,
           kind_names[kind], worst->mean_steps, worst->largest_steps, 100.0 * worst->share_bad);
}

static struct scene scene_of(int kind, enum scene_surface surface, double far_px, double near_px)
{
    return (struct scene){
        .kind = (enum shef_edge_kind)kind,
        .width_px = 241,
        .height_px = 121,
        .surface = surface,
        .far_px = far_px,
        .near_px = near_px,
        .texture = 7,
    };
}

static void test_disparities_on_a_candidate_are_exact(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct worst worst = { 0 };

        for (int32_t step_px = 1; step_px <= 2; step_px++)
            for (int32_t d = 4; d <= 60; d += 14) {
                const struct scene scene = scene_of(kind, SURFACE_CONSTANT, d, d);

                match_scene(&scene, step_px, 0, &worst);
            }
        print_worst("on a candidate", (enum shef_edge_kind)kind, &worst);
        expect_at_most(0.03, worst.mean_steps, "mean error (steps)");
        expect_at_most(0.15, worst.largest_steps, "largest error (steps)");
    }
}

static void test_disparities_between_candidates_are_within_half_a_step(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct worst worst = { 0 };

        for (int32_t step_px = 1; step_px <= 2; step_px++)
            for (double d = 9.25; d < 50.0; d += 7.75) {
                const struct scene scene = scene_of(kind, SURFACE_CONSTANT, d, d);

                match_scene(&scene, step_px, 0, &worst);
            }
        print_worst("between candidates", (enum shef_edge_kind)kind, &worst);
        expect_at_most(0.35, worst.mean_steps, "mean error (steps)");
        expect_at_most(0.60, worst.largest_steps, "largest error (steps)");
    }
}

static void test_slanted_surfaces_are_followed(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct worst worst = { 0 };

        for (int32_t step_px = 1; step_px <= 2; step_px++)
            for (double d = 8.0; d < 50.0; d += 13.0) {
                const struct scene rising = scene_of(kind, SURFACE_SLANTED, d, d + 12.0);
                const struct scene falling = scene_of(kind, SURFACE_SLANTED, d + 12.0, d);

                match_scene(&rising, step_px, 0, &worst);
                match_scene(&falling, step_px, 0, &worst);
            }
        print_worst("slanted", (enum shef_edge_kind)kind, &worst);
        expect_at_most(0.17, worst.mean_steps, "mean error (steps)");
        expect_at_most(0.95, worst.largest_steps, "largest error (steps)");
    }
}

/* Next to the step one side is hidden from the other view, and windows see both. */
static void test_steps_are_found_within_half_a_window(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct worst beside = { 0 };
        struct worst everywhere = { 0 };

        for (int32_t step_px = 1; step_px <= 2; step_px++)
            for (int32_t d = 8; d < 50; d += 10) {
                const struct scene scene = scene_of(kind, SURFACE_STEPPED, d, d + 12);

                match_scene(&scene, step_px, 16, &beside);
                match_scene(&scene, step_px, 0, &everywhere);
            }
        print_worst("beside a step", (enum shef_edge_kind)kind, &beside);
        print_worst("step included", (enum shef_edge_kind)kind, &everywhere);
        expect_at_most(0.04, beside.mean_steps, "mean error (steps)");
        expect_at_most(0.50, beside.largest_steps, "largest error (steps)");
        expect_at_most(0.02, everywhere.share_bad, "share above 3 px");
    }
}

/* Half of all right pixels replaced by another texture's: real maps have no more in common. */
static void test_noise_costs_little(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct worst worst = { 0 };

        for (int32_t step_px = 1; step_px <= 2; step_px++)
            for (int32_t d = 8; d < 50; d += 10) {
                struct scene scene = scene_of(kind, SURFACE_SLANTED, d, d + 6);

                scene.noise = 0.5;
                match_scene(&scene, step_px, 0, &worst);
            }
        print_worst("half noise", (enum shef_edge_kind)kind, &worst);
        expect_at_most(0.25, worst.mean_steps, "mean error (steps)");
        expect_at_most(0.01, worst.share_bad, "share above 3 px");
    }
}

/* Only left edge pixels carry a sparse estimate, the same one as the dense image. A graded value
 * below half a grade is none; a window of 7x7 cells leaves 12 of them. */
#define SURE_EDGE 6

static void test_sparse_estimates_are_the_dense_ones_at_left_edges(void)
{
    for (int kind = 0; kind < 3; kind++) {
        const struct scene scene = scene_of(kind, SURFACE_SLANTED, 10.0, 30.0);
        const struct shef_robust_params params =
            shef_robust_defaults(scene.width_px, scene.height_px, scene.kind);
        struct shef_robust *matcher = matcher_create(&params, NULL);
        struct edges edges = edges_of_scene(&scene);
        struct result result = match(matcher, &edges, 1);
        int64_t n_edges = 0;

        for (int32_t y = 0; y < scene.height_px; y++)
            for (int32_t x = 0; x < scene.width_px; x++) {
                const int32_t value = edge_at(&edges.left, x, y);
                const bool is_edge = value != 0;
                const float dense = shef_row_f32(result.images.dense_disparity, y)[x];
                const float p = shef_row_f32(result.images.dense_confidence, y)[x];
                if (is_edge && scene.kind == SHEF_EDGE_GRADED && abs(value) < SURE_EDGE)
                    continue;
                n_edges += is_edge;
                TEST_ASSERT_TRUE(dense > 0.0f && dense <= 82.0f);
                TEST_ASSERT_TRUE(p > 0.0f && p < 1.0f);
                TEST_ASSERT_EQUAL_FLOAT(is_edge ? dense : 0.0f,
                                        shef_row_f32(result.images.disparity, y)[x]);
                TEST_ASSERT_EQUAL_FLOAT(is_edge ? p : 0.0f,
                                        shef_row_f32(result.images.confidence, y)[x]);
            }
        TEST_ASSERT_GREATER_THAN_INT64(scene.width_px * scene.height_px / 8, n_edges);
        result_destroy(&result);
        edges_destroy(&edges);
        shef_robust_destroy(matcher);
    }
}

/* Without the dense images the sparse ones are the same. */
static void test_dense_images_can_be_left_out(void)
{
    const struct scene scene = scene_of(0, SURFACE_STEPPED, 10.0, 30.0);
    const struct shef_robust_params params =
        shef_robust_defaults(scene.width_px, scene.height_px, scene.kind);
    struct shef_robust *matcher = matcher_create(&params, NULL);
    struct edges edges = edges_of_scene(&scene);
    const struct shef_edge_pair pair = edges_pair(&edges);
    struct result full = match(matcher, &edges, 1);
    struct result sparse = result_create(scene.width_px, scene.height_px);
    struct shef_robust_output output = sparse.images;

    output.dense_disparity.data = NULL;
    output.dense_confidence.data = NULL;
    shef_robust_reset(matcher);
    shef_robust_match(matcher, &pair, 1, 1, &output, NULL);
    for (int32_t y = 0; y < scene.height_px; y++) {
        const size_t n_bytes = (size_t)scene.width_px * sizeof(float);

        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(full.images.disparity, y),
                                 shef_row_f32(sparse.images.disparity, y), n_bytes);
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(full.images.confidence, y),
                                 shef_row_f32(sparse.images.confidence, y), n_bytes);
        TEST_ASSERT_EACH_EQUAL_FLOAT(0.0f, shef_row_f32(sparse.images.dense_disparity, y),
                                     scene.width_px);
    }
    result_destroy(&full);
    result_destroy(&sparse);
    edges_destroy(&edges);
    shef_robust_destroy(matcher);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_disparities_on_a_candidate_are_exact);
    RUN_TEST(test_disparities_between_candidates_are_within_half_a_step);
    RUN_TEST(test_slanted_surfaces_are_followed);
    RUN_TEST(test_steps_are_found_within_half_a_window);
    RUN_TEST(test_noise_costs_little);
    RUN_TEST(test_sparse_estimates_are_the_dense_ones_at_left_edges);
    RUN_TEST(test_dense_images_can_be_left_out);
    return UNITY_END();
}
