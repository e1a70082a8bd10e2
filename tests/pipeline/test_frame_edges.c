#include "pipeline/frame_edges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "frame_cases.h"

#define WIDTH_PX  203
#define HEIGHT_PX 121

static struct shef_test_random random_numbers;
static struct shef_error err;
static struct shef_rectification profile;
static struct shef_frame_edges_params params;
static struct shef_frame_edges *edges;
static struct shef_image_u8 image;
static struct shef_edge_map map;

static void start(enum shef_edge_kind kind, struct shef_image_u8 valid)
{
    shef_frame_edges_destroy(edges);
    shef_edge_map_destroy(&map);
    edges = NULL;
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_frame_edges_create(&edges, &profile, valid, &params, shef_cpu_features(), &err),
        err.text);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&map, kind, profile.width_px, profile.height_px, &err));
}

void setUp(void)
{
    random_numbers = shef_test_random_start();
    err = (struct shef_error){ 0 };
    profile = shef_rectification_wide();
    profile.width_px = WIDTH_PX;
    profile.height_px = HEIGHT_PX;
    profile.f_px = 180;
    profile.cx_px = 98.5;
    profile.cy_px = 63.25;
    params = shef_frame_edges_default_params();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, WIDTH_PX, HEIGHT_PX, &err));
    shef_test_fill_texture(image, 11, 1.2, &random_numbers);
}

void tearDown(void)
{
    shef_image_destroy_u8(&image);
    shef_frame_edges_destroy(edges);
    shef_edge_map_destroy(&map);
    edges = NULL;
    map = (struct shef_edge_map){ 0 };
}

static const struct shef_image_u8 no_mask;

static int32_t clamped(int32_t value, int32_t last)
{
    return value < 0 ? 0 : value > last ? last : value;
}

static double grey_at(int32_t x, int32_t y)
{
    return shef_row_u8(image, clamped(y, HEIGHT_PX - 1))[clamped(x, WIDTH_PX - 1)];
}

static double ln_at(int32_t x, int32_t y)
{
    return log(grey_at(x, y) + 6);
}

/* Sobel's slopes, a pixel. */
static double slope_x(double (*at)(int32_t, int32_t), int32_t x, int32_t y)
{
    return (at(x + 1, y - 1) - at(x - 1, y - 1) + 2 * (at(x + 1, y) - at(x - 1, y)) +
            at(x + 1, y + 1) - at(x - 1, y + 1)) /
           8;
}

static double slope_y(double (*at)(int32_t, int32_t), int32_t x, int32_t y)
{
    return (at(x - 1, y + 1) - at(x - 1, y - 1) + 2 * (at(x, y + 1) - at(x, y - 1)) +
            at(x + 1, y + 1) - at(x + 1, y - 1)) /
           8;
}

/* What motion does to a pixel's logarithm, per pixel of flow. */
static double along_at(int32_t x, int32_t y, const double v[3])
{
    const double flow_x = (x - profile.cx_px) / profile.f_px * v[2] - v[0];
    const double flow_y = (y - profile.cy_px) / profile.f_px * v[2] - v[1];
    const double length = hypot(flow_x, flow_y);

    return length > 0 ? -(slope_x(ln_at, x, y) * flow_x + slope_y(ln_at, x, y) * flow_y) / length
                      : 0;
}

static bool bit_at(const uint64_t *plane, int32_t x, int32_t y)
{
    return plane[y * map.stride_words + x / 64] >> (x % 64) & 1;
}

static double share_of_edges(void)
{
    return (double)shef_edge_map_count(&map) / (WIDTH_PX * HEIGHT_PX);
}

static void check_unsigned(void)
{
    start(SHEF_EDGE_UNSIGNED, no_mask);
    shef_frame_edges_unsigned(edges, image, &map);

    const double threshold = shef_frame_edges_threshold(edges);

    TEST_ASSERT_TRUE(threshold > 1);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const double slope = hypot(slope_x(grey_at, x, y), slope_y(grey_at, x, y));

            /* Values are rounded to 1/64 of a grey level a pixel. */
            if (fabs(slope - threshold) > 0.01)
                TEST_ASSERT_EQUAL(slope > threshold, bit_at(map.plus, x, y));
        }
}

