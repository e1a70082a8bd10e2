/* The robust matcher's row loops, which compilers vectorise, in every instruction set: the same
 * bits, floating point included. */
#include "pipeline/kernels/rows.h"

#include <stdlib.h>
#include <string.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"

#define N_CASES     200
#define MOST_VALUES 400
#define MAX_BUFFERS 24

static struct shef_test_random draws;
static void *buffers[MAX_BUFFERS];
static int n_buffers;

void tearDown(void)
{
    while (n_buffers > 0)
        free(buffers[--n_buffers]);
}

/* Memory of exactly this size, so that the address sanitizer sees what runs beyond. */
static void *take(size_t n_bytes)
{
    void *memory = malloc(n_bytes);

    TEST_ASSERT_NOT_NULL(memory);
    TEST_ASSERT_LESS_THAN_INT(MAX_BUFFERS, n_buffers);
    buffers[n_buffers++] = memory;
    return memory;
}

static void *take_copy(const void *from, size_t n_bytes)
{
    return memcpy(take(n_bytes), from, n_bytes);
}

static int32_t pick(int32_t first, int32_t last)
{
    return shef_test_random_range(&draws, first, last);
}

static float *take_floats(int32_t n, double low, double high)
{
    float *values = take((size_t)n * sizeof *values);

    for (int32_t i = 0; i < n; i++)
        values[i] = (float)(low + (high - low) * shef_test_random_unit(&draws));
    return values;
}

typedef void check_fn(const struct shef_row_kernels *reference,
                      const struct shef_row_kernels *tested);

static void for_each_isa(check_fn *check)
{
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    if (n_isas == 1)
        TEST_IGNORE_MESSAGE("this processor has none of the instruction sets: C is all it runs");
    draws = shef_test_random_start();
    for (int isa = 1; isa < n_isas; isa++)
        for (int i = 0; i < N_CASES; i++) {
            check(shef_rows_pick(SHEF_CPU_NONE), shef_rows_pick(isas[isa]));
            tearDown();
        }
}

static void test_pick_gives_the_best_set_that_the_features_allow(void)
{
    TEST_ASSERT_EQUAL_PTR(&shef_row_kernels_c, shef_rows_pick(SHEF_CPU_NONE));
#if defined(__x86_64__)
    TEST_ASSERT_EQUAL_PTR(&shef_row_kernels_avx2, shef_rows_pick(SHEF_CPU_AVX2));
    TEST_ASSERT_EQUAL_PTR(&shef_row_kernels_avx512,
                          shef_rows_pick(SHEF_CPU_AVX2 | SHEF_CPU_AVX512));
#endif
}

/* Bytes of values -15..15, as left (offset) or right (plain) pairs. */
static const uint8_t *take_row(int32_t n_pairs, int32_t offset, int32_t largest)
{
    uint8_t *row = take((size_t)n_pairs * 2);

    for (int32_t i = 0; i < 2 * n_pairs; i++)
        row[i] = (uint8_t)(offset + pick(-largest, largest));
    return row;
}

static void check_slides(const struct shef_row_kernels *reference,
                         const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const int32_t largest = pick(0, 15);
    const int32_t offset = pick(0, 1) * largest;
    const uint8_t *const in[2] = { take_row(n, offset, largest), take_row(n, offset, largest) };
    const uint8_t *const out[2] = { take_row(n, offset, largest), take_row(n, offset, largest) };
    int16_t *expected = take((size_t)n * sizeof *expected);

    for (int32_t i = 0; i < n; i++)
        expected[i] = (int16_t)pick(-20000, 20000);

    int16_t *actual = take_copy(expected, (size_t)n * sizeof *expected);

    reference->slide_values(in, out, n, offset, expected);
    tested->slide_values(in, out, n, offset, actual);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n);
    reference->slide_squares(in, out, n, offset, expected);
    tested->slide_squares(in, out, n, offset, actual);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n);
}

static void test_sliding_sums_are_the_same(void)
{
    for_each_isa(check_slides);
}

/* The definition: every column of a window that is there. */
static void check_window_sums(const struct shef_row_kernels *reference,
                              const struct shef_row_kernels *tested)
{
    const int32_t n_columns = pick(1, MOST_VALUES);
    const int32_t n = pick(1, n_columns);
    const int32_t half_width = pick(0, 15);
    const int32_t spacing = pick(1, 2);
    int16_t *column = take((size_t)n_columns * sizeof *column);
    int32_t *sums[2] = { take((size_t)n * sizeof(int32_t)), take((size_t)n * sizeof(int32_t)) };

    for (int32_t i = 0; i < n_columns; i++)
        column[i] = (int16_t)pick(-32768, 32767);
    reference->window_sums(column, n_columns, half_width, spacing, n, sums[0]);
    tested->window_sums(column, n_columns, half_width, spacing, n, sums[1]);
    for (int32_t i = 0; i < n; i++) {
        int32_t sum = 0;

        for (int32_t j = i - half_width * spacing; j <= i + half_width * spacing; j += spacing)
            sum += j >= 0 && j < n_columns ? column[j] : 0;
        TEST_ASSERT_EQUAL_INT32(sum, sums[0][i]);
        TEST_ASSERT_EQUAL_INT32(sum, sums[1][i]);
    }
}

