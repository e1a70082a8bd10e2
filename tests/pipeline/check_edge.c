#include "pipeline/kernels/edge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "kernel_check.h"

#define MAX_VALUES 1100
#define MAX_WORDS  ((MAX_VALUES + 63) / 64)

/* Values of all sizes, the extremes included, with plateaus of equal ones. */
static void fill(int16_t *values, int32_t n, int32_t threshold, int32_t lowest)
{
    for (int32_t i = 0; i < n; i++) {
        const int32_t kind = any(0, 7);

        values[i] = (int16_t)(kind == 0   ? any(lowest, 32767)
                              : kind == 1 ? any(threshold - 1, threshold)
                              : kind == 2 ? (lowest < 0 ? -any(threshold - 1, threshold) : 0)
                              : kind == 3 ? (any(0, 1) ? 32767 : lowest)
                              : kind == 4 && i > 0 ? values[i - 1]
                                                   : any(lowest < 0 ? -200 : 0, 200));
    }
}

static void test_counts_equal_the_reference(void)
{
    for (int round = 0; round < 300; round++) {
        int16_t values[MAX_VALUES];
        const int32_t n = any(0, MAX_VALUES);
        const int32_t threshold = round % 10 == 0 ? 32767 : any(1, 400);

        fill(values, n, threshold, -32767);
        for (int k = 0; k < n_features; k++)
            TEST_ASSERT_EQUAL_UINT32(shef_edge_kernels_c.count(values, n, threshold),
                                     shef_edge_pick(features[k])->count(values, n, threshold));
    }
}

static void test_long_rows_are_counted_to_the_end(void)
{
    const int32_t n = 3000000;
    int16_t *values = malloc((size_t)n * sizeof *values);

    TEST_ASSERT_NOT_NULL(values);
    for (int32_t i = 0; i < n; i++)
        values[i] = -7;
    for (int k = 0; k < n_features; k++) {
        TEST_ASSERT_EQUAL_UINT32(n, shef_edge_pick(features[k])->count(values, n, 7));
        TEST_ASSERT_EQUAL_UINT32(0, shef_edge_pick(features[k])->count(values, n, 8));
    }
    free(values);
}

