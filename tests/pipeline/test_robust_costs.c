/* The matcher's costs against the definition, in double precision.
 *
 * At cell (gx, gy) and disparity d = (k + 1) step, over the window's pixels: columns
 * 2 (gx - half) .. 2 (gx + half) + 1 of the left map, those less d of the right map; rows
 * likewise, those outside the image left out. Columns outside count as pixels without an edge,
 * and so does the row that an odd height lacks to a whole cell. With n pixels, the sums a and b
 * of left and right values, the sum s of their products and the sums aa and bb of their squares:
 *
 *   z = (s - a b / n) / sqrt((aa - a^2 / n + f) (bb - b^2 / n + f)),  cost = 500 (1 - z)
 *
 * f is the regularisation, a share of the whole window's largest variance.  */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "robust_cases.h"

/* Costs are 0..1000. The factors are rounded to 15 bits, the products between them to 16; the
 * largest difference in 80 000 costs with 16 seeds was 2.1. */
#define TOLERANCE 4.0

static struct shef_robust *matcher;
static struct edges edges[2];

void tearDown(void)
{
    shef_robust_destroy(matcher);
    matcher = NULL;
    for (int i = 0; i < 2; i++)
        edges_destroy(&edges[i]);
}

/* Maps in the matcher's own grades. A graded value v stands for v * amplitude / 127, rounded; the
 * random maps hold only those v that are a whole grade. */
static int32_t grade_at(const struct shef_edge_map *map, int32_t x, int32_t y)
{
    const int32_t value = edge_at(map, x, y);

    return map->kind == SHEF_EDGE_GRADED
               ? (int32_t)lrint(value * (double)matcher->shape.amplitude / 127.0)
               : value;
}

static void to_whole_grades(struct shef_edge_map *map)
{
    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++)
            edge_set(map, x, y,
                     (int32_t)lrint(grade_at(map, x, y) * 127.0 / matcher->shape.amplitude));
}

static double defined_cost(const struct edges *pair, int32_t gx, int32_t gy, int32_t d)
{
    const struct shef_robust_params *params = &matcher->params;
    const int32_t half_width = params->window_width_cells / 2;
    const int32_t half_height = params->window_height_cells / 2;
    const int32_t last_row = (params->height_px + 1) / 2 - 1;
    const double amplitude = matcher->shape.amplitude;
    const double f = params->regularisation * 4.0 * params->window_width_cells *
                     params->window_height_cells * amplitude * amplitude;
    double n = 0, a = 0, b = 0, s = 0, aa = 0, bb = 0;

    for (int32_t cy = gy - half_height; cy <= gy + half_height; cy++) {
        if (cy < 0 || cy > last_row)
            continue;
        for (int32_t y = 2 * cy; y < 2 * cy + 2; y++)
            for (int32_t x = 2 * (gx - half_width); x < 2 * (gx + half_width + 1); x++) {
                const double left = grade_at(&pair->left, x, y);
                const double right = grade_at(&pair->right, x - d, y);

                n += 1;
                a += left;
                b += right;
                s += left * right;
                aa += left * left;
                bb += right * right;
            }
    }
    return 500.0 - 500.0 * (s - a * b / n) / sqrt((aa - a * a / n + f) * (bb - b * b / n + f));
}

static double cost_at(int32_t gx, int32_t gy, int32_t level)
{
    const struct robust_shape *shape = &matcher->shape;
    const size_t cell = (size_t)gy * (size_t)shape->grid_width + (size_t)gx;

    return matcher->costs[cell * (size_t)shape->n_lanes + (size_t)level];
}

/* Matches the pairs without a past. */
static void match_pairs(int32_t n_pairs)
{
    struct result result = result_create(matcher->params.width_px, matcher->params.height_px);
    const struct shef_edge_pair pairs[2] = { edges_pair(&edges[0]), edges_pair(&edges[1]) };

    shef_robust_reset(matcher);
    shef_robust_match(matcher, pairs, n_pairs, 1, &result.images, NULL);
    result_destroy(&result);
}

static double largest_error;

static void expect_cost(int32_t n_pairs, int32_t gx, int32_t gy, int32_t level)
{
    const struct shef_robust_params *p = &matcher->params;
    const int32_t d = (level + 1) * p->step_px;
    double expected = defined_cost(&edges[0], gx, gy, d);
    char where[200];

    if (n_pairs == 2)
        expected = (expected + defined_cost(&edges[1], gx, gy, d)) / 2.0;
    snprintf(where, sizeof where,
             "cell (%d, %d), %d px, kind %d, %d x %d px, window %d x %d cells, range %d step %d, "
             "%d pairs",
             gx, gy, d, p->kind, p->width_px, p->height_px, p->window_width_cells,
             p->window_height_cells, p->max_disparity_px, p->step_px, n_pairs);
    largest_error = fmax(largest_error, fabs(expected - cost_at(gx, gy, level)));

    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(TOLERANCE, expected, cost_at(gx, gy, level), where);
}