static void test_unsigned_edges_are_the_strongest_quarter_of_the_gradients(void)
{
    check_unsigned();
    TEST_ASSERT_TRUE(fabs(share_of_edges() - 0.25) < 0.005);
}

static void check_along(const double v[3])
{
    start(SHEF_EDGE_GRADED, no_mask);
    shef_frame_edges_along(edges, image, v, &map);

    const double limit = shef_frame_edges_threshold(edges);
    double worst = 0;

    TEST_ASSERT_TRUE(limit > 0.01);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const double expected = fmax(-1, fmin(1, along_at(x, y, v) / limit));
            const int8_t actual = map.graded[y * map.graded_stride_bytes + x];

            worst = fmax(worst, fabs(actual - 127 * expected));
        }
    printf("moving (%+.2f %+.2f %+.2f): off by %.2f of 127 at most\n", v[0], v[1], v[2], worst);
    TEST_ASSERT_TRUE(worst <= 2.0);
}

static void test_graded_edges_are_minus_the_slope_along_the_flow(void)
{
    check_along((const double[3]){ 0.35, 0, 0 });
    check_along((const double[3]){ -0.1, 0.2, 0 });
    check_along((const double[3]){ 3, -50, 0 });
}

static void test_around_the_point_the_camera_moves_to_each_pixel_has_its_own_flow(void)
{
    check_along((const double[3]){ 0, 0, 0.2 });
    check_along((const double[3]){ 0.03, -0.02, -0.2 });
    check_along((const double[3]){ 0.2, 0.1, 0.1 });
}

static void test_the_sign_says_what_the_moving_camera_will_see(void)
{
    /* A bright half on the right, a camera moving right: the picture flows left, so brightness
     * comes to the boundary. */
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_u8(image, y)[x] = x < 100 ? 40 : 200;
    start(SHEF_EDGE_TERNARY, no_mask);
    shef_frame_edges_along(edges, image, (const double[3]){ 1, 0, 0 }, &map);
    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        TEST_ASSERT_TRUE(bit_at(map.plus, 99, y) && bit_at(map.plus, 100, y));
        TEST_ASSERT_FALSE(bit_at(map.minus, 99, y) || bit_at(map.minus, 100, y));
    }
    TEST_ASSERT_EQUAL_INT64(2 * HEIGHT_PX, shef_edge_map_count(&map));
    /* The same as the later frame shows. */
    struct shef_image_u8 later = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&later, WIDTH_PX, HEIGHT_PX, &err));
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_u8(later, y)[x] = x < 98 ? 40 : 200;
    shef_frame_edges_temporal(edges, image, later, &map);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        TEST_ASSERT_TRUE(bit_at(map.plus, 98, y) && bit_at(map.plus, 99, y));
    TEST_ASSERT_EQUAL_INT64(2 * HEIGHT_PX, shef_edge_map_count(&map));
    shef_image_destroy_u8(&later);
}

static void test_the_opposite_motion_gives_the_opposite_signs(void)
{
    static int8_t forth[WIDTH_PX];
    const double v[3] = { 0.2, 0.1, 0.15 };
    const double back[3] = { -0.2, -0.1, -0.15 };
    struct shef_edge_map other = { 0 };

    start(SHEF_EDGE_GRADED, no_mask);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&other, SHEF_EDGE_GRADED, WIDTH_PX, HEIGHT_PX, &err));
    shef_frame_edges_along(edges, image, v, &map);
    shef_frame_edges_along(edges, image, back, &other);
    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        shef_edge_map_row(&map, y, forth);
        for (int32_t x = 0; x < WIDTH_PX; x++)
            TEST_ASSERT_INT_WITHIN(1, -forth[x], other.graded[y * other.graded_stride_bytes + x]);
    }
    shef_edge_map_destroy(&other);
}