static void test_window_sums_hold_the_columns_that_are_there(void)
{
    for_each_isa(check_window_sums);
}

static void check_mirrors(const struct shef_row_kernels *reference,
                          const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const int32_t step = pick(1, 2);
    const int32_t last = (n - 1) * step; /* where the first pair begins */
    const uint8_t *row = take_row((last + 1) / 2 + 1, 0, 127);
    uint16_t *pairs[2] = { take((size_t)n * 2), take((size_t)n * 2) };

    reference->mirror_pairs((const int8_t *)row + last, step, n, pairs[0]);
    tested->mirror_pairs((const int8_t *)row + last, step, n, pairs[1]);
    for (int32_t i = 0; i < n; i++)
        TEST_ASSERT_EQUAL_UINT16(row[last - i * step] | row[last - i * step + 1] << 8, pairs[0][i]);
    TEST_ASSERT_EQUAL_UINT16_ARRAY(pairs[0], pairs[1], n);
}

static void test_mirrored_pairs_are_the_same(void)
{
    for_each_isa(check_mirrors);
}

static void check_depth(const struct shef_row_kernels *reference,
                        const struct shef_row_kernels *tested)
{
    const struct shef_depth_terms terms = { .fb = 36.3f, .angle_px = 0.2f, .shared = 1e-5f };
    const int32_t n = pick(1, MOST_VALUES);
    const size_t n_bytes = (size_t)n * sizeof(float);
    const float *confidence = take_floats(n, 0.0, 1.0);
    float *disparity = take_floats(n, -10.0, 80.0);
    float *depth[2] = { take(n_bytes), take(n_bytes) };
    float *sigma[2] = { take(n_bytes), take(n_bytes) };

    for (int32_t i = 0; i < n; i++)
        disparity[i] *= (float)pick(0, 1);
    reference->depth(&terms, disparity, confidence, n, depth[0], sigma[0]);
    tested->depth(&terms, disparity, confidence, n, depth[1], sigma[1]);
    TEST_ASSERT_EQUAL_MEMORY(depth[0], depth[1], n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(sigma[0], sigma[1], n_bytes);
    for (int32_t i = 0; i < n; i++) {
        TEST_ASSERT_EQUAL(disparity[i] > 0, depth[0][i] > 0);
        TEST_ASSERT_EQUAL(disparity[i] > 0, sigma[0][i] > 0);
    }
}

static void test_depth_and_sigma_are_the_same(void)
{
    for_each_isa(check_depth);
}

static void check_gains(const struct shef_row_kernels *reference,
                        const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const int32_t window_px = 4 * pick(1, 961);
    const float floor2 = (float)(window_px * (0.005 + 0.495 * shef_test_random_unit(&draws)));
    int32_t *sum = take((size_t)n * sizeof *sum);
    int32_t *square = take((size_t)n * sizeof *square);
    int16_t *expected = take((size_t)n * sizeof *expected);
    int16_t *actual = take((size_t)n * sizeof *actual);

    for (int32_t i = 0; i < n; i++) {
        /* Also what no window has: a variance below zero counts as none. */
        square[i] = pick(0, window_px);
        sum[i] = pick(-square[i], square[i]);
    }
    reference->gains(sum, square, n, 1.0f / (float)window_px, floor2, expected);
    tested->gains(sum, square, n, 1.0f / (float)window_px, floor2, actual);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n);
}

static void test_gains_are_the_same(void)
{
    for_each_isa(check_gains);
}

/* A row of cells from -1 to n. */
static struct shef_cell_row take_cells(int32_t n)
{
    return (struct shef_cell_row){
        .disparity = take_floats(n + 2, 32.0, 40.0 * 32.0) + 1,
        .weight = take_floats(n + 2, 1.0, 40000.0) + 1,
        .confidence = take_floats(n + 2, 0.0, 1.0) + 1,
    };
}

