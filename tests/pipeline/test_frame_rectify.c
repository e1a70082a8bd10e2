#include "pipeline/frame_rectify.h"

#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "frame_cases.h"

static struct shef_test_random random_numbers;
static struct shef_error err;

void setUp(void)
{
    random_numbers = shef_test_random_start();
    err = (struct shef_error){ 0 };
}

static struct shef_frame_rectify *rectifier(const struct shef_rectification *r,
                                            enum shef_frame_pixels pixels)
{
    struct shef_frame_rectify *rectify = NULL;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_frame_rectify_create(&rectify, r, pixels, shef_cpu_features(), &err),
        err.text);
    return rectify;
}

static struct shef_image_u8 image_of(int32_t width_px, int32_t height_px)
{
    struct shef_image_u8 image = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, width_px, height_px, &err));
    return image;
}

struct difference {
    double worst;
    double mean;
    int64_t n_valid;
    int64_t n_outside;
};

/* Rectifies random noise and compares every pixel with the reference. */
static struct difference compare(const struct shef_rectification *r, enum shef_frame_pixels pixels,
                                 int32_t cell_px)
{
    struct shef_frame_rectify *rectify = rectifier(r, pixels);
    struct shef_image_u8 raw = image_of(r->sensor_width_px, r->sensor_height_px);
    struct shef_image_u8 out = image_of(r->width_px, r->height_px);
    struct difference d = { 0 };

    TEST_ASSERT_EQUAL_INT32(cell_px, shef_frame_rectify_cell_px(rectify));
    shef_test_fill_random(raw, &random_numbers);
    shef_frame_rectify_run(rectify, raw, out);
    for (int32_t y = 0; y < r->height_px; y++)
        for (int32_t x = 0; x < r->width_px; x++) {
            const double expected = shef_test_rectified(r, raw, cell_px, x, y);
            const uint8_t actual = shef_row_u8(out, y)[x];
            const uint8_t valid = shef_row_u8(shef_frame_rectify_valid(rectify), y)[x];

            if (expected < 0) {
                TEST_ASSERT_EQUAL_UINT8(0, actual);
                TEST_ASSERT_EQUAL_UINT8(0, valid);
                d.n_outside++;
                continue;
            }
            TEST_ASSERT_EQUAL_UINT8(255, valid);
            d.worst = fmax(d.worst, fabs(actual - expected));
            d.mean += actual - expected;
            d.n_valid++;
        }
    d.mean /= (double)d.n_valid;
    TEST_ASSERT_EQUAL(d.n_outside == 0, shef_frame_rectify_is_complete(rectify));
    shef_image_destroy_u8(&raw);
    shef_image_destroy_u8(&out);
    shef_frame_rectify_destroy(rectify);
    return d;
}

static void test_wide_is_within_one_grey_level_of_the_reference_on_noise(void)
{
    const struct shef_rectification r = shef_test_frame_wide();
    const struct difference d = compare(&r, SHEF_FRAME_MONO8, 2);

    printf("wide: worst %.3f grey levels, mean %+.4f\n", d.worst, d.mean);
    TEST_ASSERT_TRUE(d.worst <= 1.0);
    TEST_ASSERT_TRUE(fabs(d.mean) <= 0.01);
    TEST_ASSERT_EQUAL_INT64(640 * 480, d.n_valid);
}

static void test_paper_is_within_one_grey_level_of_the_reference_on_noise(void)
{
    const struct shef_rectification r = shef_test_frame_paper();
    const struct difference d = compare(&r, SHEF_FRAME_MONO8, 1);

    printf("paper: worst %.3f grey levels, mean %+.4f\n", d.worst, d.mean);
    TEST_ASSERT_TRUE(d.worst <= 1.0);
    TEST_ASSERT_TRUE(fabs(d.mean) <= 0.01);
    TEST_ASSERT_EQUAL_INT64(640 * 480, d.n_valid);
}

static void test_a_bayer_cell_is_the_mean_of_its_colours(void)
{
    const struct shef_rectification r = shef_test_frame_paper();

    TEST_ASSERT_TRUE(compare(&r, SHEF_FRAME_BAYER8, 2).worst <= 1.0);
}

static void test_odd_sizes_turned_cameras_and_views_past_the_sensor(void)
{
    static const double quarter[9] = { 0, -1, 0, 1, 0, 0, 0, 0, 1 };
    static const double upside_down[9] = { -1, 0, 0, 0, -1, 0, 0, 0, 1 };
    int64_t n_outside = 0;

    for (int round = 0; round < 40; round++) {
        struct shef_rectification r = shef_test_frame_wide();

        r.sensor_width_px = shef_test_random_range(&random_numbers, 60, 300);
        r.sensor_height_px = shef_test_random_range(&random_numbers, 60, 300);
        r.width_px = shef_test_random_range(&random_numbers, 1, 100);
        r.height_px = shef_test_random_range(&random_numbers, 1, 100);
        r.f_px = shef_test_random_range(&random_numbers, 60, 300);
        r.cx_px = (r.width_px - 1) / 2.0;
        r.cy_px = (r.height_px - 1) / 2.0;
        r.camera.fx_px = r.camera.fy_px = 150;
        r.camera.cx_px = (r.sensor_width_px - 1) / 2.0;
        r.camera.cy_px = (r.sensor_height_px - 1) / 2.0;
        if (round % 4 == 1)
            memcpy(r.r_camera_rectified, quarter, sizeof quarter);
        if (round % 4 == 2)
            memcpy(r.r_camera_rectified, upside_down, sizeof upside_down);

        const struct difference d = compare(&r, SHEF_FRAME_MONO8, r.f_px <= 100 ? 2 : 1);

        TEST_ASSERT_TRUE(d.worst <= 1.0);
        n_outside += d.n_outside;
    }
    TEST_ASSERT_GREATER_THAN_INT64(1000, n_outside);
}

