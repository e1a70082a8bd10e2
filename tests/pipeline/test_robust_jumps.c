/* Outlines at jumps of depth: a bar in front of a wall keeps its width, a wall stays as it was. */
#include "pipeline/robust.h"

#include <math.h>
#include <stdio.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "core/workers.h"
#include "robust_cases.h"

#define WIDTH_PX  241
#define HEIGHT_PX 161
#define WALL_PX   7.25
#define BAR_PX    15.5

/* A bar across the whole picture: columns or rows first..last of the left view. */
struct bar {
    bool is_level;
    int32_t first;
    int32_t last;
};

struct bar_scene {
    struct edges edges;
    struct shef_image_u8 picture; /* the bar is brighter than the wall */
};

static bool is_on_bar(const struct bar *bar, double x, double y)
{
    const double at = bar->is_level ? y : x;

    return at > bar->first - 0.5 && at < bar->last + 0.5;
}

/* A pixel of a texture of the cases' own, at any place. */
static int32_t texture_at(const struct edges *texture, double x, int32_t y)
{
    return edge_at(&texture->right, (int32_t)lrint(x), y);
}

/* Both views of the bar: each surface's texture lies in the right view's columns, and the bar hides
 * the wall. */
static struct bar_scene bar_scene_create(enum shef_edge_kind kind, const struct bar *bar,
                                         uint64_t texture)
{
    struct bar_scene scene = { .edges = edges_create(kind, WIDTH_PX, HEIGHT_PX) };
    struct scene surface = { .kind = kind, .width_px = WIDTH_PX, .height_px = HEIGHT_PX };
    struct edges textures[2];
    struct shef_error err = { 0 };

    for (int i = 0; i < 2; i++) {
        surface.texture = texture + 100 * (uint64_t)i;
        textures[i] = edges_of_scene(&surface);
    }
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_image_create_u8(&scene.picture, WIDTH_PX, HEIGHT_PX, &err), err.text);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const bool is_left = is_on_bar(bar, x, y);
            const bool is_right = is_on_bar(bar, x + BAR_PX, y);

            edge_set(&scene.edges.left, x, y,
                     texture_at(&textures[is_left], x - (is_left ? BAR_PX : WALL_PX), y));
            edge_set(&scene.edges.right, x, y, texture_at(&textures[is_right], x, y));
            shef_row_u8(scene.picture, y)[x] = is_left ? 170 : 90;
        }
    edges_destroy(&textures[0]);
    edges_destroy(&textures[1]);
    return scene;
}

static void bar_scene_destroy(struct bar_scene *scene)
{
    edges_destroy(&scene->edges);
    shef_image_destroy_u8(&scene->picture);
}

static struct shef_robust_params params_of(enum shef_edge_kind kind, int32_t reach_px)
{
    struct shef_robust_params params = shef_robust_defaults(WIDTH_PX, HEIGHT_PX, kind);

    params.step_px = 1;
    params.max_disparity_px = 31;
    params.window_width_cells = 7;
    params.window_height_cells = 7;
    params.p1 = 360;
    params.p2 = 1200;
    params.score_weight = 16;
    params.jump_reach_px = reach_px;
    return params;
}

static struct result match_bar(struct shef_robust *matcher, const struct bar_scene *scene,
                               bool has_picture)
{
    struct result result = result_create(WIDTH_PX, HEIGHT_PX);
    struct shef_edge_pair pair = edges_pair(&scene->edges);

    if (has_picture)
        pair.picture = scene->picture;
    shef_robust_reset(matcher);
    shef_robust_match(matcher, &pair, 1, 1, &result.images, &result.report);
    return result;
}

/* Mean of how many pixels the bar is too wide, and share of pixels that are on the wrong surface,
 * of those whose place both views see. */
struct verdict {
    double too_wide_px;
    double wrong;
};

static struct verdict judge(const struct bar *bar, const struct result *result)
{
    struct verdict verdict = { 0 };
    int64_t n = 0;
    int64_t n_lines = 0;

    for (int32_t y = 16; y < HEIGHT_PX - 16; y++)
        for (int32_t x = 48; x < WIDTH_PX - 16; x++) {
            const bool is_bar = is_on_bar(bar, x, y);
            const bool is_hidden = !is_bar && is_on_bar(bar, x - WALL_PX + BAR_PX, y);
            const float d = shef_row_f32(result->images.dense_disparity, y)[x];
            const bool found_bar = d > (WALL_PX + BAR_PX) / 2;

            if (is_hidden)
                continue;
            n++;
            verdict.wrong += found_bar != is_bar;
            verdict.too_wide_px += (int)found_bar - (int)is_bar;
        }
    n_lines = bar->is_level ? WIDTH_PX - 16 - 48 : HEIGHT_PX - 32;
    verdict.wrong /= (double)n;
    verdict.too_wide_px /= (double)n_lines;
    return verdict;
}