static void test_bit_planes_equal_the_reference(void)
{
    int64_t n_minus = 0;

    for (int round = 0; round < 300; round++) {
        int16_t values[MAX_VALUES];
        uint64_t expected[3][MAX_WORDS];
        const int32_t n = any(1, MAX_VALUES);
        const size_t n_words = (size_t)(n + 63) / 64;
        const int32_t threshold = round % 10 == 0 ? 32767 : any(1, 400);

        fill(values, n, threshold, -32767);
        shef_edge_kernels_c.bits(expected[0], expected[1], values, n, threshold);
        shef_edge_kernels_c.bits(expected[2], NULL, values, n, threshold);
        for (size_t i = 0; i < n_words; i++) {
            TEST_ASSERT_EQUAL_HEX64(0, expected[0][i] & expected[1][i]);
            TEST_ASSERT_EQUAL_HEX64(expected[0][i] | expected[1][i], expected[2][i]);
            n_minus += __builtin_popcountll(expected[1][i]);
        }
        for (int k = 0; k < n_features; k++) {
            uint64_t actual[3][MAX_WORDS];

            memset(actual, 0xff, sizeof actual);
            shef_edge_pick(features[k])->bits(actual[0], actual[1], values, n, threshold);
            shef_edge_pick(features[k])->bits(actual[2], NULL, values, n, threshold);
            for (int plane = 0; plane < 3; plane++)
                TEST_ASSERT_EQUAL_HEX64_ARRAY(expected[plane], actual[plane], n_words);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT64(10000, n_minus);
}

static void test_graded_edges_equal_the_reference_and_127_at_the_limit(void)
{
    for (int round = 0; round < 600; round++) {
        int16_t values[MAX_VALUES];
        int8_t expected[MAX_VALUES];
        const int32_t n = any(2, MAX_VALUES);
        const int32_t limit = round < 200 ? round + 1 : any(1, 32767);
        const struct shef_edge_scale scale = shef_edge_scale_of(limit);

        fill(values, n, limit < 32767 ? limit : 32766, -32767);
        values[0] = (int16_t)limit;
        values[1] = (int16_t)-limit;
        shef_edge_kernels_c.graded(expected, values, n, &scale);
        TEST_ASSERT_EQUAL_INT8(127, expected[0]);
        TEST_ASSERT_EQUAL_INT8(-127, expected[1]);
        for (int32_t i = 0; i < n; i++) {
            const double exact = fmax(-127, fmin(127, 127.0 * values[i] / limit));

            TEST_ASSERT_TRUE(fabs(expected[i] - exact) <= .52);
        }
        for (int k = 0; k < n_features; k++) {
            int8_t actual[MAX_VALUES + 1];

            actual[n] = 77;
            shef_edge_pick(features[k])->graded(actual, values, n, &scale);
            TEST_ASSERT_EQUAL_INT8_ARRAY(expected, actual, n);
            TEST_ASSERT_EQUAL_INT8(77, actual[n]);
        }
    }
}

static void test_ridges_equal_the_reference(void)
{
    int64_t n_ridges = 0;

    for (int round = 0; round < 300; round++) {
        static int16_t buffers[3][MAX_VALUES + 2];
        const int16_t *const rows[3] = { buffers[0] + 1, buffers[1] + 1, buffers[2] + 1 };
        uint64_t expected[MAX_WORDS];
        const int32_t n = any(1, MAX_VALUES);
        const size_t n_words = (size_t)(n + 63) / 64;
        const int32_t threshold = any(1, 200);

        for (int r = 0; r < 3; r++)
            fill(buffers[r], MAX_VALUES + 2, threshold, 0);
        shef_edge_kernels_c.ridges(expected, rows, n, threshold);
        for (size_t i = 0; i < n_words; i++)
            n_ridges += __builtin_popcountll(expected[i]);
        for (int k = 0; k < n_features; k++) {
            uint64_t actual[MAX_WORDS];

            memset(actual, 0xff, sizeof actual);
            shef_edge_pick(features[k])->ridges(actual, rows, n, threshold);
            TEST_ASSERT_EQUAL_HEX64_ARRAY(expected, actual, n_words);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT64(1000, n_ridges);
}

static void test_a_ridge_is_one_pixel_across_in_each_direction(void)
{
    /* Ridges 3 wide with their crest at column 4: upright, level, and both diagonals. */
    for (int direction = 0; direction < 4; direction++) {
        int16_t image[9][11] = { 0 };
        int n_found = 0;

        for (int y = 0; y < 9; y++)
            for (int x = 0; x < 11; x++) {
                const int off = direction == 0   ? x - 5
                                : direction == 1 ? y - 4
                                : direction == 2 ? x - y - 1
                                                 : x + y - 9;

                image[y][x] = (int16_t)(off == 0 ? 300 : abs(off) == 1 ? 200 : 0);
            }
        for (int y = 1; y < 8; y++) {
            const int16_t *const rows[3] = { image[y - 1] + 1, image[y] + 1, image[y + 1] + 1 };
            uint64_t bits;

            shef_edge_kernels_c.ridges(&bits, rows, 9, 100);
            for (int x = 1; x < 10; x++)
                if (bits >> (x - 1) & 1) {
                    TEST_ASSERT_EQUAL_INT16(300, image[y][x]);
                    n_found++;
                }
        }
        TEST_ASSERT_GREATER_OR_EQUAL_INT(7, n_found);
    }
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]), shef_edge_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_counts_equal_the_reference);
    RUN_TEST(test_long_rows_are_counted_to_the_end);
    RUN_TEST(test_bit_planes_equal_the_reference);
    RUN_TEST(test_graded_edges_equal_the_reference_and_127_at_the_limit);
    RUN_TEST(test_ridges_equal_the_reference);
    RUN_TEST(test_a_ridge_is_one_pixel_across_in_each_direction);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