static void test_the_temporal_map_is_the_difference_of_logarithms(void)
{
    struct shef_image_u8 later = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&later, WIDTH_PX, HEIGHT_PX, &err));
    shef_test_fill_texture(later, 11, 1.2, &random_numbers);
    start(SHEF_EDGE_GRADED, no_mask);
    shef_frame_edges_temporal(edges, image, later, &map);

    const double limit = shef_frame_edges_threshold(edges);
    int64_t n_full = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const double ln = log(shef_row_u8(later, y)[x] + 6) - ln_at(x, y);
            const int8_t actual = map.graded[y * map.graded_stride_bytes + x];

            TEST_ASSERT_TRUE(fabs(actual - 127 * fmax(-1, fmin(1, ln / limit))) <= 1.0);
            n_full += abs(actual) == 127;
        }
    TEST_ASSERT_TRUE(fabs((double)n_full / (WIDTH_PX * HEIGHT_PX) - 0.10) < 0.01);
    shef_image_destroy_u8(&later);
}

static void test_a_dimmer_light_gives_the_same_signed_edges(void)
{
    /* log(I + 6) of half the light is not quite the logarithm less ln 2: near that for bright
     * pictures. */
    struct shef_edge_map dim = { 0 };
    double sum_both = 0;
    double sum_bright = 0;
    double sum_dim = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_u8(image, y)[x] = (uint8_t)(120 + shef_row_u8(image, y)[x] / 2);
    start(SHEF_EDGE_GRADED, no_mask);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&dim, SHEF_EDGE_GRADED, WIDTH_PX, HEIGHT_PX, &err));
    shef_frame_edges_along(edges, image, (const double[3]){ 1, 1, 0 }, &map);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_u8(image, y)[x] /= 2;
    shef_frame_edges_along(edges, image, (const double[3]){ 1, 1, 0 }, &dim);
    for (int32_t i = 0; i < HEIGHT_PX * map.graded_stride_bytes; i++) {
        sum_both += map.graded[i] * dim.graded[i];
        sum_bright += map.graded[i] * map.graded[i];
        sum_dim += dim.graded[i] * dim.graded[i];
    }
    TEST_ASSERT_TRUE(sum_both / sqrt(sum_bright * sum_dim) > 0.99);
    shef_edge_map_destroy(&dim);
}

static void test_edges_move_with_the_picture(void)
{
    enum { DX = 17, DY = 9, BORDER = 20 };
    struct shef_image_u8 big = { 0 };
    struct shef_edge_map moved = { 0 };
    double first_threshold;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&big, WIDTH_PX + DX, HEIGHT_PX + DY, &err));
    shef_test_fill_texture(big, 11, 1.2, &random_numbers);
    start(SHEF_EDGE_UNSIGNED, no_mask);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&moved, SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX, &err));

    const struct shef_image_u8 here = { shef_row_u8(big, DY) + DX, WIDTH_PX, HEIGHT_PX,
                                        big.stride_bytes };
    const struct shef_image_u8 there = { big.data, WIDTH_PX, HEIGHT_PX, big.stride_bytes };

    shef_frame_edges_unsigned(edges, here, &map);
    first_threshold = shef_frame_edges_threshold(edges);
    shef_frame_edges_unsigned(edges, there, &moved);

    /* The quantile sees other borders, so the threshold differs by a little. */
    int64_t n_different = 0;

    TEST_ASSERT_TRUE(fabs(first_threshold / shef_frame_edges_threshold(edges) - 1) < 0.1);
    for (int32_t y = BORDER; y < HEIGHT_PX - BORDER; y++)
        for (int32_t x = BORDER; x < WIDTH_PX - BORDER; x++)
            n_different +=
                bit_at(map.plus, x, y) !=
                (moved.plus[(y + DY) * moved.stride_words + (x + DX) / 64] >> ((x + DX) % 64) & 1);
    TEST_ASSERT_LESS_THAN_INT64(WIDTH_PX * HEIGHT_PX / 50, n_different);
    shef_edge_map_destroy(&moved);
    shef_image_destroy_u8(&big);
}

