#include "pipeline/kernels/bin_corr.h"

#include <stdio.h>
#include <string.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "core/workers.h"

struct pair {
    struct shef_bin_corr_params params;
    struct shef_edge_map left;
    struct shef_edge_map right;
};

struct result {
    struct shef_image_i16 disparity;
    struct shef_image_i16 sum;
};

static struct result run(const struct pair *pair, uint32_t features, int32_t n_threads)
{
    struct result result = {
        shef_test_image_i16(pair->params.width_px, pair->params.height_px),
        shef_test_image_i16(pair->params.width_px, pair->params.height_px),
    };
    struct shef_error err = { 0 };
    struct shef_bin_corr *corr = NULL;
    struct shef_workers *workers = n_threads > 1 ? shef_workers_create(n_threads, &err) : NULL;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_bin_corr_create(&corr, &pair->params, features, n_threads, &err), err.text);
    TEST_ASSERT_TRUE(shef_bin_corr_bytes(corr) > 0);
    TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features), shef_bin_corr_isa(corr));
    /* Twice: a run must not leave traces in the workspace. */
    for (int i = 0; i < 2; i++)
        shef_bin_corr_run(corr, &pair->left, &pair->right, workers, result.disparity, result.sum);
    shef_bin_corr_destroy(corr);
    shef_workers_destroy(workers);
    return result;
}

static void free_result(struct result *result)
{
    shef_image_destroy_i16(&result->disparity);
    shef_image_destroy_i16(&result->sum);
}

static void free_pair(struct pair *pair)
{
    shef_edge_map_destroy(&pair->left);
    shef_edge_map_destroy(&pair->right);
}

/* The definition, term by term. */
static int32_t sum_at(const struct pair *pair, int32_t x, int32_t y, int32_t d)
{
    const int32_t r = pair->params.window_px / 2;
    int32_t sum = 0;

    for (int32_t j = -r; j <= r; j++)
        for (int32_t i = -r; i <= r; i++)
            sum += shef_test_edge_at(&pair->left, x + i, y + j) *
                   shef_test_edge_at(&pair->right, x + i - d, y + j);
    return sum;
}

static void expect_definition_at(const struct pair *pair, const struct result *result, int32_t x,
                                 int32_t y)
{
    const struct shef_bin_corr_params *p = &pair->params;
    int32_t best = 0;
    int32_t best_d = SHEF_BIN_CORR_NONE;
    char where[96];

    if (p->everywhere || shef_test_edge_at(&pair->left, x, y) != 0) {
        best = INT32_MIN;
        for (int32_t d = p->d_min; d <= p->d_max; d++) {
            const int32_t sum = sum_at(pair, x, y, d);

            if (sum > best) {
                best = sum;
                best_d = d;
            }
        }
    }
    snprintf(where, sizeof where, "at (%d, %d) of %d x %d, window %d, range %d..%d", x, y,
             p->width_px, p->height_px, p->window_px, p->d_min, p->d_max);
    TEST_ASSERT_EQUAL_INT16_MESSAGE(best_d, shef_row_i16(result->disparity, y)[x], where);
    TEST_ASSERT_EQUAL_INT16_MESSAGE(best, shef_row_i16(result->sum, y)[x], where);
}

static void expect_definition(struct shef_test_random *random, const struct pair *pair,
                              const struct result *result, int n_pixels)
{
    for (int i = 0; i < n_pixels; i++)
        expect_definition_at(pair, result,
                             shef_test_random_range(random, 0, pair->params.width_px - 1),
                             shef_test_random_range(random, 0, pair->params.height_px - 1));
}

static void expect_same(const struct result *expected, const struct result *actual)
{
    const int32_t width = expected->sum.width_px;

    for (int32_t y = 0; y < expected->sum.height_px; y++) {
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(expected->disparity, y),
                                      shef_row_i16(actual->disparity, y), width);
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(expected->sum, y), shef_row_i16(actual->sum, y),
                                      width);
    }
}

/* The C reference by its definition at some pixels, the others by the reference everywhere. */
static void expect_all_isas_right(struct shef_test_random *random, const struct pair *pair,
                                  int n_pixels)
{
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);
    struct result expected = run(pair, isas[0], 1);

    expect_definition(random, pair, &expected, n_pixels);
    for (int isa = 1; isa < n_isas; isa++) {
        struct result actual = run(pair, isas[isa], 1);

        expect_same(&expected, &actual);
        free_result(&actual);
    }
    free_result(&expected);
}

