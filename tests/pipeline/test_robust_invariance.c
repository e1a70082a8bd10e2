/* What must not change the matcher's result: threads, instruction sets, what was matched before,
 * and the way up. */
#include "pipeline/robust.h"

#include <math.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/workers.h"
#include "robust_cases.h"

#define N_PAIRS         3
#define LARGEST_PENALTY 4000 /* of p1 and p2 */

static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                             SHEF_EDGE_GRADED };

/* A slowly moving scene with every correction in use. */
struct sequence {
    struct shef_robust_params params;
    struct edges edges[N_PAIRS];
    struct shef_smooth_field bias;
};

static struct sequence sequence_create(enum shef_edge_kind kind, int32_t width_px,
                                       int32_t height_px)
{
    const struct shef_smooth_field residual = { .c = { 1.5, -0.6, 0.6, 0.0, -0.4, -0.2 },
                                                .width_px = width_px,
                                                .height_px = height_px };
    struct sequence sequence = {
        .params = shef_robust_defaults(width_px, height_px, kind),
        .bias = { .c = { -2.0, 0.5 }, .width_px = width_px, .height_px = height_px },
    };

    for (int i = 0; i < N_PAIRS; i++) {
        const struct scene scene = {
            .kind = kind,
            .width_px = width_px,
            .height_px = height_px,
            .surface = SURFACE_SLANTED,
            .near_px = 40.0,
            .far_px = 16.0,
            .texture = 3,
            .pan_px = i,
            .noise = 0.3,
            .residual = &residual,
        };

        sequence.edges[i] = edges_of_scene(&scene);
    }
    return sequence;
}

static void sequence_destroy(struct sequence *sequence)
{
    for (int i = 0; i < N_PAIRS; i++)
        edges_destroy(&sequence->edges[i]);
}

/* Matches all pairs, the alignment measured on the way. */
static void match_sequence(const struct sequence *sequence, uint32_t features,
                           struct shef_workers *workers, struct result out_results[N_PAIRS])
{
    struct shef_error err = { 0 };
    struct shef_robust *matcher = shef_robust_create(&sequence->params, features, workers, &err);

    TEST_ASSERT_NOT_NULL_MESSAGE(matcher, err.text);
    shef_robust_align_auto(matcher);
    shef_robust_set_bias(matcher, &sequence->bias);
    for (int i = 0; i < N_PAIRS; i++) {
        out_results[i] = match(matcher, &sequence->edges[i], 7 + i);
        TEST_ASSERT_EQUAL(i > 0, out_results[i].report.used_past);
    }
    shef_robust_destroy(matcher);
}

static void expect_same_sequence(const struct result expected[N_PAIRS],
                                 const struct result actual[N_PAIRS])
{
    for (int i = 0; i < N_PAIRS; i++) {
        expect_same_result(&expected[i], &actual[i]);
        TEST_ASSERT_EQUAL_MEMORY(&expected[i].report.alignment, &actual[i].report.alignment,
                                 sizeof expected[i].report.alignment);
    }
}

static void results_destroy(struct result results[N_PAIRS])
{
    for (int i = 0; i < N_PAIRS; i++)
        result_destroy(&results[i]);
}

static void test_workers_and_instruction_sets_never_show(void)
{
    static const int32_t n_workers[] = { 1, 2, 3, 5, 7 };
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    for (int i = 0; i < 3; i++) {
        struct sequence sequence = sequence_create(kinds[i], 161 + 2 * i, 98 + i);
        struct result expected[N_PAIRS];

        match_sequence(&sequence, isas[0], NULL, expected);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.7, 1.5, expected[2].report.alignment.c[0],
                                          "the alignment was not measured");
        for (size_t j = 0; j < sizeof n_workers / sizeof n_workers[0]; j++) {
            struct shef_error err = { 0 };
            struct shef_workers *workers = shef_workers_create(n_workers[j], &err);

            TEST_ASSERT_NOT_NULL_MESSAGE(workers, err.text);
            for (int isa = 0; isa < n_isas; isa++) {
                struct result actual[N_PAIRS];

                match_sequence(&sequence, isas[isa], workers, actual);
                expect_same_sequence(expected, actual);
                results_destroy(actual);
            }
            shef_workers_destroy(workers);
        }
        results_destroy(expected);
        sequence_destroy(&sequence);
    }
}

