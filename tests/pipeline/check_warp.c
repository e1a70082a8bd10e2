#include "pipeline/kernels/warp.h"

#include <stdlib.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "kernel_check.h"

#define MAX_SEGMENTS 81
#define ONE_PX       65536

static int16_t *pixels; /* exactly what a kernel may read: a sanitizer sees it read more */
static struct shef_warp_source source;
static struct shef_warp_node nodes[MAX_SEGMENTS + 1];
static struct shef_warp_node offsets[(MAX_SEGMENTS + 1) / 2];

void tearDown(void)
{
    free(pixels);
    pixels = NULL;
}

static void make_source(struct shef_test_random *random, int32_t width_px, int32_t height_px)
{
    const size_t n = (size_t)width_px * (size_t)height_px;
    const size_t n_padded = n + SHEF_WARP_PAD_BYTES / sizeof *pixels;

    tearDown();
    pixels = malloc(n_padded * sizeof *pixels);
    TEST_ASSERT_NOT_NULL(pixels);
    for (size_t i = 0; i < n_padded; i++) {
        const int32_t value = shef_test_random_range(random, -32767, 32767);

        pixels[i] = (int16_t)(i % 3 == 0 ? value : i % 3 == 1 ? 32767 : -32767);
    }
    source = (struct shef_warp_source){ pixels, width_px, width_px, height_px };
}

static int32_t between(struct shef_test_random *random, double low_px, double high_px)
{
    return (int32_t)((low_px + (high_px - low_px) * shef_test_random_unit(random)) * ONE_PX);
}

/* A row of the map: it starts and advances as given, and bends a little. */
static void make_nodes(struct shef_test_random *random, int32_t x_q16, int32_t y_q16, double dx_px,
                       double dy_px)
{
    for (int32_t s = 0; s <= MAX_SEGMENTS; s++) {
        nodes[s] = (struct shef_warp_node){ x_q16, y_q16 };
        x_q16 += between(random, 8 * dx_px - .1, 8 * dx_px + .1);
        y_q16 += between(random, 8 * dy_px - .05, 8 * dy_px + .05);
    }
    for (int32_t i = 0; i < (MAX_SEGMENTS + 1) / 2; i++)
        offsets[i] = (struct shef_warp_node){ between(random, -2, 2), between(random, -2, 2) };
}

static void expect_all_equal_reference(struct shef_test_random *random)
{
    const int32_t n_segments = shef_test_random_range(random, 1, MAX_SEGMENTS);
    const size_t n_values = (size_t)n_segments * SHEF_WARP_SEGMENT_PX;
    int16_t expected[MAX_SEGMENTS * SHEF_WARP_SEGMENT_PX];

    shef_warp_kernel_c.row(expected, nodes, offsets, n_segments, &source);
    for (int k = 0; k < n_features; k++) {
        int16_t actual[MAX_SEGMENTS * SHEF_WARP_SEGMENT_PX + 1];

        actual[n_values] = 4321;
        shef_warp_pick(features[k])->row(actual, nodes, offsets, n_segments, &source);
        TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n_values);
        TEST_ASSERT_EQUAL_INT16(4321, actual[n_values]);
    }
}

static void test_rows_of_ordinary_maps_equal_the_reference(void)
{
    static const double scales[] = { 1, .427, 1.8, .05, 2.2 };
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 500; round++) {
        make_source(&random, shef_test_random_range(&random, 1, 700),
                    shef_test_random_range(&random, 1, 40));
        make_nodes(&random, between(&random, -20, 40), between(&random, -3, source.height_px + 2),
                   scales[round % 5], .02 * (round % 7 - 3));
        expect_all_equal_reference(&random);
    }
}

static void test_rows_of_strange_maps_equal_the_reference(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 500; round++) {
        make_source(&random, shef_test_random_range(&random, 1, 200), 200);
        /* Mirrored, steep, standing still, and positions with nothing regular about them. */
        make_nodes(&random, between(&random, 0, 200), between(&random, 0, 200),
                   between(&random, -2, 2) / 65536.0, between(&random, -2, 2) / 65536.0);
        for (int32_t s = 0; round % 2 && s <= MAX_SEGMENTS; s++)
            nodes[s] = (struct shef_warp_node){ between(&random, -1024, 3071),
                                                between(&random, -1024, 3071) };
        expect_all_equal_reference(&random);
    }
}

static void test_whole_positions_copy_and_outside_is_zero(void)
{
    struct shef_test_random random = shef_test_random_start();
    int16_t row[48];

    make_source(&random, 40, 5);
    for (int32_t s = 0; s <= 6; s++) {
        nodes[s] = (struct shef_warp_node){ s * 8 * ONE_PX, 4 * ONE_PX };
        offsets[s / 2] = (struct shef_warp_node){ 0, 0 };
    }
    shef_warp_kernel_c.row(row, nodes, offsets, 6, &source);
    TEST_ASSERT_EQUAL_INT16_ARRAY(pixels + 4 * 40, row, 40);
    for (int x = 40; x < 48; x++)
        TEST_ASSERT_EQUAL_INT16(0, row[x]);
    /* Half a pixel to the right: the mean of two neighbours. */
    for (int32_t s = 0; s <= 6; s++)
        nodes[s].x_q16 += ONE_PX / 2;
    shef_warp_kernel_c.row(row, nodes, offsets, 6, &source);
    for (int x = 0; x < 39; x++)
        TEST_ASSERT_INT_WITHIN(1, (pixels[160 + x] + pixels[161 + x]) / 2, row[x]);
    TEST_ASSERT_INT_WITHIN(1, pixels[199] / 2, row[39]);
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]), shef_warp_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rows_of_ordinary_maps_equal_the_reference);
    RUN_TEST(test_rows_of_strange_maps_equal_the_reference);
    RUN_TEST(test_whole_positions_copy_and_outside_is_zero);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
