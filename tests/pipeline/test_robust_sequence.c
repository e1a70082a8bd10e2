/* What one pair leaves to the next, and when it must not. */
#include "pipeline/robust.h"

#include <stdio.h>
#include <string.h>

#include "robust_cases.h"

#define WIDTH_PX  200
#define HEIGHT_PX 150
#define N_PAIRS   8
#define FLOODED   4 /* which pair has a saturated right map */

static struct edges pairs[N_PAIRS];
static struct shef_robust *matcher;
static struct shef_robust *other;

void tearDown(void)
{
    for (int i = 0; i < N_PAIRS; i++)
        edges_destroy(&pairs[i]);
    shef_robust_destroy(matcher);
    shef_robust_destroy(other);
    matcher = other = NULL;
}

static struct scene scene_at(int i)
{
    return (struct scene){
        .kind = SHEF_EDGE_UNSIGNED,
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .surface = SURFACE_SLANTED,
        .near_px = 44.0,
        .far_px = 20.0,
        .texture = 31,
        .pan_px = 0.75 * i,
        .noise = 0.4,
    };
}

static void create_pairs(void)
{
    for (int i = 0; i < N_PAIRS; i++) {
        const struct scene scene = scene_at(i);

        pairs[i] = edges_of_scene(&scene);
    }
}

static struct shef_robust *create_matcher(bool use_past)
{
    struct shef_robust_params params =
        shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_UNSIGNED);

    params.use_past = use_past;
    return matcher_create(&params, NULL);
}

/* Matches and forgets. */
static struct shef_robust_report match_only(struct shef_robust *with, const struct edges *edges,
                                            int64_t number)
{
    struct result result = match(with, edges, number);

    result_destroy(&result);
    return result.report;
}

static void expect_same_match(const struct edges *edges, int64_t number)
{
    struct result expected = match(other, edges, number);
    struct result actual = match(matcher, edges, number);

    expect_same_result(&expected, &actual);
    result_destroy(&expected);
    result_destroy(&actual);
}

static void test_the_past_changes_the_result(void)
{
    create_pairs();
    matcher = create_matcher(true);
    other = create_matcher(true);
    (void)match_only(matcher, &pairs[0], 1);

    struct result with = match(matcher, &pairs[1], 2);
    struct result without = match(other, &pairs[1], 2);

    TEST_ASSERT_TRUE(with.report.used_past);
    TEST_ASSERT_FALSE(without.report.used_past);
    TEST_ASSERT_TRUE(memcmp(with.images.dense_disparity.data, without.images.dense_disparity.data,
                            (size_t)(with.images.dense_disparity.stride_bytes * HEIGHT_PX)) != 0);
    result_destroy(&with);
    result_destroy(&without);
}

/* Any number but the next one starts anew: a gap, the same again, one back. */
static void test_a_gap_in_the_numbers_starts_anew(void)
{
    static const int64_t numbers[] = { 13, 11, 10, INT64_MAX, INT64_MIN, -12 };

    create_pairs();
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        matcher = create_matcher(true);
        other = create_matcher(true);
        TEST_ASSERT_FALSE(match_only(matcher, &pairs[0], 10).used_past);
        TEST_ASSERT_TRUE(match_only(matcher, &pairs[1], 11).used_past);
        expect_same_match(&pairs[2], numbers[i]);
        /* From there on both have the same past. */
        if (numbers[i] != INT64_MAX)
            expect_same_match(&pairs[3], numbers[i] + 1);
        shef_robust_destroy(matcher);
        shef_robust_destroy(other);
    }
    matcher = other = NULL;
}

static void test_after_a_gap_only_the_alignment_is_kept(void)
{
    struct shef_robust_report report;

    create_pairs();
    matcher = create_matcher(true);
    shef_robust_align_auto(matcher);
    for (int i = 0; i < 3; i++)
        (void)match_only(matcher, &pairs[i], i);

    struct result actual = match(matcher, &pairs[5], 50);

    report = actual.report;
    TEST_ASSERT_FALSE(report.used_past);
    other = create_matcher(true);
    shef_robust_align_fixed(other, &report.alignment);

    struct result expected = match(other, &pairs[5], 50);

    expect_same_result(&expected, &actual);
    result_destroy(&expected);
    result_destroy(&actual);
}

static void test_reset_starts_anew(void)
{
    create_pairs();
    matcher = create_matcher(true);
    other = create_matcher(true);
    (void)match_only(matcher, &pairs[0], 1);
    shef_robust_reset(matcher);
    expect_same_match(&pairs[1], 2);
}