static void test_thin_edges_are_the_crests_of_thick_ones(void)
{
    struct shef_edge_map thick = { 0 };

    start(SHEF_EDGE_UNSIGNED, no_mask);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&thick, SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX, &err));
    shef_frame_edges_unsigned(edges, image, &thick);
    params.is_thin = true;
    start(SHEF_EDGE_UNSIGNED, no_mask);
    shef_frame_edges_unsigned(edges, image, &map);
    for (int32_t i = 0; i < HEIGHT_PX * map.stride_words; i++)
        TEST_ASSERT_EQUAL_HEX64(0, map.plus[i] & ~thick.plus[i]);
    TEST_ASSERT_TRUE(shef_edge_map_count(&map) < 0.5 * (double)shef_edge_map_count(&thick));
    TEST_ASSERT_TRUE(shef_edge_map_count(&map) > 0.1 * (double)shef_edge_map_count(&thick));
    shef_edge_map_destroy(&thick);
}

static void test_a_straight_edge_is_one_pixel_thin_in_any_direction(void)
{
    params.is_thin = true;
    for (int degrees = 0; degrees < 360; degrees += 5) {
        const double angle = degrees * 0.017453292519943295;
        const double slope =
            fmin(fabs(cos(angle)), fabs(sin(angle))) / fmax(fabs(cos(angle)), fabs(sin(angle)));
        int n_lines = 0;
        int n_pixels = 0;

        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++)
                shef_row_u8(image, y)[x] = (uint8_t)lrint(
                    128 + 100 * tanh(((x - 100.3) * cos(angle) + (y - 60.4) * sin(angle)) / 1.5));
        start(SHEF_EDGE_UNSIGNED, no_mask);
        shef_frame_edges_unsigned(edges, image, &map);
        /* Cross the edge along rows or columns, whichever is the more upright crossing. */
        for (int32_t k = 40; k < 80; k++) {
            int n_here = 0;

            if (fabs(cos(angle)) > fabs(sin(angle)))
                for (int32_t x = 0; x < WIDTH_PX; x++)
                    n_here += bit_at(map.plus, x, k);
            else
                for (int32_t y = 0; y < HEIGHT_PX; y++)
                    n_here += bit_at(map.plus, k + 40, y);
            /* A slanted one takes two where it steps to the next column or row. */
            TEST_ASSERT_LESS_OR_EQUAL_INT(2, n_here);
            n_lines += n_here > 0;
            n_pixels += n_here;
        }
        TEST_ASSERT_EQUAL_INT(40, n_lines);
        TEST_ASSERT_LESS_OR_EQUAL_INT(41 * (1 + slope) + 1, n_pixels);
    }
}

static void test_what_is_not_valid_makes_no_edges_and_does_not_count(void)
{
    struct shef_image_u8 valid = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&valid, WIDTH_PX, HEIGHT_PX, &err));
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            shef_row_u8(valid, y)[x] = x < 120 ? 255 : 0;
            if (x >= 120)
                shef_row_u8(image, y)[x] = 0;
        }
    start(SHEF_EDGE_UNSIGNED, valid);
    shef_frame_edges_unsigned(edges, image, &map);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 119; x < WIDTH_PX; x++)
            TEST_ASSERT_FALSE(bit_at(map.plus, x, y));
    TEST_ASSERT_TRUE(fabs((double)shef_edge_map_count(&map) / (119.0 * HEIGHT_PX) - 0.25) < 0.005);
    shef_image_destroy_u8(&valid);
}

