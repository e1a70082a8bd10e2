#include "publish/picks.h"

#include <math.h>
#include <stdbool.h>

#include "core/memory.h"
#include "support/support.h"

#define WIDTH_PX  37 /* neither a multiple of the step nor of eight cells */
#define HEIGHT_PX 7

static struct shef_picks picks;
static struct shef_image_f32 value, confidence;

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_picks_create(&picks, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&value, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&confidence, WIDTH_PX, HEIGHT_PX, NULL));
}

void tearDown(void)
{
    shef_picks_destroy(&picks);
    shef_image_destroy_f32(&value);
    shef_image_destroy_f32(&confidence);
}

static void set(int32_t x, int32_t y, float new_value, float new_confidence)
{
    shef_row_f32(value, y)[x] = new_value;
    shef_row_f32(confidence, y)[x] = new_confidence;
}

static bool mask_at(int32_t gx, int32_t gy)
{
    return picks.mask[gy * picks.mask_bytes + gx / 8] >> gx % 8 & 1;
}

static void choose(int32_t step)
{
    shef_picks_choose(&picks, value, confidence, step, 1.0f, 100.0f);
}

static void test_the_most_confident_pixel_of_a_cell_stands_for_it(void)
{
    set(4, 2, 10.0f, 0.3f);
    set(5, 2, 20.0f, 0.6f);
    set(4, 3, 30.0f, 0.9f);
    set(5, 3, 40.0f, 0.1f);
    choose(2);
    TEST_ASSERT_EQUAL_UINT32(1, picks.row_start[picks.grid_h]);
    TEST_ASSERT_EQUAL_UINT32(3 * WIDTH_PX + 4, picks.pixels[0]);
    TEST_ASSERT_TRUE(mask_at(2, 1));
}

static void test_of_two_alike_the_upper_left_is_taken(void)
{
    set(5, 2, 20.0f, 0.5f);
    set(4, 3, 30.0f, 0.5f);
    choose(2);
    TEST_ASSERT_EQUAL_UINT32(1, picks.row_start[picks.grid_h]);
    TEST_ASSERT_EQUAL_UINT32(2 * WIDTH_PX + 5, picks.pixels[0]);
}

static void test_values_that_cannot_be_said_are_passed_over(void)
{
    set(0, 0, 0.5f, 0.9f);
    set(2, 0, 101.0f, 0.9f);
    set(4, 0, NAN, 0.9f);
    set(6, 0, -3.0f, 0.9f);
    set(8, 0, INFINITY, 0.9f);
    set(10, 0, 1.0f, 0.0f);
    set(12, 0, 100.0f, 0.0f);
    choose(2);
    TEST_ASSERT_EQUAL_UINT32(2, picks.row_start[picks.grid_h]);
    TEST_ASSERT_EQUAL_UINT32(10, picks.pixels[0]);
    TEST_ASSERT_EQUAL_UINT32(12, picks.pixels[1]);
}

static void test_an_empty_image_has_rows_and_no_pixels(void)
{
    choose(2);
    TEST_ASSERT_EQUAL_INT32(19, picks.grid_w);
    TEST_ASSERT_EQUAL_INT32(4, picks.grid_h);
    TEST_ASSERT_EQUAL_INT32(3, picks.mask_bytes);
    for (int32_t gy = 0; gy <= picks.grid_h; gy++)
        TEST_ASSERT_EQUAL_UINT32(0, picks.row_start[gy]);
    for (int32_t i = 0; i < picks.grid_h * picks.mask_bytes; i++)
        TEST_ASSERT_EQUAL_UINT8(0, picks.mask[i]);
}