/* Outlines that lie on whole cells, and such that do not. */
static const struct bar bars[] = {
    { false, 100, 131 },
    { false, 99, 122 },
    { true, 60, 83 },
    { true, 57, 90 },
};

static void expect_width_is_kept(bool has_picture, double limit_px, double limit_share)
{
    for (int kind = 0; kind < 3; kind++) {
        const struct shef_robust_params before = params_of((enum shef_edge_kind)kind, 0);
        const struct shef_robust_params after = params_of((enum shef_edge_kind)kind, 4);
        struct shef_robust *stays = matcher_create(&before, NULL);
        struct shef_robust *moves = matcher_create(&after, NULL);

        for (size_t i = 0; i < sizeof bars / sizeof bars[0]; i++) {
            struct bar_scene scene =
                bar_scene_create((enum shef_edge_kind)kind, &bars[i], 30 + (uint64_t)i);
            struct result raw = match_bar(stays, &scene, has_picture);
            struct result settled = match_bar(moves, &scene, has_picture);
            const struct verdict was = judge(&bars[i], &raw);
            const struct verdict is = judge(&bars[i], &settled);

            printf("kind %d, bar %zu: too wide by %+.2f px, %.2f %% wrong; before %+.2f px, "
                   "%.2f %%\n",
                   kind, i, is.too_wide_px, 100 * is.wrong, was.too_wide_px, 100 * was.wrong);
            expect_at_most(limit_px, fabs(is.too_wide_px), "error of the width (px)");
            expect_at_most(limit_share * was.wrong, is.wrong, "share on the wrong surface");
            result_destroy(&raw);
            result_destroy(&settled);
            bar_scene_destroy(&scene);
        }
        shef_robust_destroy(stays);
        shef_robust_destroy(moves);
    }
}

static void test_a_bar_before_a_wall_keeps_its_width(void)
{
    expect_width_is_kept(true, 0.3, 0.3);
}

static void test_the_maps_alone_tell_much_of_it(void)
{
    expect_width_is_kept(false, 1.75, 0.85);
}

/* No jump is there, so nothing is touched, whatever the picture shows. */
static void test_a_wall_without_jumps_stays_bit_for_bit(void)
{
    for (int kind = 0; kind < 3; kind++) {
        const struct bar nowhere = { false, -100, -90 };
        const struct bar stripe = { false, 100, 131 };
        const struct shef_robust_params before = params_of((enum shef_edge_kind)kind, 0);
        const struct shef_robust_params after = params_of((enum shef_edge_kind)kind, 4);
        struct bar_scene wall = bar_scene_create((enum shef_edge_kind)kind, &nowhere, 7);
        struct bar_scene striped = bar_scene_create((enum shef_edge_kind)kind, &stripe, 7);
        struct shef_robust *stays = matcher_create(&before, NULL);
        struct shef_robust *moves = matcher_create(&after, NULL);
        struct result raw = match_bar(stays, &wall, true);

        for (int32_t y = 16; y < HEIGHT_PX - 16; y++)
            for (int32_t x = 48; x < WIDTH_PX - 16; x++)
                TEST_ASSERT_FLOAT_WITHIN(1.0f, (float)WALL_PX,
                                         shef_row_f32(raw.images.dense_disparity, y)[x]);

        const struct shef_image_u8 own = wall.picture;

        wall.picture = striped.picture;

        struct result settled = match_bar(moves, &wall, true);

        wall.picture = own;
        for (int32_t y = 16; y < HEIGHT_PX - 16; y++) {
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(raw.images.dense_disparity, y) + 48,
                                     shef_row_f32(settled.images.dense_disparity, y) + 48,
                                     (WIDTH_PX - 16 - 48) * sizeof(float));
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(raw.images.confidence, y) + 48,
                                     shef_row_f32(settled.images.confidence, y) + 48,
                                     (WIDTH_PX - 16 - 48) * sizeof(float));
        }
        result_destroy(&raw);
        result_destroy(&settled);
        bar_scene_destroy(&wall);
        bar_scene_destroy(&striped);
        shef_robust_destroy(stays);
        shef_robust_destroy(moves);
    }
}

