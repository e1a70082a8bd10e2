/* The readable kernels of the robust matcher, by hand; check_match.c holds the others to them. */
#include "pipeline/kernels/match.h"

#include <string.h>

#include "support/support.h"

/* Two cells of three levels, window of one cell. */
static void test_costs_scale_the_window_sum_and_stop_at_perfect_and_opposed(void)
{
    enum { LANES = 16, CELLS = 2 };
    int16_t columns[(CELLS + 1) * LANES] = { 0 };
    uint16_t costs[CELLS * LANES];
    /* Cell 1 reads right values one pair further left than cell 0. */
    const int16_t right_sum[LANES + 1] = { 0 };
    int16_t right_gain[LANES + 1];
    const int16_t left_mean[CELLS] = { 0, 0 };
    const int16_t left_gain[CELLS] = { INT16_MAX, INT16_MAX };
    const struct shef_match_row row = {
        .columns = columns + LANES,
        .n_cells = CELLS,
        .n_lanes = LANES,
        .n_levels = 3,
        .pairs_per_cell = 1,
        .scale = { .shift = 4, .gain_shift = 3, .unit = 16384 },
        .left_mean = left_mean,
        .left_gain = left_gain,
        .right_sum = right_sum + 1,
        .right_gain = right_gain + 1,
        .step = 32,
    };

    for (int k = 0; k <= LANES; k++)
        right_gain[k] = INT16_MAX;
    columns[LANES + 0] = 5;       /* 5 * 2^4 * 2^3 / 2 = 320 less the rounding of Q15 */
    columns[LANES + 1] = -5;      /* opposed */
    columns[2 * LANES + 2] = 100; /* more than perfect: clamped */
    shef_match_kernels_c.costs(costs, &row);
    TEST_ASSERT_UINT16_WITHIN(1, SHEF_MATCH_COST_ONE - 320, costs[0]);
    TEST_ASSERT_UINT16_WITHIN(1, SHEF_MATCH_COST_ONE + 320, costs[1]);
    TEST_ASSERT_EQUAL_UINT16(SHEF_MATCH_COST_ONE, costs[2]);
    TEST_ASSERT_EQUAL_UINT16(SHEF_MATCH_NO_LEVEL, costs[3]);
    TEST_ASSERT_EQUAL_UINT16(SHEF_MATCH_COST_ONE, costs[LANES]);
    TEST_ASSERT_EQUAL_UINT16(0, costs[LANES + 2]);
}

/* Three levels: staying is free, one level costs p1, anything more p2. The first step's costs are
 * what the second one starts from. */
static void test_a_path_stays_for_nothing_steps_for_p1_and_jumps_for_p2(void)
{
    enum { LANES = 16 };
    uint16_t costs[2 * LANES];
    uint16_t sums[2 * LANES];
    uint16_t state[2][LANES];

    for (int k = 0; k < 2 * LANES; k++) {
        costs[k] = SHEF_MATCH_NO_LEVEL;
        sums[k] = 1000;
    }
    memcpy(costs, (uint16_t[]){ 100, 900, 900 }, 3 * sizeof *costs);
    memcpy(costs + LANES, (uint16_t[]){ 50, 60, 70 }, 3 * sizeof *costs);
    shef_match_kernels_c.path(&(struct shef_match_path){
        .costs = costs,
        .addend = { sums },
        .sums = sums,
        .cell_stride = 2 * LANES,
        .step = LANES,
        .sums_step = LANES,
        .state = { state[0], state[1] },
        .n_cells = 1,
        .n_steps = 2,
        .n_lanes = LANES,
        .p1 = 10,
        .p2 = 300,
    });
    TEST_ASSERT_EQUAL_UINT16(1000 + 900, sums[1]);              /* nothing was paid before */
    TEST_ASSERT_EQUAL_UINT16(1000 + 50, sums[LANES]);           /* stays */
    TEST_ASSERT_EQUAL_UINT16(1000 + 60 + 10, sums[LANES + 1]);  /* from level 0 by one */
    TEST_ASSERT_EQUAL_UINT16(1000 + 70 + 300, sums[LANES + 2]); /* from level 0 by two */
}

static void test_the_winner_knows_its_neighbours_and_its_margin_over_the_rest(void)
{
    enum { LANES = 16, LEVELS = 8 };
    const uint16_t sums[LANES] = { 900,   40,    30,    50,    35,    700,   600,   800,
                                   60000, 60000, 60000, 60000, 60000, 60000, 60000, 60000 };
    struct shef_match_best best;

    shef_match_kernels_c.winner(&best, sums, 1, LANES, LEVELS);
    TEST_ASSERT_EQUAL_UINT16(2, best.level);
    TEST_ASSERT_EQUAL_UINT16(30, best.sum);
    TEST_ASSERT_EQUAL_UINT16(40, best.below);
    TEST_ASSERT_EQUAL_UINT16(50, best.above);
    TEST_ASSERT_EQUAL_UINT16(600 - 30, best.margin); /* levels 0..4 are too near */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_costs_scale_the_window_sum_and_stop_at_perfect_and_opposed);
    RUN_TEST(test_a_path_stays_for_nothing_steps_for_p1_and_jumps_for_p2);
    RUN_TEST(test_the_winner_knows_its_neighbours_and_its_margin_over_the_rest);
    return UNITY_END();
}