static void test_random_images_at_every_step_agree_with_looking_at_each_cell(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int32_t step = 1; step <= SHEF_PICKS_MAX_STEP; step++) {
        uint32_t n = 0;

        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++)
                set(x, y, shef_test_random_range(&random, 0, 3) ? 0.0f : 5.0f,
                    (float)shef_test_random_range(&random, 0, 4) / 4.0f);
        choose(step);
        for (int32_t gy = 0; gy < picks.grid_h; gy++) {
            TEST_ASSERT_EQUAL_UINT32(n, picks.row_start[gy]);
            for (int32_t gx = 0; gx < picks.grid_w; gx++) {
                int32_t best = -1;

                for (int32_t y = gy * step; y < (gy + 1) * step && y < HEIGHT_PX; y++)
                    for (int32_t x = gx * step; x < (gx + 1) * step && x < WIDTH_PX; x++)
                        if (shef_row_f32(value, y)[x] > 0.0f &&
                            (best < 0 ||
                             shef_row_f32(confidence, y)[x] >
                                 shef_row_f32(confidence, best / WIDTH_PX)[best % WIDTH_PX]))
                            best = y * WIDTH_PX + x;
                TEST_ASSERT_EQUAL(best >= 0, mask_at(gx, gy));
                if (best >= 0)
                    TEST_ASSERT_EQUAL_UINT32(best, picks.pixels[n++]);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(n, picks.row_start[picks.grid_h]);
        TEST_ASSERT_GREATER_THAN_UINT32(0, n);
    }
}

