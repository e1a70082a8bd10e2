/* Every instruction set's kernels of the robust matcher against the readable C ones, bit for bit.
 *
 * All buffers have exactly the size that kernels/match.h states, so that the address sanitizer
 * sees a kernel that reads or writes beyond. */
#include "pipeline/kernels/match.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "support/support.h"

#define N_CASES     400
#define MOST_LANES  272 /* 256 levels and the lanes that end them */
#define MOST_CELLS  40
#define MAX_BUFFERS 32

/* How the numbers of a case are drawn. */
enum extreme {
    EXTREME_NONE, /* anything in range */
    EXTREME_LOW,  /* each number the lowest of its range */
    EXTREME_HIGH, /* each the highest: all-bright windows, saturated sums */
    EXTREME_MIX,  /* each one of the two */
    N_EXTREMES,
};

static struct shef_test_random draws;
static enum extreme extreme;
static void *buffers[MAX_BUFFERS];
static int n_buffers;

void tearDown(void)
{
    while (n_buffers > 0)
        free(buffers[--n_buffers]);
}

/* Memory of exactly this size, until the end of the case. */
static void *take(size_t n_items, size_t item_bytes)
{
    void *memory = malloc(n_items * item_bytes);

    TEST_ASSERT_NOT_NULL(memory);
    TEST_ASSERT_LESS_THAN_INT(MAX_BUFFERS, n_buffers);
    buffers[n_buffers++] = memory;
    return memory;
}

static int32_t pick(int32_t first, int32_t last)
{
    switch (extreme) {
    case EXTREME_LOW:
        return first;
    case EXTREME_HIGH:
        return last;
    case EXTREME_MIX:
        return shef_test_random_range(&draws, 0, 1) ? first : last;
    default:
        return shef_test_random_range(&draws, first, last);
    }
}

static void *take_values(size_t n_items, int32_t first, int32_t last)
{
    uint16_t *values = take(n_items, sizeof *values);

    for (size_t i = 0; i < n_items; i++)
        values[i] = (uint16_t)pick(first, last);
    return values;
}

static void *take_copy(const void *from, size_t n_bytes)
{
    return memcpy(take(n_bytes, 1), from, n_bytes);
}

/* 48 lanes, which runs live, in every fourth case. */
static int32_t pick_lanes(void)
{
    return SHEF_MATCH_LANE_MULTIPLE *
           (shef_test_random_range(&draws, 0, 3)
                ? shef_test_random_range(&draws, 1, MOST_LANES / SHEF_MATCH_LANE_MULTIPLE)
                : 3);
}

/* At least one lane ends the levels, at most a whole multiple. */
static int32_t pick_levels(int32_t n_lanes)
{
    const int32_t fewest = n_lanes == SHEF_MATCH_LANE_MULTIPLE ? 8 : n_lanes - 16;

    return shef_test_random_range(&draws, fewest, n_lanes - 1);
}

typedef void check_fn(const struct shef_match_kernels *tested);

/* Runs the check for every instruction set but C that this processor has. */
static void for_each_isa(check_fn *check)
{
    static const char *const names[] = { "avx2", "avx512", "neon" };

    if (shef_cpu_features() == SHEF_CPU_NONE)
        TEST_IGNORE_MESSAGE("this processor has none of the instruction sets: C is all it runs");
    draws = shef_test_random_start();
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const uint32_t features = shef_cpu_features_of(names[i]);

        if ((features & shef_cpu_features()) != features)
            continue;

        const struct shef_match_kernels *tested = shef_match_pick(features);

        TEST_ASSERT_EQUAL_STRING(names[i], tested->isa);
        printf("checked: %s\n", tested->isa);
        for (int n = 0; n < N_CASES; n++) {
            extreme = n % 3 ? EXTREME_NONE : (enum extreme)(n / 3 % N_EXTREMES);
            check(tested);
            tearDown();
        }
    }
}

static void test_pick_gives_the_best_set_that_the_features_allow(void)
{
    TEST_ASSERT_EQUAL_PTR(&shef_match_kernels_c, shef_match_pick(SHEF_CPU_NONE));
#if defined(__x86_64__)
    TEST_ASSERT_EQUAL_PTR(&shef_match_kernels_avx2, shef_match_pick(SHEF_CPU_AVX2));
    TEST_ASSERT_EQUAL_PTR(&shef_match_kernels_avx512,
                          shef_match_pick(SHEF_CPU_AVX2 | SHEF_CPU_AVX512));
#elif defined(__aarch64__)
    TEST_ASSERT_EQUAL_PTR(&shef_match_kernels_neon, shef_match_pick(SHEF_CPU_NEON));
#endif
}

/* A row of pairs: bytes of the range, two to a pair. */
static uint16_t *take_pairs(size_t n_pairs, int32_t first, int32_t last)
{
    uint16_t *pairs = take(n_pairs, sizeof *pairs);

    for (size_t i = 0; i < n_pairs; i++)
        pairs[i] = (uint16_t)((pick(first, last) & 0xff) | (pick(first, last) & 0xff) << 8);
    return pairs;
}

