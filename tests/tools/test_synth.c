/* Synthetic pairs: repeatable, of the promised density, and true to their truth. */
#include <math.h>
#include <string.h>

#include "sheftool/synth.h"
#include "support/support.h"

static const struct shef_synth_settings small = {
    .width_px = 320, .height_px = 240, .n_pairs = 6, .seed = 3, .vertical_residual_px = 0
};

static double density(struct shef_image_u8 image)
{
    int64_t n = 0;

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            n += shef_row_u8(image, y)[x] == 255;
    return (double)n / image.width_px / image.height_px;
}

/* FNV-1a over every pixel of a pair. */
static uint64_t digest(const struct shef_synth_pair *pair)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);

    for (int32_t y = 0; y < pair->truth.height_px; y++)
        for (int32_t x = 0; x < pair->truth.width_px; x++) {
            uint32_t bits;

            memcpy(&bits, &shef_row_f32(pair->truth, y)[x], sizeof bits);
            hash = (hash ^ bits) * UINT64_C(0x100000001b3);
            hash = (hash ^ shef_row_u8(pair->frame_edge, y)[x]) * UINT64_C(0x100000001b3);
            hash = (hash ^ shef_row_u8(pair->event_edge, y)[x]) * UINT64_C(0x100000001b3);
        }
    return hash;
}

static uint64_t digest_of(const struct shef_synth_settings *settings, int32_t index)
{
    struct shef_synth *synth = shef_synth_create(settings, NULL);

    TEST_ASSERT_NOT_NULL(synth);
    const struct shef_synth_pair pair = shef_synth_make(synth, index);
    const uint64_t result = digest(&pair);

    shef_synth_destroy(synth);
    return result;
}

static void test_same_settings_make_the_same_pair_whatever_was_made_before(void)
{
    struct shef_synth *synth = shef_synth_create(&small, NULL);

    TEST_ASSERT_NOT_NULL(synth);
    (void)shef_synth_make(synth, 5);
    const struct shef_synth_pair pair = shef_synth_make(synth, 2);

    TEST_ASSERT_EQUAL_UINT64(digest_of(&small, 2), digest(&pair));
    shef_synth_destroy(synth);
}

static void test_another_seed_and_another_pair_differ(void)
{
    struct shef_synth_settings other = small;

    other.seed++;
    TEST_ASSERT_NOT_EQUAL_UINT64(digest_of(&small, 0), digest_of(&other, 0));
    TEST_ASSERT_NOT_EQUAL_UINT64(digest_of(&small, 0), digest_of(&small, 1));
}

static void test_densities_are_at_most_those_of_the_authors_maps(void)
{
    struct shef_synth *synth = shef_synth_create(&small, NULL);

    TEST_ASSERT_NOT_NULL(synth);
    for (int32_t i = 0; i < small.n_pairs; i++) {
        const struct shef_synth_pair pair = shef_synth_make(synth, i);

        TEST_ASSERT_TRUE(density(pair.frame_edge) > 0.10 && density(pair.frame_edge) < 0.31);
        TEST_ASSERT_TRUE(density(pair.event_edge) > 0.08 && density(pair.event_edge) < 0.28);
    }
    shef_synth_destroy(synth);
}

static void test_saturated_pairs_are_overfull_and_as_many_as_asked_for(void)
{
    struct shef_synth_settings settings = small;
    int n_saturated = 0;

    settings.saturated_share = 0.5;
    struct shef_synth *synth = shef_synth_create(&settings, NULL);

    TEST_ASSERT_NOT_NULL(synth);
    for (int32_t i = 0; i < settings.n_pairs; i++) {
        const struct shef_synth_pair pair = shef_synth_make(synth, i);

        n_saturated += pair.saturated;
        TEST_ASSERT_EQUAL(pair.saturated, density(pair.event_edge) > 0.4);
    }
    TEST_ASSERT_EQUAL_INT(3, n_saturated);
    shef_synth_destroy(synth);
}