static struct pair random_pair(struct shef_test_random *random)
{
    const bool is_tiny = shef_test_random_range(random, 0, 9) == 0;
    const bool is_signed = shef_test_random_range(random, 0, 2) == 0;
    const bool is_mixed = shef_test_random_range(random, 0, 5) == 0;
    const enum shef_edge_kind kind = is_signed ? SHEF_EDGE_TERNARY : SHEF_EDGE_UNSIGNED;
    struct pair pair = {
        .params = {
            .width_px = shef_test_random_range(random, 1, is_tiny ? 5 : 200),
            .height_px = shef_test_random_range(random, 1, is_tiny ? 5 : 60),
            .window_px = 2 * shef_test_random_range(random, 0, 63) + 1,
            .d_min = shef_test_random_range(random, 0, 20),
            .everywhere = shef_test_random_range(random, 0, 3) == 0,
        },
    };
    const double left_share = shef_test_random_unit(random);
    const double right_share = shef_test_random_unit(random);

    pair.params.d_max = pair.params.d_min + shef_test_random_range(random, 0, 299);
    pair.left = shef_test_random_map(random, kind, pair.params.width_px, pair.params.height_px,
                                     left_share * left_share);
    pair.right =
        shef_test_random_map(random, is_mixed ? SHEF_EDGE_TERNARY : kind, pair.params.width_px,
                             pair.params.height_px, right_share * right_share);
    return pair;
}

static void test_every_instruction_set_follows_the_definition(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 80; i++) {
        struct pair pair = random_pair(&random);

        expect_all_isas_right(&random, &pair, 20);
        free_pair(&pair);
    }
}

static void test_odd_and_large_sizes_and_ranges_follow_the_definition(void)
{
    static const struct shef_bin_corr_params cases[] = {
        { 641, 37, 51, 1, 16, false },  { 1280, 40, 121, 1, 256, false },
        { 333, 29, 21, 1, 80, true },   { 640, 30, 21, 1, 128, false },
        { 64, 33, 15, 0, 63, true },    { 129, 20, 9, 1, 192, false },
        { 1280, 720, 21, 1, 64, false }
    };
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct shef_bin_corr_params p = cases[i];
        struct pair pair = {
            p,
            shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, p.width_px, p.height_px, 0.3),
            shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, p.width_px, p.height_px, 0.2),
        };

        expect_all_isas_right(&random, &pair, 10);
        free_pair(&pair);
    }
}

static void test_windows_are_clipped_at_every_border(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int32_t window = 1; window <= SHEF_BIN_CORR_MAX_WINDOW_PX; window += 18) {
        struct pair pair = {
            { 67, 41, window, 1, 24, true },
            shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, 67, 41, 0.4),
            shef_test_random_map(&random, SHEF_EDGE_UNSIGNED, 67, 41, 0.4),
        };
        struct result result = run(&pair, shef_cpu_features(), 1);

        for (int32_t x = 0; x < 67; x += 3) {
            expect_definition_at(&pair, &result, x, 0);
            expect_definition_at(&pair, &result, x, 40);
        }
        for (int32_t y = 0; y < 41; y += 3) {
            expect_definition_at(&pair, &result, 0, y);
            expect_definition_at(&pair, &result, 66, y);
        }
        free_result(&result);
        free_pair(&pair);
    }
}

/* The largest sums of either sign there are. Every disparity ties, so the smallest must win. */
static void expect_largest_sum(enum shef_edge_kind kind, int right_sign)
{
    struct shef_test_random random = shef_test_random_start();
    struct pair pair = {
        { 401, 131, 127, 0, 127, false },
        shef_test_random_map(&random, kind, 401, 131, 0.0),
        shef_test_random_map(&random, kind, 401, 131, 0.0),
    };
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    for (int32_t y = 0; y < 131; y++)
        for (int32_t x = 0; x < 401; x++) {
            shef_test_set_edge(&pair.left, x, y, 1);
            shef_test_set_edge(&pair.right, x, y, right_sign);
        }
    for (int isa = 0; isa < n_isas; isa++) {
        struct result result = run(&pair, isas[isa], 1);

        TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(result.disparity, 65)[200]);
        TEST_ASSERT_EQUAL_INT16(right_sign * 127 * 127, shef_row_i16(result.sum, 65)[200]);
        expect_definition_at(&pair, &result, 30, 3);
        expect_definition_at(&pair, &result, 400, 130);
        free_result(&result);
    }
    free_pair(&pair);
}

static void test_full_maps_and_the_largest_window_do_not_overflow(void)
{
    expect_largest_sum(SHEF_EDGE_UNSIGNED, 1);
    expect_largest_sum(SHEF_EDGE_TERNARY, 1);
    expect_largest_sum(SHEF_EDGE_TERNARY, -1);
}