/* Left values of up to 127: the largest whose products' sums fit 16 bits. */
static struct shef_match_rows take_rows(int32_t n_cells, int32_t pairs_per_cell, int32_t n_lanes)
{
    const int32_t before = (n_cells - 1) * pairs_per_cell;
    struct shef_match_rows rows;

    for (int i = 0; i < 2; i++) {
        rows.left[i] = take_pairs((size_t)n_cells, 0, 127);
        rows.right[i] = take_pairs((size_t)(before + n_lanes), -128, 127) + before;
    }
    return rows;
}

static void check_columns(const struct shef_match_kernels *tested)
{
    const int32_t n_cells = shef_test_random_range(&draws, 1, MOST_CELLS);
    const int32_t n_lanes = pick_lanes();
    const int32_t pairs_per_cell = shef_test_random_range(&draws, 1, 2);
    const size_t n_values = (size_t)(n_cells * n_lanes);
    const struct shef_match_rows entering = take_rows(n_cells, pairs_per_cell, n_lanes);
    const struct shef_match_rows leaving = take_rows(n_cells, pairs_per_cell, n_lanes);
    int16_t *expected = take_values(n_values, INT16_MIN, INT16_MAX);
    int16_t *actual = take_copy(expected, n_values * sizeof *expected);

    shef_match_kernels_c.columns(expected, &entering, &leaving, n_cells, pairs_per_cell, n_lanes);
    tested->columns(actual, &entering, &leaving, n_cells, pairs_per_cell, n_lanes);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected, actual, n_values);
}

static void test_columns_are_the_same_in_every_instruction_set(void)
{
    for_each_isa(check_columns);
}

/* A row of cells with every option at random. Sums wrap at 16 bits, so they may be anything;
 * the factors are Q15. */
static struct shef_match_row take_row(void)
{
    const int32_t n_cells = shef_test_random_range(&draws, 1, MOST_CELLS);
    const int32_t n_lanes = pick_lanes();
    const int32_t half_width = shef_test_random_range(&draws, 0, 15);
    const int32_t pairs_per_cell = shef_test_random_range(&draws, 1, 2);
    const int32_t before = (n_cells - 1) * pairs_per_cell;
    const size_t n_right = (size_t)(before + n_lanes);
    const size_t n_columns = (size_t)((n_cells + 2 * half_width + 1) * n_lanes);
    const int16_t *columns = take_values(n_columns, INT16_MIN, INT16_MAX);
    struct shef_match_row row = {
        .columns = columns + (ptrdiff_t)(half_width + 1) * n_lanes,
        .half_width_cells = half_width,
        .n_cells = n_cells,
        .n_lanes = n_lanes,
        .n_levels = pick_levels(n_lanes),
        .pairs_per_cell = pairs_per_cell,
        .scale = {
            .shift = (int16_t)pick(0, 14),
            .gain_shift = (int16_t)pick(0, 14),
            .unit = (int16_t)pick(1, INT16_MAX),
            .is_signed = (int16_t)shef_test_random_range(&draws, 0, 1),
        },
        .left_mean = take_values((size_t)n_cells, -INT16_MAX, INT16_MAX),
        .left_gain = take_values((size_t)n_cells, 0, INT16_MAX),
        .right_sum = (int16_t *)take_values(n_right, INT16_MIN, INT16_MAX) + before,
        .right_gain = (int16_t *)take_values(n_right, 0, INT16_MAX) + before,
        .is_second_pair = shef_test_random_range(&draws, 0, 1),
        .step = (int16_t)(32 / pairs_per_cell),
    };

    if (shef_test_random_range(&draws, 0, 1)) {
        row.expected = take_values((size_t)n_cells, 0, 256 * 16);
        row.weight = take_values((size_t)n_cells, 0, 64 * 32);
        row.prior_cap = (int16_t)pick(0, 31 * 16);
    }
    return row;
}

static void check_costs(const struct shef_match_kernels *tested)
{
    const struct shef_match_row row = take_row();
    const size_t n_values = (size_t)(row.n_cells * row.n_lanes);
    uint16_t *expected = take_values(n_values, 0, 2 * SHEF_MATCH_COST_ONE);
    uint16_t *actual = take_copy(expected, n_values * sizeof *expected);

    shef_match_kernels_c.costs(expected, &row);
    tested->costs(actual, &row);
    TEST_ASSERT_EQUAL_UINT16_ARRAY(expected, actual, n_values);
}

static void test_costs_are_the_same_in_every_instruction_set(void)
{
    for_each_isa(check_costs);
}

/* The largest cost of a level: opposed windows and the whole prior. */
#define MOST_COST (2 * SHEF_MATCH_COST_ONE + 31 * 64)

