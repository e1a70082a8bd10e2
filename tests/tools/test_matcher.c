/* Every matcher of the table on a pair that is known exactly, and the two corrections. */
#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "sheftool/matcher.h"
#include "sheftool/synth.h"
#include "support/support.h"

enum { WIDTH = 320, HEIGHT = 160, SHIFT = 20 };

static struct shef_edge_map frame;
static struct shef_edge_map event;
static struct shef_edge_map moved;
static struct shef_image_f32 disparity;
static struct shef_image_f32 confidence;

static void set_edge(struct shef_edge_map *map, int32_t x, int32_t y)
{
    map->plus[y * map->stride_words + x / 64] |= UINT64_C(1) << (x % 64);
}

static bool has_edge(const struct shef_edge_map *map, int32_t x, int32_t y)
{
    return map->plus[y * map->stride_words + x / 64] >> (x % 64) & 1;
}

/* A wall at 20 px: 5 x 5 px blobs in the frame, the same 20 px further left in the event map. */
void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&frame, SHEF_EDGE_UNSIGNED, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&event, SHEF_EDGE_UNSIGNED, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&moved, SHEF_EDGE_UNSIGNED, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&disparity, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&confidence, WIDTH, HEIGHT, NULL));
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++) {
            if (shef_synth_noise(9, x / 5.0, y / 5.0) < 0.62)
                continue;
            set_edge(&frame, x, y);
            if (x >= SHIFT)
                set_edge(&event, x - SHIFT, y);
        }
}

void tearDown(void)
{
    shef_edge_map_destroy(&frame);
    shef_edge_map_destroy(&event);
    shef_edge_map_destroy(&moved);
    shef_image_destroy_f32(&disparity);
    shef_image_destroy_f32(&confidence);
}

static struct shef_matcher_settings settings(void)
{
    return (struct shef_matcher_settings){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .max_disparity_px = 48,
        .cpu_features = shef_cpu_features(),
    };
}

static void test_every_matcher_finds_a_wall_of_20_px_at_frame_edges_only(void)
{
    for (int i = 0; i < SHEF_N_MATCHERS; i++) {
        const struct shef_matcher_kind *kind = shef_matchers[i];
        const struct shef_matcher_settings how = settings();
        struct shef_match_output out = { .disparity = disparity, .confidence = confidence };
        void *matcher = kind->create(&how, NULL);
        int n_found = 0;
        int n_right = 0;

        TEST_ASSERT_NOT_NULL_MESSAGE(matcher, kind->name);
        TEST_ASSERT_EQUAL(SHEF_OK, kind->match(matcher, &frame, &event, 1, &out, NULL));
        for (int32_t y = 40; y < HEIGHT - 40; y++)
            for (int32_t x = 120; x < WIDTH - 40; x++) {
                const float found = shef_row_f32(disparity, y)[x];

                if (!has_edge(&frame, x, y))
                    TEST_ASSERT_EQUAL_FLOAT(0, found);
                n_found += found > 0;
                n_right += fabsf(found - SHIFT) < 0.5f;
            }
        TEST_ASSERT_GREATER_THAN_INT_MESSAGE(1000, n_found, kind->name);
        TEST_ASSERT_GREATER_THAN_INT_MESSAGE(98 * n_found / 100, n_right, kind->name);
        kind->destroy(matcher);
    }
}

static void test_every_matcher_names_its_stages_and_refuses_a_range_beyond_the_width(void)
{
    for (int i = 0; i < SHEF_N_MATCHERS; i++) {
        const struct shef_matcher_kind *kind = shef_matchers[i];
        struct shef_matcher_settings how = settings();
        struct shef_error err;

        TEST_ASSERT_NOT_NULL(kind->stage_name(0));
        TEST_ASSERT_NULL(kind->stage_name(SHEF_MATCHER_MAX_STAGES));
        how.width_px = 40;
        TEST_ASSERT_NULL(kind->create(&how, &err));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "48 px does not fit"), err.text);
    }
}

static void test_maps_smaller_than_the_block_get_a_sentence_of_our_own(void)
{
    struct shef_matcher_settings small = settings();
    struct shef_error err = { 0 };

    small.width_px = 96;
    small.height_px = 40;
    TEST_ASSERT_NULL(shef_matcher_stereobm.create(&small, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
    TEST_ASSERT_EQUAL_STRING(
        "OpenCV's block of 61 x 61 px does not fit maps of 96 x 40 px; give larger maps", err.text);
}

static void test_table_order_is_that_of_the_choices(void)
{
    static const char *const names[] = { "robust", "paper-ds", "paper-dp", "opencv-stereobm",
                                         "opencv-stereosgbm" };

    for (int i = 0; i < SHEF_N_MATCHERS; i++)
        TEST_ASSERT_EQUAL_STRING(names[i], shef_matchers[i]->name);
}

static void test_aligning_moves_content_down_by_the_field(void)
{
    const struct shef_smooth_field two_down = { { 2, 0, 0, 0, 0, 0 }, WIDTH, HEIGHT };

    shef_edge_map_align(&frame, &two_down, &moved);
    for (int32_t x = 0; x < WIDTH; x++) {
        TEST_ASSERT_FALSE(has_edge(&moved, x, 0));
        TEST_ASSERT_FALSE(has_edge(&moved, x, 1));
        for (int32_t y = 2; y < HEIGHT; y++)
            TEST_ASSERT_EQUAL(has_edge(&frame, x, y - 2), has_edge(&moved, x, y));
    }
}

static void test_bias_is_subtracted_and_never_makes_an_estimate_of_none(void)
{
    const struct shef_smooth_field three = { { 3, 0, 0, 0, 0, 0 }, WIDTH, HEIGHT };

    shef_row_f32(disparity, 5)[5] = 20;
    shef_row_f32(disparity, 5)[6] = 2;
    shef_subtract_bias(disparity, &three);
    TEST_ASSERT_EQUAL_FLOAT(17, shef_row_f32(disparity, 5)[5]);
    TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(disparity, 5)[6]);
    TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(disparity, 5)[7]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_matcher_finds_a_wall_of_20_px_at_frame_edges_only);
    RUN_TEST(test_every_matcher_names_its_stages_and_refuses_a_range_beyond_the_width);
    RUN_TEST(test_maps_smaller_than_the_block_get_a_sentence_of_our_own);
    RUN_TEST(test_table_order_is_that_of_the_choices);
    RUN_TEST(test_aligning_moves_content_down_by_the_field);
    RUN_TEST(test_bias_is_subtracted_and_never_makes_an_estimate_of_none);
    return UNITY_END();
}
