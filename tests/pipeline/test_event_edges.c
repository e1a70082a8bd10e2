#include "pipeline/event_edges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "filter_model.h"
#include "pipeline/snapshot_pool.h"

static struct shef_warp_map map;
static struct shef_event_edges *edges;
static struct shef_edge_map edge_map;
static struct shef_snapshot_pool *pool;
static struct shef_snapshot *earlier;
static struct shef_snapshot *later;

void setUp(void)
{
    const struct shef_rectification wide = shef_rectification_wide();
    struct shef_image_i16 scratch;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_map_create(&map, &wide, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshot_pool_create(&pool, 4, 640, 480, NULL));
    earlier = shef_snapshot_pool_begin(pool, &scratch);
    later = shef_snapshot_pool_begin(pool, &scratch);
}

void tearDown(void)
{
    shef_event_edges_destroy(edges);
    shef_edge_map_destroy(&edge_map);
    shef_warp_map_destroy(&map);
    shef_snapshot_pool_destroy(pool);
    edges = NULL;
    pool = NULL;
}

static void make_with(const struct shef_event_edges_params *params, uint32_t features)
{
    struct shef_error err = { 0 };

    shef_event_edges_destroy(edges);
    shef_edge_map_destroy(&edge_map);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_edges_create(&edges, &map, params, features, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&edge_map, params->kind, 640, 480, NULL));
}

static void make(enum shef_edge_kind kind)
{
    const struct shef_event_edges_params params = shef_event_edges_default_params(kind);

    make_with(&params, shef_cpu_features());
}

static int16_t *at(struct shef_image_i16 image, int32_t x, int32_t y)
{
    return shef_row_i16(image, y) + x;
}

/* Values of all sizes and both signs, every magnitude about once in 4000. */
static void fill_random(struct shef_image_i16 image)
{
    struct shef_test_random random = shef_test_random_start();

    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++)
            *at(image, x, y) = (int16_t)shef_test_random_range(&random, -4000, 4000);
}

static int edge_at(int32_t x, int32_t y)
{
    int8_t row[640];

    shef_edge_map_row(&edge_map, y, row);
    return row[x];
}

static void test_paper_mode_marks_the_strongest_quarter(void)
{
    make(SHEF_EDGE_UNSIGNED);
    fill_random(later->values);
    shef_event_edges_of_values(edges, later->values, NULL, &edge_map);

    const int threshold = (int)lrint(256 * shef_event_edges_threshold_c(edges));

    TEST_ASSERT_INT_WITHIN(20, 3000, threshold);
    TEST_ASSERT_INT64_WITHIN(90, 640 * 480 / 4, shef_edge_map_count(&edge_map));
    for (int32_t y = 0; y < 480; y++) {
        int8_t row[640];

        shef_edge_map_row(&edge_map, y, row);
        for (int32_t x = 0; x < 640; x++)
            TEST_ASSERT_EQUAL_INT8(abs(*at(later->values, x, y)) >= threshold, row[x]);
    }
}

static void test_ternary_mode_keeps_the_sign(void)
{
    make(SHEF_EDGE_TERNARY);
    fill_random(later->values);
    shef_event_edges_of_values(edges, later->values, NULL, &edge_map);
    TEST_ASSERT_INT64_WITHIN(90, 640 * 480 / 4, shef_edge_map_count(&edge_map));

    const int threshold = (int)lrint(256 * shef_event_edges_threshold_c(edges));

    for (int32_t x = 0; x < 640; x++) {
        const int value = *at(later->values, x, 77);

        TEST_ASSERT_EQUAL_INT((value >= threshold) - (value <= -threshold), edge_at(x, 77));
    }
}

