#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

#include "support/support.h"

static void test_memory_is_aligned_and_zero(void)
{
    for (size_t n_bytes = 0; n_bytes < 300; n_bytes += 37) {
        uint8_t *memory = shef_memory_create(n_bytes, 1);

        TEST_ASSERT_NOT_NULL(memory);
        TEST_ASSERT_EQUAL_UINT64(0, (uintptr_t)memory % SHEF_MEMORY_ALIGN_BYTES);
        for (size_t i = 0; i < n_bytes; i++)
            TEST_ASSERT_EQUAL_UINT8(0, memory[i]);
        free(memory);
    }
}

static void test_sizes_round_up_to_whole_cache_lines(void)
{
    TEST_ASSERT_EQUAL_size_t(0, shef_memory_round_up(0));
    TEST_ASSERT_EQUAL_size_t(64, shef_memory_round_up(1));
    TEST_ASSERT_EQUAL_size_t(64, shef_memory_round_up(64));
    TEST_ASSERT_EQUAL_size_t(128, shef_memory_round_up(65));
    TEST_ASSERT_EQUAL_size_t((size_t)1 << 40, shef_memory_round_up(((size_t)1 << 40) - 63));
}

static void test_a_size_beyond_the_address_space_gives_null(void)
{
    TEST_ASSERT_NULL(shef_memory_create(SIZE_MAX / 2, 3));
    TEST_ASSERT_NULL(shef_memory_create(SIZE_MAX, 1));
}

static void test_image_rows_are_aligned_disjoint_and_black(void)
{
    struct shef_image_u16 image;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u16(&image, 33, 5, NULL));
    TEST_ASSERT_EQUAL_INT32(33, image.width_px);
    TEST_ASSERT_EQUAL_INT32(5, image.height_px);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(33 * 2, image.stride_bytes);
    for (int32_t y = 0; y < 5; y++) {
        uint16_t *row = shef_row_u16(image, y);

        TEST_ASSERT_EQUAL_UINT64(0, (uintptr_t)row % SHEF_MEMORY_ALIGN_BYTES);
        for (int32_t x = 0; x < 33; x++) {
            TEST_ASSERT_EQUAL_UINT16(0, row[x]);
            row[x] = 0xffff;
        }
    }
    shef_image_destroy_u16(&image);
    TEST_ASSERT_NULL(image.data);
    shef_image_destroy_u16(&image);
}

static void test_a_copy_has_the_same_pixels_and_no_others(void)
{
    float memory[3][5];
    struct shef_image_f32 copy = { &memory[0][1], 3, 3, sizeof memory[0] };
    struct shef_image_f32 image;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&image, 3, 3, NULL));
    for (int32_t y = 0; y < 3; y++)
        for (int32_t x = 0; x < 5; x++)
            memory[y][x] = -1.0f;
    for (int32_t y = 0; y < 3; y++)
        for (int32_t x = 0; x < 3; x++)
            shef_row_f32(image, y)[x] = (float)(10 * y + x);
    shef_image_copy_f32(image, copy);
    for (int32_t y = 0; y < 3; y++) {
        const float expected[5] = { -1.0f, (float)(10 * y), (float)(10 * y + 1),
                                    (float)(10 * y + 2), -1.0f };

        TEST_ASSERT_EQUAL_FLOAT_ARRAY(expected, memory[y], 5);
    }
    shef_image_destroy_f32(&image);
}

static void test_impossible_sides_are_refused_and_leave_the_view_alone(void)
{
    static const int32_t sides[][2] = { { 0, 5 }, { 5, 0 }, { -1, 5 }, { 16385, 1 }, { 1, 16385 } };

    for (size_t i = 0; i < sizeof sides / sizeof sides[0]; i++) {
        struct shef_image_f32 image = { .width_px = 77 };
        struct shef_error err = { 0 };

        TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                          shef_image_create_f32(&image, sides[i][0], sides[i][1], &err));
        TEST_ASSERT_NOT_NULL(strstr(err.text, "sides must be 1 to 16384"));
        TEST_ASSERT_EQUAL_INT32(77, image.width_px);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_memory_is_aligned_and_zero);
    RUN_TEST(test_sizes_round_up_to_whole_cache_lines);
    RUN_TEST(test_a_size_beyond_the_address_space_gives_null);
    RUN_TEST(test_image_rows_are_aligned_disjoint_and_black);
    RUN_TEST(test_a_copy_has_the_same_pixels_and_no_others);
    RUN_TEST(test_impossible_sides_are_refused_and_leave_the_view_alone);
    return UNITY_END();
}