/* With a reach of 0 the stage is not there: neither the picture nor its other parameters show. */
static void test_without_reach_nothing_of_it_shows(void)
{
    struct bar_scene scene = bar_scene_create(SHEF_EDGE_GRADED, &bars[0], 11);
    struct shef_robust_params params = params_of(SHEF_EDGE_GRADED, 0);
    struct shef_robust *plain = matcher_create(&params, NULL);

    params.jump_least_px = 0.25;
    params.jump_picture_weight = 64;
    params.jump_growth_cost = 0;

    struct shef_robust *other = matcher_create(&params, NULL);
    struct result expected = match_bar(plain, &scene, false);
    struct result actual = match_bar(other, &scene, true);

    expect_same_result(&expected, &actual);
    TEST_ASSERT_EQUAL_size_t(shef_robust_memory_bytes(plain), shef_robust_memory_bytes(other));
    result_destroy(&expected);
    result_destroy(&actual);
    bar_scene_destroy(&scene);
    shef_robust_destroy(plain);
    shef_robust_destroy(other);
}

/* Two pairs, as in the combined mode, and maps of odd size. */
static struct result match_twice(const struct shef_robust_params *params,
                                 struct shef_workers *workers, uint32_t features,
                                 const struct bar_scene scenes[2])
{
    struct result result = result_create(WIDTH_PX, HEIGHT_PX);
    struct shef_error err = { 0 };
    struct shef_robust *matcher = shef_robust_create(params, features, workers, &err);
    struct shef_edge_pair pairs[2] = { edges_pair(&scenes[0].edges), edges_pair(&scenes[1].edges) };
    const struct shef_smooth_field bias = { .c = { 0.75, 0.25 },
                                            .width_px = WIDTH_PX,
                                            .height_px = HEIGHT_PX };

    TEST_ASSERT_NOT_NULL_MESSAGE(matcher, err.text);
    pairs[0].picture = scenes[0].picture;
    shef_robust_align_auto(matcher);
    shef_robust_set_bias(matcher, &bias);
    for (int64_t number = 1; number <= 2; number++)
        shef_robust_match(matcher, pairs, 2, number, &result.images, &result.report);
    shef_robust_destroy(matcher);
    return result;
}

static void test_workers_and_instruction_sets_do_not_show(void)
{
    for (int kind = 0; kind < 3; kind++) {
        const struct shef_robust_params params = params_of((enum shef_edge_kind)kind, 4);
        const struct bar_scene scenes[2] = {
            bar_scene_create((enum shef_edge_kind)kind, &bars[1], 21),
            bar_scene_create((enum shef_edge_kind)kind, &bars[1], 22),
        };
        struct result expected = match_twice(&params, NULL, SHEF_CPU_NONE, scenes);
        uint32_t isas[4];
        const int n_isas = shef_test_isas(isas);

        for (int32_t n_workers = 1; n_workers <= 5; n_workers += 2)
            for (int isa = 0; isa < n_isas; isa++) {
                struct shef_workers *workers = shef_workers_create(n_workers, NULL);
                struct result actual = match_twice(&params, workers, isas[isa], scenes);

                expect_same_result(&expected, &actual);
                result_destroy(&actual);
                shef_workers_destroy(workers);
            }
        result_destroy(&expected);
        for (int i = 0; i < 2; i++) {
            struct bar_scene scene = scenes[i];

            bar_scene_destroy(&scene);
        }
    }
}

/* Maps of nothing but noise jump everywhere, borders included: every pixel keeps an estimate that
 * some level stands for. */
static void test_noise_up_to_the_borders_is_no_harm(void)
{
    static const int32_t sizes[][2] = { { 32, 32 }, { 33, 35 }, { 71, 32 }, { 40, 77 } };
    struct shef_test_random draws = shef_test_random_start();

    for (int kind = 0; kind < 3; kind++)
        for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
            for (int32_t reach_px = 1; reach_px <= SHEF_ROBUST_MAX_REACH_PX; reach_px++) {
                const int32_t width_px = sizes[i][0];
                const int32_t height_px = sizes[i][1];
                struct edges edges =
                    edges_random(&draws, (enum shef_edge_kind)kind, width_px, height_px, 0.5);
                struct shef_robust_params params =
                    shef_robust_defaults(width_px, height_px, (enum shef_edge_kind)kind);

                params.step_px = 1;
                params.max_disparity_px = 24;
                params.p1 = 10;
                params.p2 = 20;
                params.jump_least_px = 0.25;
                params.jump_reach_px = reach_px;

                struct shef_robust *matcher = matcher_create(&params, NULL);
                struct result result = match(matcher, &edges, 1);

                for (int32_t y = 0; y < height_px; y++)
                    for (int32_t x = 0; x < width_px; x++) {
                        const float d = shef_row_f32(result.images.dense_disparity, y)[x];
                        const float p = shef_row_f32(result.images.dense_confidence, y)[x];

                        TEST_ASSERT_TRUE(d >= 0.5f && d <= 24.5f);
                        TEST_ASSERT_TRUE(p > 0.0f && p < 1.0f);
                    }
                result_destroy(&result);
                edges_destroy(&edges);
                shef_robust_destroy(matcher);
            }
}