static void test_the_number_of_threads_never_shows(void)
{
    struct shef_test_random random = shef_test_random_start();
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    for (int i = 0; i < 6; i++) {
        struct pair pair = random_pair(&random);

        for (int isa = 0; isa < n_isas; isa++) {
            struct result alone = run(&pair, isas[isa], 1);

            for (int32_t n_threads = 2; n_threads <= 7; n_threads += 2) {
                struct result shared = run(&pair, isas[isa], n_threads);

                expect_same(&alone, &shared);
                free_result(&shared);
            }
            free_result(&alone);
        }
        free_pair(&pair);
    }
}

/* Copies a map, mirrored in x or in y. */
static struct shef_edge_map mirrored(const struct shef_edge_map *map, bool in_x, bool in_y)
{
    struct shef_edge_map copy;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&copy, map->kind, map->width_px, map->height_px, &err));
    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++)
            shef_test_set_edge(&copy, in_x ? map->width_px - 1 - x : x,
                               in_y ? map->height_px - 1 - y : y, shef_test_edge_at(map, x, y));
    return copy;
}

static void test_upside_down_maps_give_the_result_upside_down(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 10; i++) {
        struct pair pair = random_pair(&random);
        struct pair turned = { pair.params, mirrored(&pair.left, false, true),
                               mirrored(&pair.right, false, true) };
        struct result upright = run(&pair, shef_cpu_features(), 1);
        struct result upside_down = run(&turned, shef_cpu_features(), 1);

        for (int32_t y = 0; y < pair.params.height_px; y++) {
            const int32_t other_y = pair.params.height_px - 1 - y;

            TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(upright.disparity, y),
                                          shef_row_i16(upside_down.disparity, other_y),
                                          pair.params.width_px);
            TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(upright.sum, y),
                                          shef_row_i16(upside_down.sum, other_y),
                                          pair.params.width_px);
        }
        free_result(&upright);
        free_result(&upside_down);
        free_pair(&pair);
        free_pair(&turned);
    }
}

/* Seen in a mirror, left and right change places, and d stays: the pixel x that meets x - d is the
 * mirrored x - d that meets the mirrored x. This holds for the sums, not for the argmax, whose ties
 * do not change sides; so each range here is one disparity. */
static void test_left_and_right_change_places_in_a_mirror(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 20; i++) {
        struct pair pair = random_pair(&random);
        const int32_t d = pair.params.d_min;

        pair.params.d_max = d;
        pair.params.everywhere = true;

        struct pair exchanged = { pair.params, mirrored(&pair.right, true, false),
                                  mirrored(&pair.left, true, false) };
        struct result seen = run(&pair, shef_cpu_features(), 1);
        struct result in_mirror = run(&exchanged, shef_cpu_features(), 1);

        for (int32_t y = 0; y < pair.params.height_px; y++)
            for (int32_t x = d; x < pair.params.width_px; x++) {
                const int32_t mirrored_x = pair.params.width_px - 1 - (x - d);

                TEST_ASSERT_EQUAL_INT16(shef_row_i16(seen.sum, y)[x],
                                        shef_row_i16(in_mirror.sum, y)[mirrored_x]);
            }
        free_result(&seen);
        free_result(&in_mirror);
        free_pair(&pair);
        free_pair(&exchanged);
    }
}

static void expect_refused(struct shef_bin_corr_params params, const char *reason)
{
    struct shef_bin_corr *corr = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_bin_corr_create(&corr, &params, 0, 1, &err));
    TEST_ASSERT_NULL(corr);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_reason(void)
{
    expect_refused((struct shef_bin_corr_params){ 0, 480, 21, 1, 80, false }, "1 to 16384");
    expect_refused((struct shef_bin_corr_params){ INT32_MAX, 480, 21, 1, 80, false }, "1 to 16384");
    expect_refused((struct shef_bin_corr_params){ 640, 16385, 21, 1, 80, false }, "1 to 16384");
    expect_refused((struct shef_bin_corr_params){ 640, 480, 20, 1, 80, false }, "odd");
    expect_refused((struct shef_bin_corr_params){ 640, 480, 129, 1, 80, false }, "1 to 127");
    expect_refused((struct shef_bin_corr_params){ 640, 480, 21, -1, 80, false }, "range -1..80");
    expect_refused((struct shef_bin_corr_params){ 640, 480, 21, 9, 8, false }, "range 9..8");
    expect_refused((struct shef_bin_corr_params){ 640, 480, 21, 1, 5000, false }, "0..4095");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_instruction_set_follows_the_definition);
    RUN_TEST(test_odd_and_large_sizes_and_ranges_follow_the_definition);
    RUN_TEST(test_windows_are_clipped_at_every_border);
    RUN_TEST(test_full_maps_and_the_largest_window_do_not_overflow);
    RUN_TEST(test_the_number_of_threads_never_shows);
    RUN_TEST(test_upside_down_maps_give_the_result_upside_down);
    RUN_TEST(test_left_and_right_change_places_in_a_mirror);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_reason);
    return UNITY_END();
}