static void test_graded_mode_clips_at_its_quantile(void)
{
    make(SHEF_EDGE_GRADED);
    fill_random(later->values);
    shef_event_edges_of_values(edges, later->values, NULL, &edge_map);

    const double limit = 256 * shef_event_edges_threshold_c(edges);
    int n_clipped = 0;

    TEST_ASSERT_DOUBLE_WITHIN(20, 3600, limit);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const double wanted = 127 * *at(later->values, x, y) / limit;
            const int8_t value = edge_map.graded[y * edge_map.graded_stride_bytes + x];

            TEST_ASSERT_TRUE(fabs(value - fmax(-127, fmin(127, wanted))) <= .55);
            n_clipped += fabs(wanted) >= 127;
        }
    TEST_ASSERT_INT_WITHIN(90, 640 * 480 / 10, n_clipped);
}

static void test_without_events_there_are_no_edges(void)
{
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                                 SHEF_EDGE_GRADED };

    for (int i = 0; i < 3; i++) {
        make(kinds[i]);
        shef_event_edges_of_values(edges, later->values, NULL, &edge_map);
        TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&edge_map));
        TEST_ASSERT_DOUBLE_WITHIN(.002, .3, shef_event_edges_threshold_c(edges));
    }
    /* Faint leftovers of old events are none either. */
    make(SHEF_EDGE_UNSIGNED);
    for (int32_t x = 0; x < 640; x++)
        *at(later->values, x, 5) = 60;
    *at(later->values, 100, 5) = 90;
    shef_event_edges_of_values(edges, later->values, NULL, &edge_map);
    TEST_ASSERT_EQUAL_INT64(1, shef_edge_map_count(&edge_map));
    TEST_ASSERT_EQUAL_INT(1, edge_at(100, 5));
}

static void test_thin_edges_are_one_pixel_wide(void)
{
    struct shef_event_edges_params params = shef_event_edges_default_params(SHEF_EDGE_UNSIGNED);

    params.is_thin = true;
    make_with(&params, shef_cpu_features());
    /* An upright edge of + and a level one of -, each with flanks. */
    for (int32_t y = 0; y < 480; y++)
        for (int32_t k = -2; k <= 2; k++)
            *at(later->values, 200 + k, y) = (int16_t)(1000 - 200 * abs(k));
    for (int32_t x = 300; x < 640; x++)
        for (int32_t k = -2; k <= 2; k++)
            *at(later->values, x, 300 + k) = (int16_t)(200 * abs(k) - 1000);
    shef_event_edges_of_values(edges, later->values, NULL, &edge_map);
    for (int32_t y = 0; y < 480; y++) {
        TEST_ASSERT_EQUAL_INT(1, edge_at(200, y));
        TEST_ASSERT_EQUAL_INT(0, edge_at(199, y));
        TEST_ASSERT_EQUAL_INT(0, edge_at(201, y));
    }
    for (int32_t x = 301; x < 639; x++) {
        TEST_ASSERT_EQUAL_INT(0, edge_at(x, 299));
        TEST_ASSERT_EQUAL_INT(1, edge_at(x, 300));
        TEST_ASSERT_EQUAL_INT(0, edge_at(x, 301));
    }
    TEST_ASSERT_INT64_WITHIN(12, 480 + 340, shef_edge_map_count(&edge_map));
}

static void test_the_pair_is_what_came_between_two_mid_exposures(void)
{
    make(SHEF_EDGE_GRADED);
    fill_random(earlier->sums);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++)
            *at(later->sums, x, y) = *at(earlier->sums, x, y);
    /* Sums run on past the end of 16 bits. */
    *at(earlier->sums, 10, 10) = 32700;
    *at(later->sums, 10, 10) = (int16_t)(32700 + 512 - 65536);
    *at(later->sums, 11, 10) = (int16_t)(*at(earlier->sums, 11, 10) - 256);
    /* The one difference without an opposite. */
    *at(earlier->sums, 12, 10) = 0;
    *at(later->sums, 12, 10) = INT16_MIN;
    shef_event_edges_of_pair(edges, earlier->sums, later->sums, NULL, &edge_map);
    TEST_ASSERT_EQUAL_INT64(3, shef_edge_map_count(&edge_map));
    TEST_ASSERT_EQUAL_INT(127, edge_at(10, 10));
    TEST_ASSERT_EQUAL_INT(-127, edge_at(11, 10));
    TEST_ASSERT_EQUAL_INT(-127, edge_at(12, 10));
    /* Values are clipped at the floor of 0.3 steps; bits are made from them as they are. */
    TEST_ASSERT_EQUAL_INT16(77, *at(shef_event_edges_values(edges), 10, 10));
    make(SHEF_EDGE_TERNARY);
    shef_event_edges_of_pair(edges, earlier->sums, later->sums, NULL, &edge_map);
    TEST_ASSERT_EQUAL_INT64(3, shef_edge_map_count(&edge_map));
    TEST_ASSERT_EQUAL_INT16(512, *at(shef_event_edges_values(edges), 10, 10));
    TEST_ASSERT_EQUAL_INT16(-256, *at(shef_event_edges_values(edges), 11, 10));
    TEST_ASSERT_EQUAL_INT16(-32767, *at(shef_event_edges_values(edges), 12, 10));
}