/* Pixels are settled in the caller's dense images where there are any, else in the matcher's own
 * memory: sparse results are the same, also of a matcher that was used before. */
static void test_which_images_are_wanted_does_not_show(void)
{
    struct shef_test_random draws = shef_test_random_start();

    for (int32_t width_px = 90; width_px <= 91; width_px++) {
        struct edges other = edges_random(&draws, SHEF_EDGE_GRADED, width_px, 60, 0.5);
        struct edges edges = edges_random(&draws, SHEF_EDGE_GRADED, width_px, 60, 0.5);
        struct shef_robust_params params = shef_robust_defaults(width_px, 60, SHEF_EDGE_GRADED);

        params.max_disparity_px = 24;
        params.jump_reach_px = 4;

        struct shef_robust *fresh = matcher_create(&params, NULL);
        struct shef_robust *used = matcher_create(&params, NULL);
        struct result expected = match(fresh, &edges, 1);
        struct result before = match(used, &other, 1);
        struct result sparse = result_create(width_px, 60);
        const struct shef_edge_pair pair = edges_pair(&edges);
        const struct shef_robust_output wanted = { .disparity = sparse.images.disparity,
                                                   .confidence = sparse.images.confidence };

        shef_robust_reset(used);
        shef_robust_match(used, &pair, 1, 1, &wanted, NULL);
        for (int32_t y = 0; y < 60; y++) {
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(expected.images.disparity, y),
                                     shef_row_f32(sparse.images.disparity, y),
                                     (size_t)width_px * sizeof(float));
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(expected.images.confidence, y),
                                     shef_row_f32(sparse.images.confidence, y),
                                     (size_t)width_px * sizeof(float));
        }
        result_destroy(&expected);
        result_destroy(&before);
        result_destroy(&sparse);
        edges_destroy(&edges);
        edges_destroy(&other);
        shef_robust_destroy(fresh);
        shef_robust_destroy(used);
    }
}

/* A declared bias shifts what is read out and not where outlines are. */
static void test_a_bias_is_taken_off_afterwards(void)
{
    const struct shef_smooth_field bias = { .c = { 2.0 },
                                            .width_px = WIDTH_PX,
                                            .height_px = HEIGHT_PX };
    const struct shef_robust_params params = params_of(SHEF_EDGE_TERNARY, 4);
    struct bar_scene scene = bar_scene_create(SHEF_EDGE_TERNARY, &bars[0], 5);
    struct shef_robust *matcher = matcher_create(&params, NULL);
    struct result plain = match_bar(matcher, &scene, true);

    shef_robust_set_bias(matcher, &bias);

    struct result shifted = match_bar(matcher, &scene, true);

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            TEST_ASSERT_EQUAL_FLOAT(
                fmaxf(shef_row_f32(plain.images.dense_disparity, y)[x] - 2.0f, 0.0f),
                shef_row_f32(shifted.images.dense_disparity, y)[x]);
    result_destroy(&plain);
    result_destroy(&shifted);
    bar_scene_destroy(&scene);
    shef_robust_destroy(matcher);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_bar_before_a_wall_keeps_its_width);
    RUN_TEST(test_the_maps_alone_tell_much_of_it);
    RUN_TEST(test_a_wall_without_jumps_stays_bit_for_bit);
    RUN_TEST(test_without_reach_nothing_of_it_shows);
    RUN_TEST(test_workers_and_instruction_sets_do_not_show);
    RUN_TEST(test_noise_up_to_the_borders_is_no_harm);
    RUN_TEST(test_which_images_are_wanted_does_not_show);
    RUN_TEST(test_a_bias_is_taken_off_afterwards);
    return UNITY_END();
}