static void check_side(const struct shef_row_kernels *reference,
                       const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const size_t n_bytes = (size_t)n * sizeof(float);
    const int32_t side = pick(0, 1) ? 1 : -1;
    const struct shef_cell_row near_row = take_cells(n);
    const struct shef_cell_row far_row = take_cells(n);
    /* Wide enough that some cells stay in and some out. */
    const float same_surface = 300.0f;
    float *disparity[2] = { take(n_bytes), take(n_bytes) };
    float *confidence[2] = { take(n_bytes), take(n_bytes) };

    reference->side(&near_row, &far_row, side, n, same_surface, disparity[0], confidence[0]);
    tested->side(&near_row, &far_row, side, n, same_surface, disparity[1], confidence[1]);
    TEST_ASSERT_EQUAL_MEMORY(disparity[0], disparity[1], n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(confidence[0], confidence[1], n_bytes);
}

static void test_pixels_between_cells_are_the_same(void)
{
    for_each_isa(check_side);
}

static void check_read_out(const struct shef_row_kernels *reference,
                           const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const size_t n_bytes = (size_t)n * sizeof(float);
    const float *even = take_floats(n, 0.0, 80.0);
    const float *odd = take_floats(n, 0.0, 80.0);
    const float *bias = take_floats(n, -10.0, 50.0);
    float *pixels[2] = { take(2 * n_bytes), take(2 * n_bytes) };
    float *disparity[2] = { take_copy(even, n_bytes), take_copy(even, n_bytes) };
    float *confidence[2] = { take_copy(odd, n_bytes), take_copy(odd, n_bytes) };
    int8_t *left = take((size_t)n);

    for (int32_t i = 0; i < n; i++)
        left[i] = (int8_t)(pick(0, 1) * pick(-15, 15));
    reference->interleave(even, odd, n, pixels[0]);
    tested->interleave(even, odd, n, pixels[1]);
    TEST_ASSERT_EQUAL_MEMORY(pixels[0], pixels[1], 2 * n_bytes);
    reference->take_off_bias(bias, n, disparity[0], confidence[0]);
    tested->take_off_bias(bias, n, disparity[1], confidence[1]);
    TEST_ASSERT_EQUAL_MEMORY(disparity[0], disparity[1], n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(confidence[0], confidence[1], n_bytes);
    reference->keep_edges(left, even, n, pixels[0]);
    tested->keep_edges(left, even, n, pixels[1]);
    TEST_ASSERT_EQUAL_MEMORY(pixels[0], pixels[1], n_bytes);
}

static void test_the_read_out_is_the_same(void)
{
    for_each_isa(check_read_out);
}

static void check_jumps(const struct shef_row_kernels *reference,
                        const struct shef_row_kernels *tested)
{
    const int32_t n = pick(1, MOST_VALUES);
    const float *lines[4];
    uint8_t *marks[2] = { take((size_t)n), take((size_t)n) };

    for (int i = 0; i < 4; i++) {
        float *line = take_floats(n, 0.0, 4.0);

        /* Whole numbers now and then, so that steps are equal. */
        for (int32_t x = 0; x < n; x++)
            line[x] = pick(0, 1) ? (float)(int32_t)line[x] : line[x];
        lines[i] = line;
    }
    reference->find_jumps(lines, n, 1.0f, marks[0]);
    tested->find_jumps(lines, n, 1.0f, marks[1]);
    TEST_ASSERT_EQUAL_MEMORY(marks[0], marks[1], (size_t)n);
}

static void test_jumps_are_the_same(void)
{
    for_each_isa(check_jumps);
}

/* Of three jumps, the middle one is where disparity changes most; of two equal steps, the first. */
static void test_a_jump_is_where_disparity_changes_most(void)
{
    const float row[] = { 5.0f, 5.0f, 5.25f, 9.0f, 9.25f, 9.25f, 9.25f, 8.0f, 6.75f, 6.75f, 6.75f };
    const float *const lines[4] = { row, row + 1, row + 2, row + 3 };
    const uint8_t expected[8] = { 0, 1, 0, 0, 0, 1, 0, 0 };
    uint8_t marks[8];

    shef_row_kernels_c.find_jumps(lines, 8, 0.8f, marks);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, marks, 8);
}

/* Largest values included. */
static int8_t *take_map(int32_t n)
{
    int8_t *values = take((size_t)n);

    for (int32_t i = 0; i < n; i++)
        values[i] = (int8_t)(pick(0, 3) ? pick(-15, 15) : pick(0, 1) ? 15 : -15);
    return values;
}

static void check_evidence(const struct shef_row_kernels *reference,
                           const struct shef_row_kernels *tested)
{
    enum { N = SHEF_ROWS_EVIDENCE_PX, FINE = SHEF_ROWS_EVIDENCE_FINE };
    const int32_t n_rows = pick(1, 8);
    const ptrdiff_t row_step = pick(0, 1) ? N : 0;
    const ptrdiff_t stride = N + 1 + pick(0, 20);
    const int8_t *left = take_map((int32_t)(stride * n_rows));
    const int8_t *right = take_map((int32_t)(stride * n_rows));
    struct shef_rows_patch patch = {
        .left = left,
        .left_stride = stride,
        .right_stride = stride,
        .n_rows = n_rows,
    };
    const size_t n_bytes = (size_t)(N * n_rows) * sizeof(int32_t);
    int32_t *expected = memset(take(n_bytes), 0, n_bytes);
    int32_t *actual = memset(take(n_bytes), 0, n_bytes);

    for (int i = 0; i < 2; i++) {
        const int32_t fraction = pick(0, FINE - 1);

        patch.at[i] = right + pick(1, (int32_t)stride - N);
        patch.weight[i][0] = (int16_t)(FINE - fraction);
        patch.weight[i][1] = (int16_t)fraction;
    }
    reference->evidence(&patch, row_step, expected);
    tested->evidence(&patch, row_step, actual);
    TEST_ASSERT_EQUAL_MEMORY(expected, actual, n_bytes);
}

static void test_evidence_is_the_same(void)
{
    for_each_isa(check_evidence);
}

/* By hand: left 2; right 3 at the first disparity, between 15 and -1 at the second. */
static void test_evidence_is_half_the_difference_of_squared_differences(void)
{
    enum { N = SHEF_ROWS_EVIDENCE_PX, FINE = SHEF_ROWS_EVIDENCE_FINE };
    int8_t left[N];
    int8_t first[N + 1];
    int8_t second[N + 1];
    int32_t sum[N] = { 0 };
    const struct shef_rows_patch patch = {
        .left = left,
        .at = { first + 1, second + 1 },
        .weight = { { FINE, 0 }, { FINE / 2, FINE / 2 } },
        .n_rows = 1,
    };

    memset(left, 2, sizeof left);
    memset(first, 3, sizeof first);
    for (int i = 0; i <= N; i++)
        second[i] = i % 2 ? 15 : -1;
    shef_row_kernels_c.evidence(&patch, 0, sum);
    /* (2 - 7)^2 = 25 against (2 - 3)^2 = 1. */
    for (int i = 0; i < N; i++)
        TEST_ASSERT_EQUAL_INT32((25 - 1) * FINE * FINE, sum[i]);
}

/* By hand: an edge pixel a quarter of a cell left of its cell's centre. */
static void test_a_pixel_is_the_mean_of_the_cells_on_its_surface(void)
{
    /* Cells -1, 0 and 1; the last lies on another surface, 10 px nearer, and is the side's only
     * for right-hand pixels. */
    float near_disparity[] = { 320.0f, 352.0f, 672.0f };
    float far_disparity[] = { 320.0f, 352.0f, 672.0f };
    float weight[] = { 3.0f, 1.0f, 1.0f };
    float confidence[] = { 0.25f, 0.5f, 0.75f };
    const struct shef_cell_row near_row = { near_disparity + 1, weight + 1, confidence + 1 };
    const struct shef_cell_row far_row = { far_disparity + 1, weight + 1, confidence + 1 };
    float disparity;
    float p;

    /* Left: weights 9, 9, 3, 3 on 11, 10, 11 and 10 px. */
    shef_row_kernels_c.side(&near_row, &far_row, -1, 1, 128.0f, &disparity, &p);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 10.5f, disparity);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, p); /* of the first of the heaviest */
    /* Right: the neighbours are 10 px away and stay out. */
    shef_row_kernels_c.side(&near_row, &far_row, 1, 1, 128.0f, &disparity, &p);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 11.0f, disparity);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, p);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_pick_gives_the_best_set_that_the_features_allow);
    RUN_TEST(test_sliding_sums_are_the_same);
    RUN_TEST(test_window_sums_hold_the_columns_that_are_there);
    RUN_TEST(test_mirrored_pairs_are_the_same);
    RUN_TEST(test_depth_and_sigma_are_the_same);
    RUN_TEST(test_gains_are_the_same);
    RUN_TEST(test_pixels_between_cells_are_the_same);
    RUN_TEST(test_the_read_out_is_the_same);
    RUN_TEST(test_jumps_are_the_same);
    RUN_TEST(test_a_jump_is_where_disparity_changes_most);
    RUN_TEST(test_evidence_is_the_same);
    RUN_TEST(test_evidence_is_half_the_difference_of_squared_differences);
    RUN_TEST(test_a_pixel_is_the_mean_of_the_cells_on_its_surface);
    return UNITY_END();
}