static void test_nothing_is_written_past_the_rows(void)
{
    struct shef_rectification r = shef_test_frame_wide();
    uint8_t pixels[20][80];
    const struct shef_image_u8 out = { pixels[0], 77, 20, 80 };

    r.width_px = 77;
    r.height_px = 20;

    struct shef_frame_rectify *rectify = rectifier(&r, SHEF_FRAME_MONO8);
    struct shef_image_u8 raw = image_of(2048, 1536);

    memset(pixels, 0xa5, sizeof pixels);
    shef_frame_rectify_run(rectify, raw, out);
    for (int y = 0; y < 20; y++) {
        TEST_ASSERT_EACH_EQUAL_UINT8(0, pixels[y], 77);
        TEST_ASSERT_EACH_EQUAL_UINT8(0xa5, pixels[y] + 77, 3);
    }
    shef_image_destroy_u8(&raw);
    shef_frame_rectify_destroy(rectify);
}

static void test_an_aligned_camera_of_the_same_size_is_copied_to_the_last_pixel(void)
{
    const struct shef_rectification r = shef_rectification_wide();
    struct shef_frame_rectify *rectify = rectifier(&r, SHEF_FRAME_MONO8);
    struct shef_image_u8 raw = image_of(640, 480);
    struct shef_image_u8 out = image_of(640, 480);

    shef_test_fill_random(raw, &random_numbers);
    shef_frame_rectify_run(rectify, raw, out);
    TEST_ASSERT_TRUE(shef_frame_rectify_is_complete(rectify));
    for (int32_t y = 0; y < 480; y++)
        TEST_ASSERT_EQUAL_UINT8_ARRAY(shef_row_u8(raw, y), shef_row_u8(out, y), 640);
    shef_image_destroy_u8(&raw);
    shef_image_destroy_u8(&out);
    shef_frame_rectify_destroy(rectify);
}

static void test_the_next_frame_does_not_see_the_last_one(void)
{
    const struct shef_rectification r = shef_test_frame_wide();
    struct shef_frame_rectify *rectify = rectifier(&r, SHEF_FRAME_MONO8);
    struct shef_image_u8 raw = image_of(2048, 1536);
    struct shef_image_u8 first = image_of(640, 480);
    struct shef_image_u8 second = image_of(640, 480);

    shef_test_fill_random(raw, &random_numbers);
    shef_frame_rectify_run(rectify, raw, first);
    for (int32_t y = 0; y < 1536; y++)
        for (int32_t x = 0; x < 2048; x++)
            shef_row_u8(raw, y)[x] ^= 0xff;
    shef_frame_rectify_run(rectify, raw, second);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++)
            TEST_ASSERT_INT_WITHIN(1, 255, shef_row_u8(first, y)[x] + shef_row_u8(second, y)[x]);
    shef_image_destroy_u8(&raw);
    shef_image_destroy_u8(&first);
    shef_image_destroy_u8(&second);
    shef_frame_rectify_destroy(rectify);
}

static void refused(struct shef_rectification r, const char *reason)
{
    struct shef_frame_rectify *rectify = NULL;

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_rectify_create(&rectify, &r, SHEF_FRAME_MONO8, 0, &err));
    TEST_ASSERT_NULL(rectify);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_a_broken_calibration_is_refused_with_a_reason(void)
{
    struct shef_rectification r = shef_test_frame_wide();

    r.sensor_width_px = 1;
    refused(r, "sides must be at least 2");
    r = shef_test_frame_wide();
    r.f_px = NAN;
    refused(r, "focal lengths");
    r = shef_test_frame_wide();
    r.camera.cx_px = 90000;
    refused(r, "shows nothing");
    r = shef_test_frame_wide();
    r.camera.distortion[0] = NAN;
    refused(r, "shows nothing");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_wide_is_within_one_grey_level_of_the_reference_on_noise);
    RUN_TEST(test_paper_is_within_one_grey_level_of_the_reference_on_noise);
    RUN_TEST(test_a_bayer_cell_is_the_mean_of_its_colours);
    RUN_TEST(test_odd_sizes_turned_cameras_and_views_past_the_sensor);
    RUN_TEST(test_nothing_is_written_past_the_rows);
    RUN_TEST(test_an_aligned_camera_of_the_same_size_is_copied_to_the_last_pixel);
    RUN_TEST(test_the_next_frame_does_not_see_the_last_one);
    RUN_TEST(test_a_broken_calibration_is_refused_with_a_reason);
    return UNITY_END();
}