static void test_the_shift_is_applied(void)
{
    struct shef_warp_shift shift;

    make(SHEF_EDGE_TERNARY);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_shift_create(&shift, &map, NULL));
    shef_warp_shift_set(&shift, (double[3]){ -1, 0, 0 }, 3);
    *at(later->values, 50, 50) = -3000;
    shef_event_edges_of_values(edges, later->values, &shift, &edge_map);
    TEST_ASSERT_EQUAL_INT64(1, shef_edge_map_count(&edge_map));
    TEST_ASSERT_EQUAL_INT(-1, edge_at(53, 50));
    shef_warp_shift_destroy(&shift);
}

static void test_every_instruction_set_gives_the_same_map(void)
{
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_UNSIGNED,
                                                 SHEF_EDGE_TERNARY, SHEF_EDGE_GRADED };
    uint32_t features[4];
    const int n_features = shef_test_features(features);

    fill_random(later->values);
    for (int i = 0; i < 4; i++) {
        struct shef_event_edges_params params = shef_event_edges_default_params(kinds[i]);
        static int8_t expected[480][640];

        params.is_thin = i == 1;
        for (int k = 0; k < n_features; k++) {
            make_with(&params, features[k]);
            TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]), shef_event_edges_isa(edges));
            shef_event_edges_of_values(edges, later->values, NULL, &edge_map);
            for (int32_t y = 0; y < 480; y++) {
                int8_t row[640];

                shef_edge_map_row(&edge_map, y, k == 0 ? expected[y] : row);
                if (k > 0)
                    TEST_ASSERT_EQUAL_INT8_ARRAY(expected[y], row, 640);
            }
        }
    }
}

static void expect_refused(struct shef_event_edges_params params, const char *reason)
{
    struct shef_event_edges *made = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_event_edges_create(&made, &map, &params, SHEF_CPU_NONE, &err));
    TEST_ASSERT_NULL(made);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_sentence(void)
{
    struct shef_event_edges_params params = shef_event_edges_default_params(SHEF_EDGE_GRADED);

    params.quantile = 1;
    expect_refused(params, "quantile 1");
    params.quantile = NAN;
    expect_refused(params, "quantile");
    params = shef_event_edges_default_params(SHEF_EDGE_GRADED);
    params.floor_c = 0;
    expect_refused(params, "contrast steps");
    params = shef_event_edges_default_params(SHEF_EDGE_TERNARY);
    params.is_thin = true;
    expect_refused(params, "only unsigned ones can be thin");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_paper_mode_marks_the_strongest_quarter);
    RUN_TEST(test_ternary_mode_keeps_the_sign);
    RUN_TEST(test_graded_mode_clips_at_its_quantile);
    RUN_TEST(test_without_events_there_are_no_edges);
    RUN_TEST(test_thin_edges_are_one_pixel_wide);
    RUN_TEST(test_the_pair_is_what_came_between_two_mid_exposures);
    RUN_TEST(test_the_shift_is_applied);
    RUN_TEST(test_every_instruction_set_gives_the_same_map);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_sentence);
    return UNITY_END();
}