static void test_an_even_picture_and_a_camera_at_rest_have_no_edges(void)
{
    start(SHEF_EDGE_GRADED, no_mask);
    shef_frame_edges_along(edges, image, (const double[3]){ 0, 0, 0 }, &map);
    TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
    shef_frame_edges_temporal(edges, image, image, &map);
    TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        memset(shef_row_u8(image, y), 77, WIDTH_PX);
    shef_frame_edges_along(edges, image, (const double[3]){ 1, 0, 0 }, &map);
    TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
    start(SHEF_EDGE_UNSIGNED, no_mask);
    shef_frame_edges_unsigned(edges, image, &map);
    TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
    TEST_ASSERT_TRUE(fabs(shef_frame_edges_threshold(edges) - 0.5) < 0.01);
}

static void test_the_blackest_and_whitest_pictures_do_not_overflow(void)
{
    static const double velocities[][3] = {
        { 1, 0, 0 }, { 0, 1, 0 }, { 1, 1, 0 }, { -1, 1, 0 }, { 0.1, 0, 1 }, { -3, -1, 1 },
    };

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_u8(image, y)[x] = shef_test_random_range(&random_numbers, 0, 1) ? 255 : 0;
    for (size_t i = 0; i < sizeof velocities / sizeof velocities[0]; i++)
        check_along(velocities[i]);
    check_unsigned();
}

static void test_the_smallest_pictures_work(void)
{
    static const int32_t sizes[][2] = { { 2, 1 }, { 3, 2 }, { 7, 9 }, { 64, 1 }, { 65, 2 } };

    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const struct shef_image_u8 part = { image.data, sizes[i][0], sizes[i][1],
                                            image.stride_bytes };

        profile.width_px = sizes[i][0];
        profile.height_px = sizes[i][1];
        params.is_thin = true;
        start(SHEF_EDGE_UNSIGNED, no_mask);
        shef_frame_edges_unsigned(edges, part, &map);
        start(SHEF_EDGE_GRADED, no_mask);
        shef_frame_edges_along(edges, part, (const double[3]){ .1, .2, .3 }, &map);
        shef_frame_edges_temporal(edges, part, part, &map);
        TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
    }
}

static void refused(const char *reason)
{
    struct shef_frame_edges *refused_edges = NULL;

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_edges_create(&refused_edges, &profile, no_mask, &params, 0, &err));
    TEST_ASSERT_NULL(refused_edges);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_settings_out_of_range_are_refused_with_a_reason(void)
{
    params.graded_quantile = 1;
    refused("quantile 1:");
    params = shef_frame_edges_default_params();
    params.floor_ln = NAN;
    refused("floor of nan");
    params = shef_frame_edges_default_params();
    profile.width_px = 1;
    refused("the width at least 2");
    profile.width_px = 100;

    struct shef_frame_edges *refused_edges = NULL;

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_edges_create(&refused_edges, &profile, image, &params, 0, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "sizes must agree"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_unsigned_edges_are_the_strongest_quarter_of_the_gradients);
    RUN_TEST(test_graded_edges_are_minus_the_slope_along_the_flow);
    RUN_TEST(test_around_the_point_the_camera_moves_to_each_pixel_has_its_own_flow);
    RUN_TEST(test_the_sign_says_what_the_moving_camera_will_see);
    RUN_TEST(test_the_opposite_motion_gives_the_opposite_signs);
    RUN_TEST(test_the_temporal_map_is_the_difference_of_logarithms);
    RUN_TEST(test_a_dimmer_light_gives_the_same_signed_edges);
    RUN_TEST(test_edges_move_with_the_picture);
    RUN_TEST(test_thin_edges_are_the_crests_of_thick_ones);
    RUN_TEST(test_a_straight_edge_is_one_pixel_thin_in_any_direction);
    RUN_TEST(test_what_is_not_valid_makes_no_edges_and_does_not_count);
    RUN_TEST(test_an_even_picture_and_a_camera_at_rest_have_no_edges);
    RUN_TEST(test_the_blackest_and_whitest_pictures_do_not_overflow);
    RUN_TEST(test_the_smallest_pictures_work);
    RUN_TEST(test_settings_out_of_range_are_refused_with_a_reason);
    return UNITY_END();
}