/* Two matchers of different kinds that take turns with one set of volumes. */
static void test_a_lent_volume_never_shows(void)
{
    struct sequence sequences[2] = { sequence_create(SHEF_EDGE_UNSIGNED, 163, 98),
                                     sequence_create(SHEF_EDGE_GRADED, 163, 98) };
    struct shef_robust *matchers[2] = { NULL, NULL };
    struct shef_error err = { 0 };
    struct result expected[2][N_PAIRS];

    for (int i = 0; i < 2; i++) {
        match_sequence(&sequences[i], shef_cpu_features(), NULL, expected[i]);
        matchers[i] = shef_robust_create_beside(&sequences[i].params, shef_cpu_features(), NULL,
                                                matchers[0], &err);
        TEST_ASSERT_NOT_NULL_MESSAGE(matchers[i], err.text);
        shef_robust_align_auto(matchers[i]);
        shef_robust_set_bias(matchers[i], &sequences[i].bias);
    }
    TEST_ASSERT_LESS_THAN_size_t(shef_robust_memory_bytes(matchers[0]) / 2,
                                 shef_robust_memory_bytes(matchers[1]));
    for (int pair = 0; pair < N_PAIRS; pair++)
        for (int i = 0; i < 2; i++) {
            struct result actual = match(matchers[i], &sequences[i].edges[pair], 7 + pair);

            expect_same_result(&expected[i][pair], &actual);
            result_destroy(&actual);
        }
    for (int i = 1; i >= 0; i--) {
        shef_robust_destroy(matchers[i]);
        results_destroy(expected[i]);
        sequence_destroy(&sequences[i]);
    }
}

/* The largest numbers that the costs can reach: opposed windows, the dearest jumps and priors. */
static void test_the_largest_penalties_do_not_overflow(void)
{
    struct sequence sequence = sequence_create(SHEF_EDGE_TERNARY, 131, 86);
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);
    struct result expected[N_PAIRS];

    sequence.params.p1 = LARGEST_PENALTY;
    sequence.params.p2 = LARGEST_PENALTY;
    sequence.params.prior_cost_per_px = 64.0;
    sequence.params.prior_cap_px = 31.0;
    match_sequence(&sequence, isas[0], NULL, expected);
    for (int isa = 1; isa < n_isas; isa++) {
        struct result actual[N_PAIRS];

        match_sequence(&sequence, isas[isa], NULL, actual);
        expect_same_sequence(expected, actual);
        results_destroy(actual);
    }
    results_destroy(expected);
    sequence_destroy(&sequence);
}

/* More workers than there are rows of cells to share. */
static void test_more_workers_than_rows_are_no_harm(void)
{
    struct shef_error err = { 0 };
    struct sequence sequence = sequence_create(SHEF_EDGE_UNSIGNED, 101, 32);
    struct shef_workers *workers = shef_workers_create(20, &err);
    struct result expected[N_PAIRS];
    struct result actual[N_PAIRS];
    uint32_t isas[4];
    const uint32_t best = isas[shef_test_isas(isas) - 1];

    TEST_ASSERT_NOT_NULL_MESSAGE(workers, err.text);
    match_sequence(&sequence, best, NULL, expected);
    match_sequence(&sequence, best, workers, actual);
    expect_same_sequence(expected, actual);
    results_destroy(expected);
    results_destroy(actual);
    shef_workers_destroy(workers);
    sequence_destroy(&sequence);
}

static struct edges upside_down(const struct edges *edges)
{
    return (struct edges){ edges_mirrored(&edges->left, false, true),
                           edges_mirrored(&edges->right, false, true) };
}

static void expect_upside_down(struct shef_image_f32 upright, struct shef_image_f32 turned)
{
    for (int32_t y = 0; y < upright.height_px; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(upright, y),
                                 shef_row_f32(turned, upright.height_px - 1 - y),
                                 (size_t)upright.width_px * sizeof(float));
}

/* Heights of whole cells: an odd one has half a cell at the bottom only. */
static void test_upside_down_maps_give_the_result_upside_down(void)
{
    for (int i = 0; i < 3; i++) {
        struct sequence sequence = sequence_create(kinds[i], 131, 86);
        struct shef_robust *upright = matcher_create(&sequence.params, NULL);
        struct shef_robust *turned = matcher_create(&sequence.params, NULL);

        for (int j = 0; j < N_PAIRS; j++) {
            struct edges mirrored = upside_down(&sequence.edges[j]);
            struct result expected = match(upright, &sequence.edges[j], j);
            struct result actual = match(turned, &mirrored, j);

            expect_upside_down(expected.images.disparity, actual.images.disparity);
            expect_upside_down(expected.images.confidence, actual.images.confidence);
            expect_upside_down(expected.images.dense_disparity, actual.images.dense_disparity);
            expect_upside_down(expected.images.dense_confidence, actual.images.dense_confidence);
            result_destroy(&expected);
            result_destroy(&actual);
            edges_destroy(&mirrored);
        }
        shef_robust_destroy(upright);
        shef_robust_destroy(turned);
        sequence_destroy(&sequence);
    }
}

/* Seen in a mirror, left and right change places and disparities stay. Occlusions do not change
 * places, and the half grid of one view falls between the other's, so the surface is the same but
 * not the bits: within half a step between candidates. */
