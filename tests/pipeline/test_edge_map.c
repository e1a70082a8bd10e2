#include "pipeline/edge_map.h"

#include <string.h>

#include "core/memory.h"
#include "robust_cases.h"

static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                             SHEF_EDGE_GRADED };

/* One word and less, whole words, and a little more. */
static const int32_t widths[] = { 1, 7, 63, 64, 65, 130, 641 };

static struct shef_edge_map map;
static struct shef_image_u8 image;

void tearDown(void)
{
    shef_edge_map_destroy(&map);
    shef_image_destroy_u8(&image);
}

static void create(enum shef_edge_kind kind, int32_t width_px, int32_t height_px)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_edge_map_create(&map, kind, width_px, height_px, &err),
                              err.text);
}

static void create_image(int32_t width_px, int32_t height_px)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_image_create_u8(&image, width_px, height_px, &err),
                              err.text);
}

static void test_a_new_map_has_its_size_and_no_edges(void)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        create(kinds[i], 130, 5);
        TEST_ASSERT_EQUAL(kinds[i], map.kind);
        TEST_ASSERT_EQUAL_INT32(130, map.width_px);
        TEST_ASSERT_EQUAL_INT32(5, map.height_px);
        TEST_ASSERT_EQUAL_INT64(0, shef_edge_map_count(&map));
        TEST_ASSERT_EQUAL(kinds[i] != SHEF_EDGE_GRADED, map.plus != NULL);
        TEST_ASSERT_EQUAL(kinds[i] == SHEF_EDGE_TERNARY, map.minus != NULL);
        TEST_ASSERT_EQUAL(kinds[i] == SHEF_EDGE_GRADED, map.graded != NULL);
        shef_edge_map_destroy(&map);
    }
}

static void test_impossible_sizes_are_refused_with_a_sentence(void)
{
    static const int32_t sizes[][2] = { { 0, 10 },     { 10, 0 },     { -1, 10 },
                                        { 16385, 10 }, { 10, 16385 }, { INT32_MAX, INT32_MAX } };

    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct shef_error err = { 0 };

        TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_edge_map_create(&map, SHEF_EDGE_UNSIGNED,
                                                                 sizes[i][0], sizes[i][1], &err));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "1 to 16384"), err.text);
        TEST_ASSERT_NULL(map.plus);
    }
}

static void test_a_destroyed_map_can_be_destroyed_again(void)
{
    create(SHEF_EDGE_TERNARY, 10, 10);
    shef_edge_map_destroy(&map);
    TEST_ASSERT_NULL(map.plus);
    TEST_ASSERT_NULL(map.minus);
    shef_edge_map_destroy(&map);
}

static void test_rows_and_counts_are_what_was_set_in_every_kind(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        for (size_t j = 0; j < sizeof widths / sizeof widths[0]; j++) {
            struct edges edges = edges_random(&random, kinds[i], widths[j], 9, 0.4);
            int64_t n_edges = 0;

            for (int32_t y = 0; y < 9; y++) {
                int8_t row[700];

                memset(row, 99, sizeof row);
                shef_edge_map_row(&edges.left, y, row);
                for (int32_t x = 0; x < widths[j]; x++) {
                    TEST_ASSERT_EQUAL_INT8(edge_at(&edges.left, x, y), row[x]);
                    n_edges += row[x] != 0;
                }
                TEST_ASSERT_EQUAL_INT8_MESSAGE(99, row[widths[j]], "wrote past the row");
            }
            TEST_ASSERT_EQUAL_INT64(n_edges, shef_edge_map_count(&edges.left));
            edges_destroy(&edges);
        }
}

static void test_all_bright_maps_count_every_pixel(void)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        create(kinds[i], 65, 3);
        for (int32_t y = 0; y < 3; y++)
            for (int32_t x = 0; x < 65; x++)
                edge_set(&map, x, y, i == 2 ? -127 : 1);
        TEST_ASSERT_EQUAL_INT64(65 * 3, shef_edge_map_count(&map));
        shef_edge_map_destroy(&map);
    }
}

static void test_a_binary_image_becomes_the_same_map(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (size_t j = 0; j < sizeof widths / sizeof widths[0]; j++) {
        struct shef_error err = { 0 };

        create(SHEF_EDGE_UNSIGNED, widths[j], 6);
        create_image(widths[j], 6);
        /* A second time, to see that the first edges are gone. */
        for (int round = 0; round < 2; round++) {
            for (int32_t y = 0; y < 6; y++)
                for (int32_t x = 0; x < widths[j]; x++)
                    shef_row_u8(image, y)[x] = shef_test_random_range(&random, 0, 1) ? 255 : 0;
            TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_edge_map_set_binary(&map, image, &err),
                                      err.text);
            for (int32_t y = 0; y < 6; y++)
                for (int32_t x = 0; x < widths[j]; x++)
                    TEST_ASSERT_EQUAL_INT32(shef_row_u8(image, y)[x] == 255, edge_at(&map, x, y));
        }
        tearDown();
    }
}

static void test_padding_bits_stay_zero(void)
{
    struct shef_error err = { 0 };

    create(SHEF_EDGE_UNSIGNED, 70, 2);
    create_image(70, 2);
    memset(shef_row_u8(image, 0), 255, 70);
    memset(shef_row_u8(image, 1), 255, 70);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_edge_map_set_binary(&map, image, &err), err.text);
    for (int32_t y = 0; y < 2; y++) {
        TEST_ASSERT_EQUAL_HEX64(UINT64_MAX, map.plus[y * map.stride_words]);
        TEST_ASSERT_EQUAL_HEX64(0x3f, map.plus[y * map.stride_words + 1]);
    }
}

static void test_a_grey_image_is_refused_and_the_sentence_says_where(void)
{
    struct shef_error err = { 0 };

    create(SHEF_EDGE_UNSIGNED, 12, 8);
    create_image(12, 8);
    shef_row_u8(image, 5)[3] = 254;
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_edge_map_set_binary(&map, image, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "(3, 5) is 254"), err.text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_new_map_has_its_size_and_no_edges);
    RUN_TEST(test_impossible_sizes_are_refused_with_a_sentence);
    RUN_TEST(test_a_destroyed_map_can_be_destroyed_again);
    RUN_TEST(test_rows_and_counts_are_what_was_set_in_every_kind);
    RUN_TEST(test_all_bright_maps_count_every_pixel);
    RUN_TEST(test_a_binary_image_becomes_the_same_map);
    RUN_TEST(test_padding_bits_stay_zero);
    RUN_TEST(test_a_grey_image_is_refused_and_the_sentence_says_where);
    return UNITY_END();
}
