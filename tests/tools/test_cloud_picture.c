/* Pictures of point clouds: two views, near before far, whatever the points are. */
#include <stdlib.h>

#include "core/memory.h"
#include "sheftool/cloud_picture.h"
#include "support/support.h"

static struct shef_image_rgb8 picture;
static struct shef_point *points;

void setUp(void)
{
}

void tearDown(void)
{
    shef_image_destroy_rgb8(&picture);
    free(points);
    points = NULL;
}

static void draw(int32_t n_points)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_cloud_picture_create(&picture, points, n_points, &err));
}

/* A wall across the view, 0.01 m from point to point. */
static int32_t add_wall(int32_t n, float z_m, float half_width_m, uint8_t grey)
{
    for (float y = -half_width_m; y < half_width_m; y += 0.01f)
        for (float x = -half_width_m; x < half_width_m; x += 0.01f)
            points[n++] = (struct shef_point){ x, y, z_m, { grey, grey, grey }, 255 };
    return n;
}

static int32_t count_if(int32_t x0, int32_t x1, int (*is)(struct shef_rgb8))
{
    int32_t n = 0;

    for (int32_t y = 20; y < picture.height_px; y++)
        for (int32_t x = x0; x < x1; x++)
            n += is(shef_row_rgb8(picture, y)[x]);
    return n;
}

static int is_drawn(struct shef_rgb8 colour)
{
    return colour.red + colour.green + colour.blue > 0;
}

static int is_yellow(struct shef_rgb8 colour)
{
    return colour.red > 2 * colour.blue && is_drawn(colour);
}

static void test_an_empty_cloud_is_a_black_picture_with_its_captions(void)
{
    draw(0);
    TEST_ASSERT_EQUAL_INT(1280, picture.width_px);
    TEST_ASSERT_EQUAL_INT(0, count_if(0, picture.width_px, is_drawn));
}

static void test_a_wall_is_seen_from_both_sides(void)
{
    points = calloc(40000, sizeof *points);

    const int32_t n = add_wall(0, 2.0f, 0.5f, 200);

    draw(n);
    TEST_ASSERT_GREATER_THAN_INT(20000, count_if(0, 640, is_drawn));
    TEST_ASSERT_GREATER_THAN_INT(20000, count_if(640, 1280, is_drawn));
}

static void test_what_is_near_hides_what_is_behind_it_in_any_order(void)
{
    points = calloc(100000, sizeof *points);

    int32_t n = add_wall(0, 3.0f, 1.0f, 200);

    n = add_wall(n, 1.5f, 0.3f, 200);
    draw(n);

    const int32_t n_near = count_if(0, 640, is_yellow);

    shef_image_destroy_rgb8(&picture);
    n = add_wall(0, 1.5f, 0.3f, 200);
    n = add_wall(n, 3.0f, 1.0f, 200);
    draw(n);
    TEST_ASSERT_GREATER_THAN_INT(10000, n_near);
    TEST_ASSERT_EQUAL_INT(n_near, count_if(0, 640, is_yellow));
}

static void test_points_beside_and_behind_the_viewer_are_left_out(void)
{
    points = calloc(4, sizeof *points);
    points[0] = (struct shef_point){ 1e6f, 0, 2, { 255, 255, 255 }, 255 };
    points[1] = (struct shef_point){ -1e6f, 1e6f, 2, { 255, 255, 255 }, 255 };
    points[2] = (struct shef_point){ 0, 0, 1e-3f, { 255, 255, 255 }, 255 };
    points[3] = (struct shef_point){ 0, -1e6f, 1e6f, { 255, 255, 255 }, 255 };
    draw(4);
    TEST_ASSERT_LESS_THAN_INT(200, count_if(0, picture.width_px, is_drawn));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_cloud_is_a_black_picture_with_its_captions);
    RUN_TEST(test_a_wall_is_seen_from_both_sides);
    RUN_TEST(test_what_is_near_hides_what_is_behind_it_in_any_order);
    RUN_TEST(test_points_beside_and_behind_the_viewer_are_left_out);
    return UNITY_END();
}
