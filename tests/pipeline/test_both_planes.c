/* A pixel that is set in both planes of a ternary map is no edge, for whoever reads the map. */
#include "pipeline/edge_map.h"

#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/kernels/bin_corr.h"
#include "pipeline/robust.h"
#include "robust_cases.h"

#define WIDTH_PX  96
#define HEIGHT_PX 64

/* The same random maps twice; in the second, what has no edge in the first is set in both planes
 * at every fifth pixel. */
static struct edges plain;
static struct edges marked;

static void mark(const struct shef_edge_map *from, struct shef_edge_map *map)
{
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const size_t at = (size_t)(y * map->stride_words + x / 64);
            const uint64_t bit = UINT64_C(1) << (x % 64);

            edge_set(map, x, y, edge_at(from, x, y));
            if (edge_at(from, x, y) == 0 && (x + 2 * y) % 5 == 0) {
                map->plus[at] |= bit;
                map->minus[at] |= bit;
            }
        }
}

void setUp(void)
{
    struct shef_test_random random = shef_test_random_start();

    plain = edges_random(&random, SHEF_EDGE_TERNARY, WIDTH_PX, HEIGHT_PX, 0.3);
    marked = edges_create(SHEF_EDGE_TERNARY, WIDTH_PX, HEIGHT_PX);
    mark(&plain.left, &marked.left);
    mark(&plain.right, &marked.right);
    TEST_ASSERT_FALSE(memcmp(plain.left.plus, marked.left.plus, 8) == 0);
}

void tearDown(void)
{
    edges_destroy(&plain);
    edges_destroy(&marked);
}

static void test_it_does_not_count(void)
{
    int8_t expected[WIDTH_PX];
    int8_t row[WIDTH_PX];

    TEST_ASSERT_EQUAL_INT64(shef_edge_map_count(&plain.left), shef_edge_map_count(&marked.left));
    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        shef_edge_map_row(&plain.left, y, expected);
        shef_edge_map_row(&marked.left, y, row);
        TEST_ASSERT_EQUAL_INT8_ARRAY(expected, row, WIDTH_PX);
    }
}

static void test_the_window_correlation_does_not_read_it_out(void)
{
    static const char *const isas[] = { "c", "avx2", "avx512", "neon" };
    const struct shef_bin_corr_params params = {
        .width_px = WIDTH_PX, .height_px = HEIGHT_PX, .window_px = 9, .d_min = 1, .d_max = 20
    };
    struct shef_image_i16 images[4];
    struct shef_error err = { 0 };

    for (int i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&images[i], WIDTH_PX, HEIGHT_PX, &err));
    for (size_t i = 0; i < sizeof isas / sizeof isas[0]; i++) {
        const uint32_t features = shef_cpu_features_of(isas[i]) & shef_cpu_features();
        struct shef_bin_corr *corr;

        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_bin_corr_create(&corr, &params, features, 1, &err),
                                  err.text);
        shef_bin_corr_run(corr, &plain.left, &plain.right, NULL, images[0], images[1]);
        shef_bin_corr_run(corr, &marked.left, &marked.right, NULL, images[2], images[3]);
        shef_bin_corr_destroy(corr);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int part = 0; part < 2; part++)
                TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(images[part], y),
                                              shef_row_i16(images[2 + part], y), WIDTH_PX);
    }
    for (int i = 0; i < 4; i++)
        shef_image_destroy_i16(&images[i]);
}

static void test_the_robust_matcher_does_not_see_it(void)
{
    const struct shef_robust_params params =
        shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_TERNARY);
    struct shef_robust *matcher = matcher_create(&params, NULL);
    struct result expected = match(matcher, &plain, 1);

    shef_robust_reset(matcher);

    struct result result = match(matcher, &marked, 1);

    expect_same_result(&expected, &result);
    TEST_ASSERT_EQUAL_DOUBLE(expected.report.right_share, result.report.right_share);
    result_destroy(&expected);
    result_destroy(&result);
    shef_robust_destroy(matcher);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_does_not_count);
    RUN_TEST(test_the_window_correlation_does_not_read_it_out);
    RUN_TEST(test_the_robust_matcher_does_not_see_it);
    return UNITY_END();
}
