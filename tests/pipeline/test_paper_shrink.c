#include "pipeline/paper_shrink.h"

#include "bin_corr_cases.h"

static void expect_nearest_pixels(struct shef_test_random *random, enum shef_edge_kind kind,
                                  int32_t from_width, int32_t from_height, int32_t to_width,
                                  int32_t to_height)
{
    struct shef_edge_map from = shef_test_random_map(random, kind, from_width, from_height, 0.5);
    /* Full, so that bits which should have been cleared show. */
    struct shef_edge_map to = shef_test_random_map(random, kind, to_width, to_height, 1);
    struct shef_paper_shrink *shrink = NULL;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_paper_shrink_create(&shrink, from_width, from_height, to_width,
                                                        to_height, &err));
    TEST_ASSERT_TRUE(shef_paper_shrink_bytes(shrink) > 0);
    shef_paper_shrink_run(shrink, &from, &to);
    for (int32_t y = 0; y < to_height; y++) {
        for (int32_t x = 0; x < to_width; x++) {
            const int32_t from_x = (int32_t)((x + 0.5) * from_width / to_width);
            const int32_t from_y = (int32_t)((y + 0.5) * from_height / to_height);

            TEST_ASSERT_EQUAL_INT(shef_test_edge_at(&from, from_x, from_y),
                                  shef_test_edge_at(&to, x, y));
        }
        if (to_width % 64 != 0) {
            const uint64_t last = to.plus[y * to.stride_words + to.stride_words - 1];

            TEST_ASSERT_EQUAL_UINT64(0, last >> (to_width % 64));
        }
    }
    shef_paper_shrink_destroy(shrink);
    shef_edge_map_destroy(&from);
    shef_edge_map_destroy(&to);
}

static void test_every_pixel_is_the_nearest_one(void)
{
    struct shef_test_random random = shef_test_random_start();

    expect_nearest_pixels(&random, SHEF_EDGE_UNSIGNED, 640, 48, 576, 43);
    expect_nearest_pixels(&random, SHEF_EDGE_UNSIGNED, 640, 48, 640, 48);
    expect_nearest_pixels(&random, SHEF_EDGE_UNSIGNED, 1280, 20, 64, 1);
    expect_nearest_pixels(&random, SHEF_EDGE_TERNARY, 1, 1, 1, 1);
    for (int i = 0; i < 200; i++) {
        const enum shef_edge_kind kind = i % 2 ? SHEF_EDGE_TERNARY : SHEF_EDGE_UNSIGNED;
        const int32_t width = shef_test_random_range(&random, 1, 700);
        const int32_t height = shef_test_random_range(&random, 1, 20);

        expect_nearest_pixels(&random, kind, width, height,
                              shef_test_random_range(&random, 1, width),
                              shef_test_random_range(&random, 1, height));
    }
}

static void test_the_source_of_a_pixel_is_under_its_centre(void)
{
    TEST_ASSERT_EQUAL_INT32(0, shef_paper_source_of(0, 10, 9));
    TEST_ASSERT_EQUAL_INT32(5, shef_paper_source_of(4, 10, 9)); /* 4.5 * 10 / 9 = 5 */
    TEST_ASSERT_EQUAL_INT32(9, shef_paper_source_of(8, 10, 9)); /* 8.5 * 10 / 9 = 9.4 */
    TEST_ASSERT_EQUAL_INT32(1, shef_paper_source_of(0, 3, 1));
    TEST_ASSERT_EQUAL_INT32(4, shef_paper_source_of(4, 9, 10)); /* enlarging: 4.5 * 0.9 = 4.05 */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_pixel_is_the_nearest_one);
    RUN_TEST(test_the_source_of_a_pixel_is_under_its_centre);
    return UNITY_END();
}