static void test_truth_of_a_flat_wall_is_bf_over_depth(void)
{
    struct shef_synth_world world = { .seed = 1, .wall_m = { 2.5, 0, 0 } };
    const double from[3] = { 0.3, -0.2, 0.5 };
    const double direction[3] = { 0.2, 0.1, 1 };

    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0, shef_synth_world_look(&world, from, direction).depth_m);
}

static void test_box_hides_the_wall_only_where_it_stands(void)
{
    struct shef_synth_world world = {
        .wall_m = { 3, 0, 0 },
        .boxes = { { { 0, 0, 2 }, { 0.5, 0.25, 0.1 }, 1, 0 } },
        .n_boxes = 1,
    };
    const double from[3] = { 0, 0, 0 };

    /* Its front face is at 1.9 m: 0.5 / 1.9 = 0.2632 is its edge in the view. */
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-12, 1.9, shef_synth_world_look(&world, from, (double[3]){ 0.26, 0, 1 }).depth_m);
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-12, 3.0, shef_synth_world_look(&world, from, (double[3]){ 0.27, 0, 1 }).depth_m);
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-12, 3.0, shef_synth_world_look(&world, from, (double[3]){ 0, 0.14, 1 }).depth_m);
}

/* How many frame edges meet an event edge after a shift by truth + offset. */
static double agreement(const struct shef_synth_pair *pair, int32_t offset_px)
{
    int64_t n_edges = 0;
    int64_t n_met = 0;

    for (int32_t y = 0; y < pair->truth.height_px; y++)
        for (int32_t x = 60; x < pair->truth.width_px; x++) {
            const int32_t at = x - (int32_t)lrintf(shef_row_f32(pair->truth, y)[x]) - offset_px;

            if (shef_row_u8(pair->frame_edge, y)[x] == 0 || at < 0 || at >= pair->truth.width_px)
                continue;
            n_edges++;
            n_met += shef_row_u8(pair->event_edge, y)[at] == 255;
        }
    return (double)n_met / (double)n_edges;
}

static void test_edges_meet_at_the_true_disparity_and_nowhere_else(void)
{
    struct shef_synth *synth = shef_synth_create(&small, NULL);

    TEST_ASSERT_NOT_NULL(synth);
    for (int32_t i = 0; i < small.n_pairs; i++) {
        const struct shef_synth_pair pair = shef_synth_make(synth, i);
        const double there = agreement(&pair, 0);

        TEST_ASSERT_TRUE(there > 1.3 * agreement(&pair, -8));
        TEST_ASSERT_TRUE(there > 1.3 * agreement(&pair, 8));
        TEST_ASSERT_TRUE(there >= agreement(&pair, -2));
        TEST_ASSERT_TRUE(there >= agreement(&pair, 2));
    }
    shef_synth_destroy(synth);
}

static void test_scenes_share_out_all_pairs(void)
{
    for (int32_t n = 1; n <= 10; n++) {
        const struct shef_synth_settings settings = { .n_pairs = n };
        const struct shef_scenes scenes = shef_synth_scenes(&settings);
        int64_t next = 1;

        for (int32_t i = 0; i < scenes.n; i++) {
            TEST_ASSERT_EQUAL_INT64(next, scenes.at[i].first);
            next = scenes.at[i].last + 1;
        }
        TEST_ASSERT_EQUAL_INT64(n + 1, next);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_same_settings_make_the_same_pair_whatever_was_made_before);
    RUN_TEST(test_another_seed_and_another_pair_differ);
    RUN_TEST(test_densities_are_at_most_those_of_the_authors_maps);
    RUN_TEST(test_saturated_pairs_are_overfull_and_as_many_as_asked_for);
    RUN_TEST(test_truth_of_a_flat_wall_is_bf_over_depth);
    RUN_TEST(test_box_hides_the_wall_only_where_it_stands);
    RUN_TEST(test_edges_meet_at_the_true_disparity_and_nowhere_else);
    RUN_TEST(test_scenes_share_out_all_pairs);
    return UNITY_END();
}