static void test_in_a_mirror_the_views_change_places_and_the_surface_stays(void)
{
    for (int i = 0; i < 3; i++) {
        const struct scene scene = {
            .kind = kinds[i],
            .width_px = 200,
            .height_px = 80,
            .near_px = 25.0,
            .texture = 11,
        };
        const struct shef_robust_params params = shef_robust_defaults(200, 80, kinds[i]);
        struct shef_robust *matcher = matcher_create(&params, NULL);
        struct edges edges = edges_of_scene(&scene);
        struct edges mirrored = { edges_mirrored(&edges.right, true, false),
                                  edges_mirrored(&edges.left, true, false) };
        struct result seen = match(matcher, &edges, 1);

        shef_robust_reset(matcher);

        struct result in_mirror = match(matcher, &mirrored, 1);

        for (int32_t y = 16; y < 64; y++)
            for (int32_t x = 41; x < 184; x++) {
                const float d = shef_row_f32(seen.images.dense_disparity, y)[x];
                const int32_t other_x = 200 - 1 - (x - 25);

                TEST_ASSERT_FLOAT_WITHIN(
                    1.0f, d, shef_row_f32(in_mirror.images.dense_disparity, y)[other_x]);
            }
        result_destroy(&seen);
        result_destroy(&in_mirror);
        edges_destroy(&edges);
        edges_destroy(&mirrored);
        shef_robust_destroy(matcher);
    }
}

static void test_a_used_matcher_gives_what_a_fresh_one_gives(void)
{
    for (int i = 0; i < 3; i++) {
        struct sequence sequence = sequence_create(kinds[i], 131, 87);
        struct shef_robust *used = matcher_create(&sequence.params, NULL);
        struct shef_robust *fresh = matcher_create(&sequence.params, NULL);
        struct result before = match(used, &sequence.edges[0], 1);

        shef_robust_reset(used);

        struct result actual = match(used, &sequence.edges[1], 2);
        struct result expected = match(fresh, &sequence.edges[1], 2);

        TEST_ASSERT_FALSE(actual.report.used_past);
        expect_same_result(&expected, &actual);
        result_destroy(&before);
        result_destroy(&actual);
        result_destroy(&expected);
        shef_robust_destroy(used);
        shef_robust_destroy(fresh);
        sequence_destroy(&sequence);
    }
}

static void test_a_pair_given_twice_counts_once(void)
{
    for (int i = 0; i < 3; i++) {
        struct sequence sequence = sequence_create(kinds[i], 131, 87);
        struct shef_robust *matcher = matcher_create(&sequence.params, NULL);
        struct result expected = match(matcher, &sequence.edges[0], 1);
        struct result actual = result_create(131, 87);
        const struct shef_edge_pair twice[2] = { edges_pair(&sequence.edges[0]),
                                                 edges_pair(&sequence.edges[0]) };

        shef_robust_reset(matcher);
        shef_robust_match(matcher, twice, 2, 1, &actual.images, &actual.report);
        expect_same_result(&expected, &actual);
        result_destroy(&expected);
        result_destroy(&actual);
        shef_robust_destroy(matcher);
        sequence_destroy(&sequence);
    }
}

/* A second pair with noise of its own: together they are better than each. */
static void test_a_second_pair_of_the_same_views_helps(void)
{
    struct scene scene = {
        .width_px = 200,
        .height_px = 120,
        .surface = SURFACE_SLANTED,
        .near_px = 40.0,
        .far_px = 20.0,
        .texture = 21,
        .noise = 0.85,
    };
    const struct shef_robust_params params = shef_robust_defaults(200, 120, SHEF_EDGE_UNSIGNED);
    struct shef_robust *matcher = matcher_create(&params, NULL);
    struct edges edges[2];
    struct scene_error alone[2];

    for (int i = 0; i < 2; i++) {
        scene.texture = 21 + 100 * (uint64_t)i;
        edges[i] = edges_of_scene(&scene);
        shef_robust_reset(matcher);

        struct result result = match(matcher, &edges[i], 1);

        alone[i] = error_of(&scene, &result, 12, 0);
        result_destroy(&result);
    }

    struct result both = result_create(200, 120);
    const struct shef_edge_pair pairs[2] = { edges_pair(&edges[0]), edges_pair(&edges[1]) };

    shef_robust_reset(matcher);
    shef_robust_match(matcher, pairs, 2, 1, &both.images, NULL);
    expect_at_most(0.7 * fmin(alone[0].mean_px, alone[1].mean_px),
                   error_of(&scene, &both, 12, 0).mean_px, "mean error of two pairs (px)");
    result_destroy(&both);
    edges_destroy(&edges[0]);
    edges_destroy(&edges[1]);
    shef_robust_destroy(matcher);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_workers_and_instruction_sets_never_show);
    RUN_TEST(test_a_lent_volume_never_shows);
    RUN_TEST(test_the_largest_penalties_do_not_overflow);
    RUN_TEST(test_more_workers_than_rows_are_no_harm);
    RUN_TEST(test_upside_down_maps_give_the_result_upside_down);
    RUN_TEST(test_in_a_mirror_the_views_change_places_and_the_surface_stays);
    RUN_TEST(test_a_used_matcher_gives_what_a_fresh_one_gives);
    RUN_TEST(test_a_pair_given_twice_counts_once);
    RUN_TEST(test_a_second_pair_of_the_same_views_helps);
    return UNITY_END();
}