static void create_case(struct shef_test_random *random, const struct shef_robust_params *params,
                        double share)
{
    tearDown();
    matcher = matcher_create(params, NULL);
    for (int i = 0; i < 2; i++) {
        edges[i] = edges_random(random, params->kind, params->width_px, params->height_px, share);
        to_whole_grades(&edges[i].left);
        to_whole_grades(&edges[i].right);
        /* Two maps that have something in common, as matching ones do. */
        for (int32_t y = 0; y < params->height_px; y++)
            for (int32_t x = 20; x < params->width_px; x++)
                if (shef_test_random_range(random, 0, 1))
                    edge_set(&edges[i].right, x - 20, y, edge_at(&edges[i].left, x, y));
    }
}

static struct shef_robust_params random_params(struct shef_test_random *random)
{
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                                 SHEF_EDGE_GRADED };
    static const double regularisations[] = { 0.005, 0.01, 0.1, 0.5 };
    const int32_t width = shef_test_random_range(random, 33, 301);
    const int32_t height = shef_test_random_range(random, 32, 121);
    struct shef_robust_params params =
        shef_robust_defaults(width, height, kinds[shef_test_random_range(random, 0, 2)]);
    const int32_t most = width - 1 < 256 ? width - 1 : 256;

    params.step_px = shef_test_random_range(random, 1, 2);
    params.max_disparity_px =
        shef_test_random_range(random, 16, most) / params.step_px * params.step_px;
    params.window_width_cells = 2 * shef_test_random_range(random, 0, 15) + 1;
    params.window_height_cells = 2 * shef_test_random_range(random, 0, 15) + 1;
    params.regularisation = regularisations[shef_test_random_range(random, 0, 3)];
    return params;
}

static void expect_defined_costs(struct shef_test_random *random, int32_t n_pairs,
                                 int32_t n_samples)
{
    const struct robust_shape *shape = &matcher->shape;

    match_pairs(n_pairs);
    for (int32_t i = 0; i < n_samples; i++) {
        /* One in four at a border, where windows are cut. */
        const int32_t gx = shef_test_random_range(random, 0, 3)
                               ? shef_test_random_range(random, 0, shape->grid_width - 1)
                               : (i % 2) * (shape->grid_width - 1);
        const int32_t gy = shef_test_random_range(random, 0, 3)
                               ? shef_test_random_range(random, 0, shape->grid_height - 1)
                               : (i / 2 % 2) * (shape->grid_height - 1);

        expect_cost(n_pairs, gx, gy, shef_test_random_range(random, 0, shape->n_levels - 1));
    }
}

static void test_costs_follow_the_definition(void)
{
    struct shef_test_random random = shef_test_random_start();

    largest_error = 0.0;
    for (int i = 0; i < 80; i++) {
        const struct shef_robust_params params = random_params(&random);

        create_case(&random, &params, 0.02 + 0.9 * shef_test_random_unit(&random));
        expect_defined_costs(&random, 1 + i % 2, 60);
    }
    printf("largest difference from the definition: %.2f of 1000\n", largest_error);
}

static void test_odd_and_large_sizes_and_ranges_follow_the_definition(void)
{
    static const struct {
        int32_t width_px, height_px, max_disparity_px, step_px;
    } cases[] = {
        { 33, 37, 16, 1 },  { 33, 37, 32, 2 },    { 32, 32, 31, 1 },
        { 641, 97, 80, 2 }, { 259, 101, 256, 1 }, { 1280, 720, 256, 2 },
    };
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct shef_robust_params params =
            shef_robust_defaults(cases[i].width_px, cases[i].height_px, SHEF_EDGE_UNSIGNED);

        params.max_disparity_px = cases[i].max_disparity_px;
        params.step_px = cases[i].step_px;
        create_case(&random, &params, 0.28);
        expect_defined_costs(&random, 1, 200);
    }
}