static void test_another_scene_starts_anew(void)
{
    struct scene elsewhere = scene_at(0);
    struct shef_robust_report report;

    create_pairs();
    elsewhere.texture = 999;
    edges_destroy(&pairs[7]);
    pairs[7] = edges_of_scene(&elsewhere);
    matcher = create_matcher(true);
    other = create_matcher(true);
    for (int i = 0; i < 3; i++) {
        report = match_only(matcher, &pairs[i], 1 + i);
        TEST_ASSERT_FALSE_MESSAGE(report.is_cut, "a slow pan was taken for a cut");
        TEST_ASSERT_EQUAL(i > 0, report.used_past);
    }
    report = match_only(matcher, &pairs[7], 4);
    TEST_ASSERT_TRUE(report.is_cut);
    TEST_ASSERT_FALSE(report.used_past);
    (void)match_only(other, &pairs[7], 4);
    expect_same_match(&pairs[7], 5);
}

static void test_without_use_past_every_pair_stands_alone(void)
{
    create_pairs();
    matcher = create_matcher(false);
    other = create_matcher(false);
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_FALSE(match_only(matcher, &pairs[i], i).used_past);
    expect_same_match(&pairs[4], 4);
}

/* The first pairs of a long and a short sequence, whatever comes after. */
static void test_later_pairs_never_change_earlier_results(void)
{
    struct result seen[4];

    create_pairs();
    edges_flood(&pairs[FLOODED].right, 0.6, 1);
    matcher = create_matcher(true);
    other = create_matcher(true);
    shef_robust_align_auto(matcher);
    shef_robust_align_auto(other);
    for (int i = 0; i < 4; i++)
        seen[i] = match(matcher, &pairs[i], i);
    for (int i = 4; i < N_PAIRS; i++)
        (void)match_only(matcher, &pairs[i], i);
    for (int i = 0; i < 4; i++) {
        struct result again = match(other, &pairs[i], i);

        expect_same_result(&seen[i], &again);
        result_destroy(&again);
        result_destroy(&seen[i]);
    }
}

static void test_saturation_is_told_by_the_share_of_edges(void)
{
    struct shef_robust_report report;

    create_pairs();
    matcher = create_matcher(true);
    report = match_only(matcher, &pairs[0], 1);
    TEST_ASSERT_FALSE(report.is_saturated);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12,
                              (double)shef_edge_map_count(&pairs[0].right) / (WIDTH_PX * HEIGHT_PX),
                              report.right_share);
    edges_flood(&pairs[1].right, 0.5, 1);
    report = match_only(matcher, &pairs[1], 2);
    TEST_ASSERT_TRUE(report.is_saturated);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.5, report.right_share);
}

/* Mean error of each pair of a sequence whose pair FLOODED is saturated. */
static void errors_of_sequence(bool use_past, double out_mean_px[N_PAIRS])
{
    struct shef_robust *with = create_matcher(use_past);

    for (int i = 0; i < N_PAIRS; i++) {
        const struct scene scene = scene_at(i);
        struct result result = match(with, &pairs[i], i);

        TEST_ASSERT_EQUAL(i == FLOODED, result.report.is_saturated);
        out_mean_px[i] = error_of(&scene, &result, 12, 0).mean_px;
        result_destroy(&result);
    }
    shef_robust_destroy(with);
}

static void test_the_past_carries_over_a_saturated_pair(void)
{
    double with_px[N_PAIRS];
    double without_px[N_PAIRS];

    create_pairs();
    edges_flood(&pairs[FLOODED].right, 0.9, 1);
    errors_of_sequence(true, with_px);
    errors_of_sequence(false, without_px);
    for (int i = 0; i < N_PAIRS; i++)
        printf("pair %d: mean error %.3f px with the past, %.3f px without\n", i, with_px[i],
               without_px[i]);
    expect_at_most(2.0 * with_px[FLOODED - 1], with_px[FLOODED], "carried over (px)");
    expect_at_most(without_px[FLOODED], 3.0 * with_px[FLOODED], "three times that (px)");
    expect_at_most(1.2 * with_px[FLOODED - 1], with_px[FLOODED + 1], "the pair after it (px)");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_past_changes_the_result);
    RUN_TEST(test_a_gap_in_the_numbers_starts_anew);
    RUN_TEST(test_after_a_gap_only_the_alignment_is_kept);
    RUN_TEST(test_reset_starts_anew);
    RUN_TEST(test_another_scene_starts_anew);
    RUN_TEST(test_without_use_past_every_pair_stands_alone);
    RUN_TEST(test_later_pairs_never_change_earlier_results);
    RUN_TEST(test_saturation_is_told_by_the_share_of_edges);
    RUN_TEST(test_the_past_carries_over_a_saturated_pair);
    return UNITY_END();
}