/* Numbers of n_cells cells, those of lanes without a level from first_none up. */
static uint16_t *take_volume(int32_t n_cells, ptrdiff_t stride, int32_t n_lanes, int32_t n_levels,
                             int32_t most, int32_t first_none, int32_t last_none)
{
    uint16_t *volume = take((size_t)((n_cells - 1) * stride + n_lanes), sizeof *volume);

    for (int32_t i = 0; i < n_cells; i++)
        for (int32_t k = 0; k < n_lanes; k++)
            volume[i * stride + k] =
                (uint16_t)(k < n_levels ? pick(0, most) : pick(first_none, last_none));
    return volume;
}

/* Rows of cells, as the horizontal paths see them, forwards or backwards, with nothing to add, with
 * the sums so far, or with those and another volume. */
static void check_path(const struct shef_match_kernels *tested)
{
    const int32_t n_cells = shef_test_random_range(&draws, 1, SHEF_MATCH_PATH_CELLS);
    const int32_t n_steps = shef_test_random_range(&draws, 1, 20);
    const int32_t n_lanes = pick_lanes();
    const int32_t n_levels = pick_levels(n_lanes);
    const int32_t p2 = pick(1, 4000);
    const int32_t n_addends = shef_test_random_range(&draws, 0, 2);
    const int is_backwards = shef_test_random_range(&draws, 0, 1);
    const size_t n_values = (size_t)(n_cells * n_steps * n_lanes);
    const ptrdiff_t first = is_backwards ? (ptrdiff_t)(n_steps - 1) * n_lanes : 0;
    uint16_t *sums = take(n_values, sizeof *sums);

    for (size_t i = 0; i < n_values; i++)
        sums[i] = (uint16_t)pick(0, UINT16_MAX);

    uint16_t *other_sums = take_copy(sums, n_values * sizeof *sums);
    const uint16_t *second = take_copy(sums, n_values * sizeof *sums);
    struct shef_match_path path = {
        .costs = take_volume(n_cells * n_steps, n_lanes, n_lanes, n_levels, MOST_COST,
                             SHEF_MATCH_NO_LEVEL, SHEF_MATCH_NO_LEVEL) +
                 first,
        .addend = { n_addends > 0 ? sums + first : NULL, n_addends > 1 ? second + first : NULL },
        .sums = sums + first,
        .cell_stride = (ptrdiff_t)n_steps * n_lanes,
        .step = is_backwards ? -n_lanes : n_lanes,
        .sums_step = is_backwards ? -n_lanes : n_lanes,
        .state = { take((size_t)(n_cells * n_lanes), sizeof(uint16_t)),
                   take((size_t)(n_cells * n_lanes), sizeof(uint16_t)) },
        .n_cells = n_cells,
        .n_steps = n_steps,
        .n_lanes = n_lanes,
        .p1 = (uint16_t)shef_test_random_range(&draws, 1, p2),
        .p2 = (uint16_t)p2,
    };

    shef_match_kernels_c.path(&path);
    path.sums = other_sums + first;
    if (n_addends > 0)
        path.addend[0] = path.sums;
    tested->path(&path);
    TEST_ASSERT_EQUAL_UINT16_ARRAY(sums, other_sums, n_values);
}

static void test_paths_are_the_same_in_every_instruction_set(void)
{
    for_each_isa(check_path);
}

/* Few different sums, so that several levels tie for the smallest one, or many. */
static void check_winner(const struct shef_match_kernels *tested)
{
    const int32_t n_cells = shef_test_random_range(&draws, 1, 16);
    const int32_t n_lanes = pick_lanes();
    const int32_t n_levels = pick_levels(n_lanes);
    const int32_t most = shef_test_random_range(&draws, 0, 1) ? 4 : 4 * (MOST_COST + 4000);
    const uint16_t *sums =
        take_volume(n_cells, n_lanes, n_lanes, n_levels, most, 4 * SHEF_MATCH_NO_LEVEL, UINT16_MAX);
    struct shef_match_best *expected = take((size_t)n_cells, sizeof *expected);
    struct shef_match_best *actual = take((size_t)n_cells, sizeof *actual);

    shef_match_kernels_c.winner(expected, sums, n_cells, n_lanes, n_levels);
    tested->winner(actual, sums, n_cells, n_lanes, n_levels);
    TEST_ASSERT_EQUAL_MEMORY(expected, actual, (size_t)n_cells * sizeof *expected);
}

static void test_winners_are_the_same_in_every_instruction_set(void)
{
    for_each_isa(check_winner);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_pick_gives_the_best_set_that_the_features_allow);
    RUN_TEST(test_columns_are_the_same_in_every_instruction_set);
    RUN_TEST(test_costs_are_the_same_in_every_instruction_set);
    RUN_TEST(test_paths_are_the_same_in_every_instruction_set);
    RUN_TEST(test_winners_are_the_same_in_every_instruction_set);
    return UNITY_END();
}
