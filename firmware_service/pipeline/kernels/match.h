/* The robust matcher's inner loops, one table of functions per instruction set.
 *
 * Vocabulary
 *   cell     a 2x2 block of pixels; the half grid has one value per cell
 *   level    a disparity candidate: level k stands for disparity (k + 1) * step_px
 *   lane     a level, padded to n_lanes: a multiple of SHEF_MATCH_LANE_MULTIPLE above the number
 *            of levels; lanes without a level cost SHEF_MATCH_NO_LEVEL and never win
 *   pair     two horizontally adjacent 8-bit edge values in one uint16, left one low
 *
 * All arithmetic is on 16-bit integers, so that every implementation is bit-exact with the C
 * reference. Volumes are [cell][lane]: lanes contiguous, cells n_lanes apart. */
#ifndef SHEF_PIPELINE_KERNELS_MATCH_H
#define SHEF_PIPELINE_KERNELS_MATCH_H

#include <stddef.h>
#include <stdint.h>

#define SHEF_MATCH_LANE_MULTIPLE 16
#define SHEF_MATCH_COST_ONE      500 /* cost of an uncorrelated window; perfect: 0, opposed: 1000 */
#define SHEF_MATCH_NO_LEVEL      12288 /* cost of a lane without a level */

/* What 16 bits rest on. A level's path cost is at most MAX_COST (its prior, 64 a px over 31 px,
 * included) + MAX_PENALTY. That of a lane without a level is never below NO_LEVEL - MAX_COST, which
 * is more, and never above NO_LEVEL + MAX_PENALTY, of which four still fit. */
#define SHEF_MATCH_MAX_PRIOR   (64 * 31)
#define SHEF_MATCH_MAX_COST    (2 * SHEF_MATCH_COST_ONE + SHEF_MATCH_MAX_PRIOR)
#define SHEF_MATCH_MAX_PENALTY 4000
_Static_assert(SHEF_MATCH_NO_LEVEL - SHEF_MATCH_MAX_COST >
                   SHEF_MATCH_MAX_COST + SHEF_MATCH_MAX_PENALTY,
               "a lane without a level never wins");
_Static_assert(SHEF_MATCH_NO_LEVEL > SHEF_MATCH_MAX_COST + SHEF_MATCH_MAX_PENALTY,
               "what lies outside a cell's lanes never wins");
_Static_assert(4 * (SHEF_MATCH_NO_LEVEL + SHEF_MATCH_MAX_PENALTY) <= UINT16_MAX,
               "four path costs fit a lane");

/* One grid row entering or leaving the window: two rows of pixels of both views. */
struct shef_match_rows {
    const uint16_t *left[2];  /* pairs, by cell; the low and high bytes are unsigned */
    const uint16_t *right[2]; /* pairs of signed bytes; cell g, level k: [k - g * pairs_per_cell] */
};

/* Adds the products of one entering grid row to the column sums and takes a leaving one off.
 *   columns  n_cells * n_lanes sums of left * right over the window's rows, modulo 2^16 */
typedef void shef_match_columns_fn(int16_t *columns, const struct shef_match_rows *entering,
                                   const struct shef_match_rows *leaving, int32_t n_cells,
                                   int32_t pairs_per_cell, int32_t n_lanes);

/* Fixed-point form of the normalised correlation z, in units that never leave int16:
 *   t    = (box << shift) - right_sum (signed kinds only: takes off the left values' offset)
 *   num  = t - mulhrs(left_mean, right_sum)
 *   z    = mulhrs(mulhrs(mulhrs(num, left_gain) << gain_shift, right_gain), unit)
 *   cost = COST_ONE - clamp(z, -COST_ONE, COST_ONE)
 * where mulhrs(a, b) = (a * b + 2^14) >> 15. */
struct shef_match_scale {
    int16_t shift;
    int16_t gain_shift;
    int16_t unit;
    int16_t is_signed;
};

