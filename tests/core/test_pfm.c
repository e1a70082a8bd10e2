#include "core/pfm.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "support/support.h"

static struct shef_image_f32 image;

void tearDown(void)
{
    shef_image_destroy_f32(&image);
}

/* The bit patterns of 1, 2, 3 (bottom row) and 4, 5, 6 (top row). */
#define LITTLE_VALUES                                                                              \
    "\x00\x00\x80\x3f\x00\x00\x00\x40\x00\x00\x40\x40"                                             \
    "\x00\x00\x80\x40\x00\x00\xa0\x40\x00\x00\xc0\x40"
#define BIG_VALUES                                                                                 \
    "\x3f\x80\x00\x00\x40\x00\x00\x00\x40\x40\x00\x00"                                             \
    "\x40\x80\x00\x00\x40\xa0\x00\x00\x40\xc0\x00\x00"

#define DECODE(literal, err)                                                                       \
    shef_pfm_decode((const uint8_t *)(literal), sizeof(literal) - 1, &image, err)

static void expect_rows_456_then_123(void)
{
    const float top[] = { 4, 5, 6 }, bottom[] = { 1, 2, 3 };

    TEST_ASSERT_EQUAL_INT32(3, image.width_px);
    TEST_ASSERT_EQUAL_INT32(2, image.height_px);
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(top, shef_row_f32(image, 0), 3);
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(bottom, shef_row_f32(image, 1), 3);
}

static void test_little_endian_rows_come_out_top_first(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, DECODE("Pf\n3 2\n-1.0\n" LITTLE_VALUES, NULL));
    expect_rows_456_then_123();
}

static void test_big_endian_is_read_too(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, DECODE("Pf\n3 2\n1.000\n" BIG_VALUES, NULL));
    expect_rows_456_then_123();
}

static void test_the_size_of_the_scale_and_the_kind_of_white_space_do_not_matter(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, DECODE("Pf 3\t2\r\n-0.003922 " LITTLE_VALUES, NULL));
    expect_rows_456_then_123();
}

static void test_a_first_value_that_looks_like_a_line_end_stays_a_value(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, DECODE("Pf\n1 1\n-1\n\x0a\x0a\x0a\x41", NULL));
    TEST_ASSERT_EQUAL_FLOAT(8.62745094f, image.data[0]);
}

static void test_what_is_written_is_read_back_bit_by_bit(void)
{
    const char *path = shef_test_temp_path("back.pfm");
    struct shef_image_f32 written;
    struct shef_test_random random = shef_test_random_start();

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&written, 37, 11, NULL));
    for (int32_t y = 0; y < 11; y++)
        for (int32_t x = 0; x < 37; x++)
            shef_row_f32(written, y)[x] = (float)(shef_test_random_unit(&random) * 100 - 50);
    shef_row_f32(written, 3)[5] = NAN;
    shef_row_f32(written, 4)[5] = -INFINITY;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_write(path, written, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_read(path, &image, NULL));
    TEST_ASSERT_EQUAL_INT32(37, image.width_px);
    TEST_ASSERT_EQUAL_INT32(11, image.height_px);
    for (int32_t y = 0; y < 11; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(written, y), shef_row_f32(image, y), 37 * 4);
    shef_image_destroy_f32(&written);
}

