#include "pipeline/point_cloud.h"

#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "support/support.h"

enum { WIDTH = 8, HEIGHT = 6 };

static struct shef_image_f32 depth;
static struct shef_image_f32 confidence;
static struct shef_image_u8 picture;

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&depth, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&confidence, WIDTH, HEIGHT, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&picture, WIDTH, HEIGHT, NULL));
    shef_row_f32(depth, 2)[3] = 2;
    shef_row_f32(confidence, 2)[3] = 0.9F;
    shef_row_u8(picture, 2)[3] = 77;
    shef_row_f32(depth, 4)[6] = 5;
    shef_row_f32(confidence, 4)[6] = 0.2F;
}

void tearDown(void)
{
    shef_image_destroy_f32(&depth);
    shef_image_destroy_f32(&confidence);
    shef_image_destroy_u8(&picture);
}

static struct shef_cloud_view view(void)
{
    return (struct shef_cloud_view){ .depth_m = depth,
                                     .confidence = confidence,
                                     .picture = picture,
                                     .f_px = 4,
                                     .cx_px = 3.5,
                                     .cy_px = 2.5,
                                     .step_px = 1 };
}

static void test_points_lie_on_their_pixels_rays(void)
{
    const struct shef_cloud_view all = view();
    struct shef_point points[4];

    TEST_ASSERT_EQUAL_INT32(2, shef_point_cloud_fill(&all, NULL, 0));
    TEST_ASSERT_EQUAL_INT32(2, shef_point_cloud_fill(&all, points, 4));
    TEST_ASSERT_EQUAL_FLOAT(-0.25F, points[0].x_m);
    TEST_ASSERT_EQUAL_FLOAT(-0.25F, points[0].y_m);
    TEST_ASSERT_EQUAL_FLOAT(2, points[0].z_m);
    TEST_ASSERT_EQUAL_UINT8(77, points[0].colour.green);
    TEST_ASSERT_EQUAL_UINT8(230, points[0].confidence);
    TEST_ASSERT_EQUAL_FLOAT(3.125F, points[1].x_m);
    TEST_ASSERT_EQUAL_FLOAT(1.875F, points[1].y_m);
}

static void test_unsure_and_far_points_are_left_out(void)
{
    struct shef_cloud_view some = view();
    struct shef_point points[4];

    some.least_confidence = 0.5F;
    TEST_ASSERT_EQUAL_INT32(1, shef_point_cloud_fill(&some, points, 4));
    some = view();
    some.furthest_m = 3;
    TEST_ASSERT_EQUAL_INT32(1, shef_point_cloud_fill(&some, points, 4));
    some = view();
    some.step_px = 2;
    TEST_ASSERT_EQUAL_INT32(1, shef_point_cloud_fill(&some, points, 4));
    TEST_ASSERT_EQUAL_FLOAT(5, points[0].z_m);
    some = view();
    TEST_ASSERT_EQUAL_INT32(1, shef_point_cloud_fill(&some, points, 1));
}

static void test_a_file_holds_head_and_points(void)
{
    static const char end[] = "end_header\n";
    const struct shef_cloud_view all = view();
    const char *path = shef_test_temp_path("cloud.ply");
    struct shef_point points[2];
    struct shef_point back;
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL_INT32(2, shef_point_cloud_fill(&all, points, 2));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_point_cloud_write(path, points, 2, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 4096, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_MEMORY("ply\nformat binary_little_endian 1.0\n", bytes, 36);
    TEST_ASSERT_NOT_NULL(strstr((const char *)bytes, "element vertex 2\n"));

    const char *data = strstr((const char *)bytes, end) + sizeof end - 1;

    TEST_ASSERT_EQUAL_size_t(n_bytes, (size_t)(data - (const char *)bytes) + sizeof points);
    memcpy(&back, data + sizeof back, sizeof back);
    TEST_ASSERT_EQUAL_MEMORY(&points[1], &back, sizeof back);
    free(bytes);
}

static void test_an_empty_cloud_is_a_file_too(void)
{
    const char *path = shef_test_temp_path("empty.ply");

    TEST_ASSERT_EQUAL(SHEF_OK, shef_point_cloud_write(path, NULL, 0, NULL));
    TEST_ASSERT_EQUAL(
        SHEF_ERR_NOT_FOUND,
        shef_point_cloud_write(shef_test_temp_path("no/such/folder.ply"), NULL, 0, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_points_lie_on_their_pixels_rays);
    RUN_TEST(test_unsure_and_far_points_are_left_out);
    RUN_TEST(test_a_file_holds_head_and_points);
    RUN_TEST(test_an_empty_cloud_is_a_file_too);
    return UNITY_END();
}