static void test_every_cell_and_level_of_a_small_pair_follows_the_definition(void)
{
    struct shef_test_random random = shef_test_random_start();
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                                 SHEF_EDGE_GRADED };

    for (int i = 0; i < 3; i++) {
        struct shef_robust_params params = shef_robust_defaults(39, 33, kinds[i]);

        params.max_disparity_px = 20;
        params.window_width_cells = 5;
        params.window_height_cells = 7;
        create_case(&random, &params, 0.3);
        match_pairs(1);
        for (int32_t gy = 0; gy < 17; gy++)
            for (int32_t gx = 0; gx < 20; gx++)
                for (int32_t level = 0; level < 10; level++)
                    expect_cost(1, gx, gy, level);
    }
}

/* A copy of the volume, lanes without a level included. */
static uint16_t *copy_of_costs(size_t *out_n_costs)
{
    const struct robust_shape *shape = &matcher->shape;
    const size_t n = (size_t)(shape->grid_width * shape->grid_height * shape->n_lanes);
    uint16_t *copy = malloc(n * sizeof *copy);

    TEST_ASSERT_NOT_NULL(copy);
    *out_n_costs = n;
    return memcpy(copy, matcher->costs, n * sizeof *copy);
}

static void test_two_pairs_cost_the_mean_of_both(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int i = 0; i < 6; i++) {
        const struct shef_robust_params params = random_params(&random);
        uint16_t *costs[2];
        size_t n_costs;

        create_case(&random, &params, 0.3);
        for (int j = 0; j < 2; j++) {
            struct edges swap = edges[0];

            match_pairs(1);
            costs[j] = copy_of_costs(&n_costs);
            edges[0] = edges[1];
            edges[1] = swap;
        }
        match_pairs(2);
        for (size_t j = 0; j < n_costs; j++)
            TEST_ASSERT_EQUAL_UINT16((costs[0][j] + costs[1][j] + 1) / 2, matcher->costs[j]);
        free(costs[0]);
        free(costs[1]);
    }
}

/* Fills every pixel with the kind's largest or smallest value. */
static void fill(struct shef_edge_map *map, int sign)
{
    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++)
            edge_set(map, x, y, map->kind == SHEF_EDGE_GRADED ? sign * 127 : sign);
}

static void test_full_maps_and_the_largest_window_do_not_overflow(void)
{
    struct shef_test_random random = shef_test_random_start();
    static const struct {
        enum shef_edge_kind kind;
        int sign;
    } cases[] = { { SHEF_EDGE_UNSIGNED, 1 },
                  { SHEF_EDGE_TERNARY, 1 },
                  { SHEF_EDGE_TERNARY, -1 },
                  { SHEF_EDGE_GRADED, 1 },
                  { SHEF_EDGE_GRADED, -1 } };

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        for (int32_t window = 7; window <= 31; window += 24) {
            struct shef_robust_params params = shef_robust_defaults(160, 97, cases[i].kind);

            params.window_width_cells = window;
            params.window_height_cells = window;
            create_case(&random, &params, 0.0);
            fill(&edges[0].left, 1);
            fill(&edges[0].right, cases[i].sign);
            expect_defined_costs(&random, 1, 60);
        }
}

/* Half black, half full, in step: the largest variance and covariance that a window can have. */
static void test_the_strongest_correlations_do_not_overflow(void)
{
    struct shef_test_random random = shef_test_random_start();
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                                 SHEF_EDGE_GRADED };

    for (int i = 0; i < 3; i++)
        for (int32_t window = 1; window <= 31; window += 6) {
            struct shef_robust_params params = shef_robust_defaults(160, 97, kinds[i]);

            params.window_width_cells = window;
            params.window_height_cells = window;
            create_case(&random, &params, 0.0);
            for (int32_t y = 0; y < 97; y++)
                for (int32_t x = 0; x < 160; x++) {
                    const int32_t high = kinds[i] == SHEF_EDGE_GRADED ? 127 : 1;
                    const int32_t value = x / 10 % 2 ? high : kinds[i] ? -high : 0;

                    edge_set(&edges[0].left, x, y, value);
                    edge_set(&edges[0].right, x, y, value);
                }
            expect_defined_costs(&random, 1, 60);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_costs_follow_the_definition);
    RUN_TEST(test_odd_and_large_sizes_and_ranges_follow_the_definition);
    RUN_TEST(test_every_cell_and_level_of_a_small_pair_follows_the_definition);
    RUN_TEST(test_two_pairs_cost_the_mean_of_both);
    RUN_TEST(test_full_maps_and_the_largest_window_do_not_overflow);
    RUN_TEST(test_the_strongest_correlations_do_not_overflow);
    return UNITY_END();
}
