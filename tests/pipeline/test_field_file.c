#include "pipeline/field_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

/* Numbers that need all their digits. */
static const struct shef_smooth_field field = {
    .c = { 1.0 / 3.0, -3.0811111111111111, 1e-17, 5.7e-300, -0.0, 0.1 },
    .width_px = 640,
    .height_px = 480,
};

static const char *path;

void setUp(void)
{
    path = shef_test_temp_path("field.json");
    remove(path);
}

static void write_text(const char *text)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_file_replace(path, text, strlen(text), &err), err.text);
}

static void test_a_field_comes_back_bit_for_bit(void)
{
    struct shef_error err = { 0 };
    struct shef_smooth_field read;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_field_file_write(path, SHEF_FIELD_KIND_BIAS, &field, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_field_file_read(path, SHEF_FIELD_KIND_BIAS, &read, &err), err.text);
    TEST_ASSERT_EQUAL_MEMORY(field.c, read.c, sizeof field.c);
    TEST_ASSERT_EQUAL_INT32(640, read.width_px);
    TEST_ASSERT_EQUAL_INT32(480, read.height_px);
}

static void test_whole_numbers_and_unknown_entries_are_welcome(void)
{
    struct shef_error err = { 0 };
    struct shef_smooth_field read;

    write_text("{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, \"note\": 1,"
               "\"coefficients_px\": [1, 2.5, 0, 0, 0, -1]}");
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_field_file_read(path, SHEF_FIELD_KIND_ALIGN, &read, &err), err.text);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, read.c[0]);
    TEST_ASSERT_EQUAL_DOUBLE(2.5, read.c[1]);
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, read.c[5]);
}

/* One sentence that names the file, and nothing read. */
static void expect_refused(enum shef_err code, const char *reason)
{
    struct shef_error err = { 0 };
    struct shef_smooth_field read = { .width_px = -7 };

    TEST_ASSERT_EQUAL(code, shef_field_file_read(path, SHEF_FIELD_KIND_ALIGN, &read, &err));
    TEST_ASSERT_EQUAL_MESSAGE(code, err.code, err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, path), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
    TEST_ASSERT_NULL_MESSAGE(strchr(err.text, '\n'), err.text);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(-7, read.width_px, "out_field was written");
}

static void test_a_field_of_another_kind_is_not_taken_for_this_one(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_field_file_write(path, SHEF_FIELD_KIND_BIAS, &field, &err), err.text);
    expect_refused(SHEF_ERR_FORMAT, "'disparity_bias', 'vertical_residual' is needed");
}

static void test_damaged_files_get_a_sentence_that_says_what_is_wrong(void)
{
    static const struct {
        const char *text;
        const char *reason;
    } cases[] = {
        { "", "no JSON" },
        { "{", "no JSON" },
        { "[1, 2, 3]", "kind '(none)'" },
        { "{}", "kind '(none)'" },
        { "{\"kind\": \"two\\nlines\"}", "kind 'two?lines'" },
        { "{\"kind\": 5}", "kind '(none)'" },
        { "{\"kind\": \"vertical_residual\"}", "1 to 16384" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 0, \"height_px\": 48}", "found 0 and" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 4.8}", "64 and 0" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 99999}", "99999" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48}",
          "list of 6 numbers" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, 3, 4, 5]}",
          "list of 6 numbers" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, 3, 4, 5, 6, 7]}",
          "list of 6 numbers" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, \"3\", 4, 5, 6]}",
          "coefficients_px[2] is no number" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, NaN, 4, 5, 6]}",
          "no JSON" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, 1e999, 4, 5, 6]}",
          "no JSON" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64, \"height_px\": 48, "
          "\"coefficients_px\": [1, 2, 3, 4, -16385, 6]}",
          "coefficients_px[4] is -16385, it must lie within 16384 px" },
        { "{\"kind\": \"vertical_residual\", \"width_px\": 64} trailing", "no JSON" },
    };

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_text(cases[i].text);
        expect_refused(SHEF_ERR_FORMAT, cases[i].reason);
    }
}

static void test_every_shortened_file_is_refused(void)
{
    struct shef_error err = { 0 };
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_field_file_write(path, SHEF_FIELD_KIND_ALIGN, &field, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_file_read(path, 65536, &bytes, &n_bytes, &err),
                              err.text);
    /* The last bytes may be white space. */
    while (n_bytes > 0 && bytes[n_bytes - 1] != '}')
        n_bytes--;
    TEST_ASSERT_GREATER_THAN_size_t(100, n_bytes);
    for (size_t n = 0; n < n_bytes; n++) {
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_file_replace(path, bytes, n, &err), err.text);
        expect_refused(SHEF_ERR_FORMAT, "");
    }
    free(bytes);
}

static void test_a_missing_file_and_a_folder_are_told_apart(void)
{
    expect_refused(SHEF_ERR_NOT_FOUND, "");
    path = shef_test_temp_folder();
    expect_refused(SHEF_ERR_INVALID, "");
}

static void test_a_field_that_cannot_be_meant_is_not_written(void)
{
    static const double bad[] = { NAN, INFINITY, -INFINITY, 16385.0, -1e300 };

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct shef_error err = { 0 };
        struct shef_smooth_field broken = field;

        broken.c[i] = bad[i];
        TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                          shef_field_file_write(path, SHEF_FIELD_KIND_ALIGN, &broken, &err));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "within 16384 px"), err.text);
        TEST_ASSERT_EQUAL_INT(0, shef_test_temp_count());
    }
}

static void test_a_failed_write_leaves_nothing_behind(void)
{
    struct shef_error err = { 0 };
    const char *nowhere = shef_test_temp_path("no_such_folder/field.json");

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_field_file_write(nowhere, SHEF_FIELD_KIND_ALIGN, &field, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, nowhere), err.text);
    TEST_ASSERT_EQUAL_INT(0, shef_test_temp_count());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_field_comes_back_bit_for_bit);
    RUN_TEST(test_whole_numbers_and_unknown_entries_are_welcome);
    RUN_TEST(test_a_field_of_another_kind_is_not_taken_for_this_one);
    RUN_TEST(test_damaged_files_get_a_sentence_that_says_what_is_wrong);
    RUN_TEST(test_every_shortened_file_is_refused);
    RUN_TEST(test_a_missing_file_and_a_folder_are_told_apart);
    RUN_TEST(test_a_field_that_cannot_be_meant_is_not_written);
    RUN_TEST(test_a_failed_write_leaves_nothing_behind);
    return UNITY_END();
}
