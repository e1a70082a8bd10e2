/* Colours, thumbnails and letters. */

#include "core/memory.h"
#include "sheftool/picture.h"
#include "support/support.h"

static struct shef_image_f32 map;
static struct shef_image_f32 truth;
static struct shef_image_rgb8 picture;

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&map, 4, 4, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&truth, 4, 4, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_rgb8(&picture, 32, 16, NULL));
}

void tearDown(void)
{
    shef_image_destroy_f32(&map);
    shef_image_destroy_f32(&truth);
    shef_image_destroy_rgb8(&picture);
}

static void expect_colour(struct shef_rgb8 expected, struct shef_rgb8 seen)
{
    TEST_ASSERT_EQUAL_UINT8(expected.red, seen.red);
    TEST_ASSERT_EQUAL_UINT8(expected.green, seen.green);
    TEST_ASSERT_EQUAL_UINT8(expected.blue, seen.blue);
}

static void test_far_is_blue_near_is_yellow_none_is_black(void)
{
    const struct shef_rgb8 far = shef_colour_of_disparity(0.1f, 80);
    const struct shef_rgb8 near = shef_colour_of_disparity(80, 80);

    TEST_ASSERT_TRUE(far.blue > 2 * far.red && far.blue > 2 * far.green);
    TEST_ASSERT_TRUE(near.red > 200 && near.green > 200 && near.blue < 60);
    expect_colour((struct shef_rgb8){ 0, 0, 0 }, shef_colour_of_disparity(0, 80));
    expect_colour(near, shef_colour_of_disparity(500, 80));
}

static void test_the_scale_never_jumps(void)
{
    for (float d = 0.5f; d < 80; d += 0.25f) {
        const struct shef_rgb8 a = shef_colour_of_disparity(d, 80);
        const struct shef_rgb8 b = shef_colour_of_disparity(d + 0.25f, 80);

        TEST_ASSERT_INT_WITHIN(4, a.red, b.red);
        TEST_ASSERT_INT_WITHIN(4, a.green, b.green);
        TEST_ASSERT_INT_WITHIN(4, a.blue, b.blue);
    }
}

static void test_errors_run_from_blue_over_white_to_red(void)
{
    const struct shef_rgb8 far = shef_colour_of_error(-5);
    const struct shef_rgb8 right = shef_colour_of_error(0);
    const struct shef_rgb8 near = shef_colour_of_error(5);

    TEST_ASSERT_TRUE(far.blue > 200 && far.red < 60);
    TEST_ASSERT_TRUE(right.red > 230 && right.green > 230 && right.blue > 230);
    TEST_ASSERT_TRUE(near.red > 200 && near.blue < 60);
    TEST_ASSERT_TRUE(shef_colour_of_error(50).red < near.red);
}

static void test_thumbnail_averages_the_estimates_of_a_block_and_skips_holes(void)
{
    const struct shef_map_drawing drawing = { .disparity = map, .top_px = 80 };

    shef_row_f32(map, 0)[0] = 20;
    shef_row_f32(map, 1)[1] = 40;
    shef_picture_draw_map(picture, 3, 2, &drawing, 2);
    expect_colour(shef_colour_of_disparity(30, 80), shef_row_rgb8(picture, 2)[3]);
    expect_colour((struct shef_rgb8){ 0, 0, 0 }, shef_row_rgb8(picture, 2)[4]);
}

static void test_errors_are_drawn_only_where_both_maps_have_a_value(void)
{
    const struct shef_map_drawing drawing = { map, truth, 80 };

    shef_row_f32(map, 0)[0] = 43;
    shef_row_f32(truth, 0)[0] = 40;
    shef_row_f32(map, 0)[1] = 43;   /* no truth */
    shef_row_f32(truth, 0)[2] = 40; /* no estimate */
    shef_picture_draw_map(picture, 0, 0, &drawing, 1);
    expect_colour(shef_colour_of_error(3), shef_row_rgb8(picture, 0)[0]);
    expect_colour((struct shef_rgb8){ 0, 0, 0 }, shef_row_rgb8(picture, 0)[1]);
    expect_colour((struct shef_rgb8){ 0, 0, 0 }, shef_row_rgb8(picture, 0)[2]);
}

static void test_drawing_over_the_border_is_cut_off(void)
{
    const struct shef_map_drawing drawing = { .disparity = map, .top_px = 80 };

    shef_picture_draw_map(picture, -2, -2, &drawing, 1);
    shef_picture_draw_map(picture, 30, 14, &drawing, 1);
    shef_picture_draw_text(picture, -3, 12, 2, (struct shef_rgb8){ 9, 9, 9 }, "long text, cut");
    TEST_PASS();
}

static void test_letter_l_is_a_bar_and_a_foot(void)
{
    const struct shef_rgb8 ink = { 255, 255, 255 };
    int n_ink = 0;

    shef_picture_draw_text(picture, 0, 0, 1, ink, "L");
    for (int32_t y = 0; y < 16; y++)
        for (int32_t x = 0; x < 32; x++)
            n_ink += shef_row_rgb8(picture, y)[x].red == 255;
    TEST_ASSERT_EQUAL_INT(7 + 4, n_ink);
    for (int32_t y = 0; y < 7; y++)
        expect_colour(ink, shef_row_rgb8(picture, y)[0]);
    for (int32_t x = 0; x < 5; x++)
        expect_colour(ink, shef_row_rgb8(picture, 6)[x]);
}

static void test_edges_of_both_cameras_make_white(void)
{
    struct shef_edge_map frame;
    struct shef_edge_map event;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&frame, SHEF_EDGE_UNSIGNED, 4, 4, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&event, SHEF_EDGE_UNSIGNED, 4, 4, NULL));
    frame.plus[0] = 3; /* columns 0 and 1 */
    event.plus[0] = 6; /* columns 1 and 2 */
    shef_picture_draw_edges(picture, 0, 0, &frame, &event, 1);
    TEST_ASSERT_TRUE(shef_row_rgb8(picture, 0)[0].red > 200);
    TEST_ASSERT_TRUE(shef_row_rgb8(picture, 0)[0].blue < 100);
    expect_colour((struct shef_rgb8){ 255, 255, 255 }, shef_row_rgb8(picture, 0)[1]);
    TEST_ASSERT_TRUE(shef_row_rgb8(picture, 0)[2].blue > 200);
    expect_colour((struct shef_rgb8){ 0, 0, 0 }, shef_row_rgb8(picture, 0)[3]);
    shef_edge_map_destroy(&frame);
    shef_edge_map_destroy(&event);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_far_is_blue_near_is_yellow_none_is_black);
    RUN_TEST(test_the_scale_never_jumps);
    RUN_TEST(test_errors_run_from_blue_over_white_to_red);
    RUN_TEST(test_thumbnail_averages_the_estimates_of_a_block_and_skips_holes);
    RUN_TEST(test_errors_are_drawn_only_where_both_maps_have_a_value);
    RUN_TEST(test_drawing_over_the_border_is_cut_off);
    RUN_TEST(test_letter_l_is_a_bar_and_a_foot);
    RUN_TEST(test_edges_of_both_cameras_make_white);
    return UNITY_END();
}