/* What one row of cells is matched with. */
struct shef_match_row {
    const int16_t *columns;   /* column sums of cell 0; cells -(half_width + 1).. exist before it */
    int32_t half_width_cells; /* window = 2 * half_width + 1 cells */
    int32_t n_cells;
    int32_t n_lanes;
    int32_t n_levels;
    int32_t pairs_per_cell;
    struct shef_match_scale scale;
    const int16_t *left_mean;  /* Q15, by cell */
    const int16_t *left_gain;  /* Q15, by cell */
    const int16_t *right_sum;  /* cell g, level k: [k - g * pairs_per_cell] */
    const int16_t *right_gain; /* the same indexing, Q15 */
    int is_second_pair;        /* average with the cost already in the volume */
    /* Temporal prior: cost += weight * min(|level's disparity - expected|, cap). */
    const int16_t *expected; /* 1/16 px, by cell; NULL: no prior */
    const int16_t *weight;   /* cost per pixel of disparity * 32, by cell */
    int16_t prior_cap;       /* 1/16 px, at most 31 px */
    int16_t step;            /* 1/16 px between levels */
};

/* Window sums, normalisation, prior: the matching cost of one row of cells.
 *   costs  n_cells * n_lanes */
typedef void shef_match_costs_fn(uint16_t *costs, const struct shef_match_row *row);

/* Semi-global paths of n_cells independent cells, n_steps steps long. Each step:
 *   out[k] = cost[k] + min(prev[k], prev[k-1] + p1, prev[k+1] + p1, m + p2) - m, m = min(prev)
 *   sums[k] = out[k] + the addends
 * Before the first step nothing has been paid: prev = 0. Outside the cell's lanes prev is NO_LEVEL,
 * which is more than m + p2. Running several cells in step hides the
 * latency of each one's chain. */
struct shef_match_path {
    const uint16_t *costs;     /* of the first cell at the first step */
    const uint16_t *addend[2]; /* other paths' sums; NULL: none, the first before the second */
    uint16_t *sums;            /* may be the first addend itself */
    ptrdiff_t cell_stride;     /* lanes from one cell to the next: costs, addends and sums */
    ptrdiff_t step;            /* lanes from one step to the next: costs and the second addend */
    ptrdiff_t sums_step;       /* the same for sums and the first addend */
    uint16_t *state[2];        /* n_cells * n_lanes of path costs, their content does not matter */
    int32_t n_cells;           /* 1..SHEF_MATCH_PATH_CELLS */
    int32_t n_steps;
    int32_t n_lanes;
    uint16_t p1; /* 1..p2 */
    uint16_t p2; /* at most SHEF_MATCH_MAX_PENALTY */
};
#define SHEF_MATCH_PATH_CELLS 16
typedef void shef_match_path_fn(const struct shef_match_path *path);

/* The winner of each cell and what its neighbourhood in the volume looks like. */
struct shef_match_best {
    uint16_t level; /* of the smallest sum; the smallest such level */
    uint16_t sum;
    uint16_t below;  /* sum one level lower; NO_LEVEL * 4 at the end of the range */
    uint16_t above;  /* sum one level higher; likewise */
    uint16_t margin; /* smallest sum more than two levels away, minus sum */
};
typedef void shef_match_winner_fn(struct shef_match_best *out_best, const uint16_t *sums,
                                  int32_t n_cells, int32_t n_lanes, int32_t n_levels);

struct shef_match_kernels {
    const char *isa; /* "c", "avx2", "avx512", "neon" */
    uint32_t cpu_features;
    shef_match_columns_fn *columns;
    shef_match_costs_fn *costs;
    shef_match_path_fn *path;
    shef_match_winner_fn *winner;
};

/* The best table that these features (core/cpu.h) allow. Never NULL. */
const struct shef_match_kernels *shef_match_pick(uint32_t cpu_features);

extern const struct shef_match_kernels shef_match_kernels_c;
#if defined(__x86_64__)
extern const struct shef_match_kernels shef_match_kernels_avx2;
extern const struct shef_match_kernels shef_match_kernels_avx512;
#elif defined(__aarch64__)
extern const struct shef_match_kernels shef_match_kernels_neon;
#endif

#endif
