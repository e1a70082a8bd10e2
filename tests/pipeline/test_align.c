/* The vertical residual, measured from matched maps whose residual is known. */
#include "pipeline/align.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "robust_cases.h"

#define WIDTH_PX  320
#define HEIGHT_PX 240

/* About the real rig's: tilted and bent, 0.2 to 2.6 px. */
static const struct shef_smooth_field rig = { .c = { 1.56, -0.63, 0.60, -0.06, -0.41, -0.21 },
                                              .width_px = WIDTH_PX,
                                              .height_px = HEIGHT_PX };

static struct shef_align align;
static struct shef_image_i8 left;
static struct shef_image_i8 right;
static struct shef_image_i16 disparity;

void setUp(void)
{
    struct shef_error err = { 0 };

    shef_align_init(&align, WIDTH_PX, HEIGHT_PX);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i8(&left, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i8(&right, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_image_create_i16(&disparity, WIDTH_PX / 2, HEIGHT_PX / 2, &err));
}

void tearDown(void)
{
    shef_image_destroy_i8(&left);
    shef_image_destroy_i8(&right);
    shef_image_destroy_i16(&disparity);
}

/* A pair of this residual with its true disparities. */
static void observe(enum shef_edge_kind kind, uint64_t texture, double noise,
                    const struct shef_smooth_field *residual, int32_t row_step)
{
    const struct scene scene = {
        .kind = kind,
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .surface = SURFACE_SLANTED,
        .near_px = 40.0,
        .far_px = 18.0,
        .texture = texture,
        .noise = noise,
        .residual = residual,
    };
    struct edges edges = edges_of_scene(&scene);

    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        shef_edge_map_row(&edges.left, y, shef_row_i8(left, y));
        shef_edge_map_row(&edges.right, y, shef_row_i8(right, y));
        for (int32_t x = 0; x < WIDTH_PX / 2; x++)
            shef_row_i16(disparity, y / 2)[x] =
                (int16_t)lrint(32.0 * scene_disparity_px(&scene, 2.0 * x + 0.5));
    }
    edges_destroy(&edges);
    shef_align_observe(&align, left, right, disparity, row_step);
}

/* Largest distance from the truth over the image, as solved now. */
static double largest_error_px(const struct shef_smooth_field *truth, double *out_spread_px)
{
    struct shef_smooth_field field;
    double largest = 0.0;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_align_solve(&align, &field, out_spread_px));
    TEST_ASSERT_EQUAL_INT32(WIDTH_PX, field.width_px);
    TEST_ASSERT_EQUAL_INT32(HEIGHT_PX, field.height_px);
    for (int32_t y = 0; y < HEIGHT_PX; y += 8)
        for (int32_t x = 0; x < WIDTH_PX; x += 8)
            largest = fmax(largest, fabs(shef_field_at(&field, x, y) - shef_field_at(truth, x, y)));
    return largest;
}

static void test_a_known_residual_is_measured_in_every_kind(void)
{
    for (int kind = 0; kind < 3; kind++) {
        double spread_px;

        shef_align_init(&align, WIDTH_PX, HEIGHT_PX);
        for (uint64_t i = 0; i < 4; i++)
            observe((enum shef_edge_kind)kind, i, 0.5, &rig, 1);

        const double error_px = largest_error_px(&rig, &spread_px);

        printf("kind %d: largest error %.3f px, spread of the blocks %.3f px\n", kind, error_px,
               spread_px);
        expect_at_most(0.25, error_px, "error (px)");
        expect_at_most(0.25, spread_px, "spread (px)");
    }
}

static void test_aligned_maps_have_no_residual(void)
{
    const struct shef_smooth_field none = { .width_px = WIDTH_PX, .height_px = HEIGHT_PX };

    for (uint64_t i = 0; i < 4; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.5, NULL, 1);
    expect_at_most(0.15, largest_error_px(&none, NULL), "error (px)");
}

/* Every fourth row, another one in each pair: four pairs tell as much as one read whole. */
static void test_sparse_rows_add_up_over_pairs(void)
{
    for (uint64_t i = 0; i < 16; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.5, &rig, 4);
    TEST_ASSERT_EQUAL_INT32(16, align.n_observed);
    expect_at_most(0.25, largest_error_px(&rig, NULL), "error (px)");
}

static void test_a_drift_is_followed_and_the_past_fades(void)
{
    struct shef_smooth_field drifted = rig;

    drifted.c[0] -= 2.0;
    for (uint64_t i = 0; i < 4; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.5, &rig, 2);
    TEST_ASSERT_TRUE(largest_error_px(&drifted, NULL) > 1.5);
    for (uint64_t i = 0; i < 24; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.5, &drifted, 2);
    expect_at_most(0.5, largest_error_px(&drifted, NULL), "error after the drift (px)");
}

/* Two of the blocks see something else: the fit leaves them out. */
static void test_outlying_blocks_count_little(void)
{
    for (uint64_t i = 0; i < 4; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.3, &rig, 1);
    for (int block = 0; block < 2; block++) {
        double *score = align.score[1 + 3 * block][2 + block];

        for (int32_t s = 0; s < SHEF_ALIGN_N_SHIFTS; s++)
            score[s] = s == SHEF_ALIGN_MAX_SHIFT - 4 ? score[SHEF_ALIGN_MAX_SHIFT] + 1000.0 : 0.0;
    }
    expect_at_most(0.35, largest_error_px(&rig, NULL), "error (px)");
}

static void expect_nothing_measured(void)
{
    struct shef_smooth_field field = { .width_px = -7 };
    double spread_px = -7.0;

    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_align_solve(&align, &field, &spread_px));
    TEST_ASSERT_EQUAL_INT32(-7, field.width_px);
}

static void test_without_texture_nothing_is_measured(void)
{
    expect_nothing_measured();
    shef_align_observe(&align, left, right, disparity, 1);
    expect_nothing_measured();
}

/* All pixels are edges: no shift is better than another. */
static void test_flooded_maps_tell_nothing(void)
{
    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        memset(shef_row_i8(left, y), 1, WIDTH_PX);
        memset(shef_row_i8(right, y), 1, WIDTH_PX);
    }
    shef_align_observe(&align, left, right, disparity, 1);
    expect_nothing_measured();
}

/* Texture in one corner only: fewer blocks than six numbers need. */
static void test_texture_in_one_corner_is_not_enough(void)
{
    for (uint64_t i = 0; i < 3; i++)
        observe(SHEF_EDGE_UNSIGNED, i, 0.3, &rig, 1);
    for (int32_t by = 0; by < SHEF_ALIGN_ROWS; by++)
        for (int32_t bx = 0; bx < SHEF_ALIGN_COLUMNS; bx++)
            if (by > 2 || bx > 2)
                memset(align.score[by][bx], 0, sizeof align.score[by][bx]);
    expect_nothing_measured();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_known_residual_is_measured_in_every_kind);
    RUN_TEST(test_aligned_maps_have_no_residual);
    RUN_TEST(test_sparse_rows_add_up_over_pairs);
    RUN_TEST(test_a_drift_is_followed_and_the_past_fades);
    RUN_TEST(test_outlying_blocks_count_little);
    RUN_TEST(test_without_texture_nothing_is_measured);
    RUN_TEST(test_flooded_maps_tell_nothing);
    RUN_TEST(test_texture_in_one_corner_is_not_enough);
    return UNITY_END();
}