static void test_disparity_codes_are_the_nearest_and_the_unit_grows_with_the_range(void)
{
    TEST_ASSERT_EQUAL_FLOAT(1.0f / 32, shef_disparity_unit_px(64.0f));
    TEST_ASSERT_EQUAL_FLOAT(1.0f / 32, shef_disparity_unit_px(127.0f));
    TEST_ASSERT_EQUAL_FLOAT(1.0f / 16, shef_disparity_unit_px(128.0f));
    TEST_ASSERT_EQUAL_FLOAT(1.0f / 8, shef_disparity_unit_px(256.0f));

    TEST_ASSERT_EQUAL_HEX16(0x0020, shef_disparity_code(1.0f, 0.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0xf021, shef_disparity_code(1.0f + 0.6f / 32, 1.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0xffff, shef_disparity_code(4095.0f / 32, 1.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0x8020, shef_disparity_code(1.0f, 0.5f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0xf020, shef_disparity_code(1.0f, 7.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0x0020, shef_disparity_code(1.0f, NAN, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0, shef_disparity_code(0.0f, 1.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0, shef_disparity_code(128.0f, 1.0f, 32.0f));
    TEST_ASSERT_EQUAL_HEX16(0, shef_disparity_code(NAN, 1.0f, 32.0f));
}

static void test_depth_codes_are_quarter_millimetres(void)
{
    TEST_ASSERT_EQUAL_UINT16(4000, shef_depth_code(1.0f));
    TEST_ASSERT_EQUAL_UINT16(1, shef_depth_code(0.0002f));
    TEST_ASSERT_EQUAL_UINT16(0, shef_depth_code(0.0001f));
    TEST_ASSERT_EQUAL_UINT16(65535, shef_depth_code(16.38375f));
    TEST_ASSERT_EQUAL_UINT16(0, shef_depth_code(16.384f));
    TEST_ASSERT_EQUAL_UINT16(0, shef_depth_code(-1.0f));
    TEST_ASSERT_EQUAL_UINT16(0, shef_depth_code(NAN));
    TEST_ASSERT_EQUAL_UINT16(0, shef_depth_code(INFINITY));
}

static void test_sigma_codes_never_understate_and_overstate_by_a_sixteenth_at_most(void)
{
    for (double sigma_m = 0.00025; sigma_m < 15.8; sigma_m *= 1.0007) {
        const uint8_t code = shef_sigma_code((float)sigma_m);
        const double said_m = 0.00025 * (1.0 + (code & 15) / 16.0) * ldexp(1.0, code >> 4);

        TEST_ASSERT_TRUE(said_m >= sigma_m * (1.0 - 1e-6));
        TEST_ASSERT_TRUE(said_m <= sigma_m * (1.0 + 1.0 / 16 + 1e-6));
    }
    TEST_ASSERT_EQUAL_HEX8(0x00, shef_sigma_code(0.0f));
    TEST_ASSERT_EQUAL_HEX8(0x00, shef_sigma_code(0.00025f));
    TEST_ASSERT_EQUAL_HEX8(0x10, shef_sigma_code(0.0005f));
    TEST_ASSERT_EQUAL_HEX8(0xff, shef_sigma_code(15.872f));
    TEST_ASSERT_EQUAL_HEX8(0xff, shef_sigma_code(1e9f));
    TEST_ASSERT_EQUAL_HEX8(0xff, shef_sigma_code(INFINITY));
    TEST_ASSERT_EQUAL_HEX8(0xff, shef_sigma_code(NAN));
}

/* Of the pixels x0, y0 .. of a cell the one to be taken; UINT32_MAX: none. */
static uint32_t expected_pixel(int32_t x0, int32_t y0, int32_t width_px)
{
    uint32_t best = UINT32_MAX;
    float most = -1.0f;

    for (int32_t y = y0; y < y0 + 2; y++)
        for (int32_t x = x0; x < x0 + 2; x++)
            if (shef_row_f32(value, y)[x] >= 1.0f && shef_row_f32(value, y)[x] <= 100.0f &&
                shef_row_f32(confidence, y)[x] > most) {
                most = shef_row_f32(confidence, y)[x];
                best = (uint32_t)(y * width_px + x);
            }
    return best;
}

/* Rows of whole cells of 2x2 pixels have a way of their own. */
static void test_whole_cells_are_chosen_from_by_the_same_rule(void)
{
    const int32_t width_px = 70, height_px = 8;
    struct shef_test_random draws = shef_test_random_start();
    uint32_t n_picks = 0;

    tearDown();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_picks_create(&picks, width_px, height_px, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&value, width_px, height_px, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&confidence, width_px, height_px, NULL));
    /* Few different confidences, so that many are alike; a third of the values is out of range. */
    for (int32_t y = 0; y < height_px; y++)
        for (int32_t x = 0; x < width_px; x++)
            set(x, y, (float)shef_test_random_range(&draws, -30, 130),
                (float)shef_test_random_range(&draws, 0, 3) / 3.0f);
    choose(2);
    for (int32_t gy = 0; gy < height_px / 2; gy++) {
        TEST_ASSERT_EQUAL_UINT32(n_picks, picks.row_start[gy]);
        for (int32_t gx = 0; gx < width_px / 2; gx++) {
            const uint32_t pixel = expected_pixel(2 * gx, 2 * gy, width_px);

            TEST_ASSERT_EQUAL(pixel != UINT32_MAX, mask_at(gx, gy));
            if (pixel != UINT32_MAX)
                TEST_ASSERT_EQUAL_UINT32(pixel, picks.pixels[n_picks++]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(n_picks, picks.row_start[height_px / 2]);
    TEST_ASSERT_GREATER_THAN_UINT32(0, n_picks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_most_confident_pixel_of_a_cell_stands_for_it);
    RUN_TEST(test_of_two_alike_the_upper_left_is_taken);
    RUN_TEST(test_whole_cells_are_chosen_from_by_the_same_rule);
    RUN_TEST(test_values_that_cannot_be_said_are_passed_over);
    RUN_TEST(test_an_empty_image_has_rows_and_no_pixels);
    RUN_TEST(test_random_images_at_every_step_agree_with_looking_at_each_cell);
    RUN_TEST(test_disparity_codes_are_the_nearest_and_the_unit_grows_with_the_range);
    RUN_TEST(test_depth_codes_are_quarter_millimetres);
    RUN_TEST(test_sigma_codes_never_understate_and_overstate_by_a_sixteenth_at_most);
    return UNITY_END();
}