static void test_broken_files_are_refused_with_the_reason(void)
{
    static const struct {
        const char *bytes;
        size_t n_bytes;
        const char *reason;
    } cases[] = {
#define CASE(literal, reason) { literal, sizeof(literal) - 1, reason }
        CASE("", "does not begin with 'Pf'"),
        CASE("P5\n3 2\n255\n", "does not begin with 'Pf'"),
        CASE("Pfx\n3 2\n-1\n" LITTLE_VALUES, "does not begin with 'Pf'"),
        CASE("\x89PNG\r\n\x1a\n", "does not begin with 'Pf'"),
        CASE("PF\n1 1\n-1\n" LITTLE_VALUES, "grey ('Pf') is needed"),
        CASE("Pf\n", "width and height"),
        CASE("Pf\n0 2\n-1\n", "width and height"),
        CASE("Pf\n-3 2\n-1\n" LITTLE_VALUES, "width and height"),
        CASE("Pf\n3.5 2\n-1\n" LITTLE_VALUES, "width and height"),
        CASE("Pf\n3 16385\n-1\n" LITTLE_VALUES, "width and height"),
        CASE("Pf\n99999999999999999999 2\n-1\n" LITTLE_VALUES, "width and height"),
        CASE("Pf\n00000000000000000000000000000000003 2\n-1\n", "width and height"),
        CASE("Pf\n3 2\n0\n" LITTLE_VALUES, "scale"),
        CASE("Pf\n3 2\nnan\n" LITTLE_VALUES, "scale"),
        CASE("Pf\n3 2\n-1.0x\n" LITTLE_VALUES, "scale"),
        CASE("Pf\n3 2\n-1.0", "scale"),
        CASE("Pf\n16384 16384\n-1\n" LITTLE_VALUES, "truncated"),
        CASE("Pf\n3 2\n-1\n", "truncated: 3 x 2 px need 24 bytes of values, the file has 0"),
        CASE("Pf\n3 2\n-1\n" LITTLE_VALUES "\n", "longer than its header says"),
#undef CASE
    };

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct shef_error err = { 0 };

        TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_pfm_decode((const uint8_t *)cases[i].bytes,
                                                           cases[i].n_bytes, &image, &err));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, cases[i].reason), err.text);
        TEST_ASSERT_NULL(image.data);
    }
}

static void test_every_shortening_of_a_file_is_refused(void)
{
    static const char whole[] = "Pf\n3 2\n-1.0\n" LITTLE_VALUES;

    for (size_t n_bytes = 0; n_bytes < sizeof whole - 1; n_bytes++)
        TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT,
                          shef_pfm_decode((const uint8_t *)whole, n_bytes, &image, NULL));
}

static void test_a_file_error_names_the_file(void)
{
    const char *path = shef_test_temp_path("bad.pfm");
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "junk", 4, NULL));
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_pfm_read(path, &image, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "bad.pfm': not a PFM file"));
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_pfm_read("/no/such.pfm", &image, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "/no/such.pfm"));
}

static void test_the_authors_ground_truth_is_read(void)
{
    char path[4200];
    double sum = 0;

    SHEF_TEST_NEEDS_DATA("shef");
    snprintf(path, sizeof path, "%s/gt/1.pfm", shef_test_data("shef"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_read(path, &image, NULL));
    TEST_ASSERT_EQUAL_INT32(640, image.width_px);
    TEST_ASSERT_EQUAL_INT32(480, image.height_px);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const float disparity_px = shef_row_f32(image, y)[x];

            TEST_ASSERT_TRUE(disparity_px >= 0 && disparity_px <= 80);
            sum += disparity_px;
        }
    TEST_ASSERT_GREATER_THAN_INT(640 * 480, (int)sum);
    /* The file's first value, 0x4254c37d, belongs to the bottom left. */
    TEST_ASSERT_EQUAL_FLOAT(53.1909065f, shef_row_f32(image, 479)[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_little_endian_rows_come_out_top_first);
    RUN_TEST(test_big_endian_is_read_too);
    RUN_TEST(test_the_size_of_the_scale_and_the_kind_of_white_space_do_not_matter);
    RUN_TEST(test_a_first_value_that_looks_like_a_line_end_stays_a_value);
    RUN_TEST(test_what_is_written_is_read_back_bit_by_bit);
    RUN_TEST(test_broken_files_are_refused_with_the_reason);
    RUN_TEST(test_every_shortening_of_a_file_is_refused);
    RUN_TEST(test_a_file_error_names_the_file);
    RUN_TEST(test_the_authors_ground_truth_is_read);
    return UNITY_END();
}
