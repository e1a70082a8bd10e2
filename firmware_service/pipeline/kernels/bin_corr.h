/* Window correlation of two binary (or ternary) edge maps, and the disparity where it is largest.
 *
 * For a left pixel (x, y) and every d in d_min..d_max (Wang 2021, eq. 3 and 4)
 *
 *     s(x, y, d) = sum over |i|, |j| <= window_px / 2 of L(x+i, y+j) * E(x+i-d, y+j)
 *
 * with the window clipped at the left image's border and E = 0 outside its image. Values are 0
 * and 1 for unsigned maps; in a ternary map -1, 0 and 1, so that agreeing edges add and opposing
 * edges subtract. Unsigned and ternary maps may be mixed. The result is the d of the largest s and
 * s itself; of equal sums the smallest d wins. A pixel whose sums are all 0 therefore reads d_min
 * with sum 0: no evidence, which is for the caller to judge.
 *
 * Exact integers: every instruction set, every number of threads gives the same bits. |s| is at
 * most 127 * 127 = 16129.
 *
 * How. A byte per column x and disparity holds the sum down the window's rows; a row step adds
 * the entering row of event bytes to the columns that have a frame edge there and subtracts the
 * leaving row where one leaves. Along x a 16-bit running box adds the column that enters the window
 * and subtracts the one that leaves. So the cost does not depend on the window. Two neighbouring
 * disparities share a 16-bit lane a = s0 + 256 s1 (mod 2^16) beside a lane b = s1, fed by
 * b += (word difference + 128) >> 8, one multiply instruction: four operations per 64 disparities
 * instead of the six that widening takes, and s0 = a - 256 b at read-out only.
 *
 * Tile: 128, 80 or 64 disparities by one band of rows, the full width. At 640 columns and 80
 * disparities the column sums are 53 kB (window 21; 61 kB with 121): each row they stream once
 * through the first-level cache from the second, in order, which the prefetcher hides. Narrower
 * tiles would need window_px - 1 more columns each. Longer ranges take several passes, and a pass
 * costs its tile whether it fills it or not: 16 disparities cost as much as 64. The boxes of up to
 * 64 pixels are parked before the read-out picks their argmax, so that picking runs without
 * mispredicted branches and in 16 kB at most.
 *
 * Bands: the threads share the rows evenly, one band each. A band's start adds window_px - 1 rows
 * to its column sums, as much as that many half row steps of this part alone, so more and smaller
 * bands would not pay.
 *
 * Limit: 640x480, 80 disparities, 28 % edges take 0.75 ms on one Zen 5 core at 4.4 GHz (AVX-512),
 * that is 11 cycles a pixel: 4 for the running boxes (7 vector operations, 4 loads and 3 stores;
 * the stores, one of 512 bits a cycle, are what limits them), 3 for the column sums of 0.56
 * columns, 4 for 0.28 argmaxes. tests/pipeline/bench_paper.c measures. */
#ifndef SHEF_PIPELINE_KERNELS_BIN_CORR_H
#define SHEF_PIPELINE_KERNELS_BIN_CORR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "pipeline/edge_map.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_BIN_CORR_MAX_WINDOW_PX 127 /* a column sum fits a signed byte */
#define SHEF_BIN_CORR_MAX_DISPARITY 4095
#define SHEF_BIN_CORR_NONE          (-1) /* disparity of a pixel that was not read out */

struct shef_bin_corr_params {
    int32_t width_px;  /* 1..SHEF_IMAGE_MAX_SIDE_PX */
    int32_t height_px; /* the same */
    int32_t window_px; /* side, odd, 1..SHEF_BIN_CORR_MAX_WINDOW_PX; may exceed the image */
    int32_t d_min;     /* px, 0..d_max */
    int32_t d_max;     /* px, included; at most SHEF_BIN_CORR_MAX_DISPARITY */
    bool everywhere;   /* read out every pixel; else the left map's edges only */
};

struct shef_bin_corr;

/* Checks the parameters and allocates all memory that runs will need.        Thread: setup.
 *   cpu_features  which implementations may be picked: shef_cpu_features(), or fewer bits
 *   max_threads   threads of the largest team a run will be given, 1..64
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: out_corr is untouched. */
SHEF_MUST_CHECK enum shef_err shef_bin_corr_create(struct shef_bin_corr **out_corr,
                                                   const struct shef_bin_corr_params *params,
                                                   uint32_t cpu_features, int32_t max_threads,
                                                   struct shef_error *err);

/* Correlates one pair. Allocates nothing, cannot fail.     Thread: one at a time per workspace.
 *   left, right    unsigned or ternary, both of the workspace's size
 *   workers        may be NULL; at most max_threads
 *   out_disparity  px, SHEF_BIN_CORR_NONE where not read out
 *   out_sum        s at that disparity, 0 where not read out */
void shef_bin_corr_run(struct shef_bin_corr *corr, const struct shef_edge_map *left,
                       const struct shef_edge_map *right, struct shef_workers *workers,
                       struct shef_image_i16 out_disparity, struct shef_image_i16 out_sum);

/* The implementation that was picked: "avx512", "avx2", "neon" or "c". */
const char *shef_bin_corr_isa(const struct shef_bin_corr *corr);

/* What create() allocated. */
size_t shef_bin_corr_bytes(const struct shef_bin_corr *corr);

/* NULL is allowed. */
void shef_bin_corr_destroy(struct shef_bin_corr *corr);

#ifdef __cplusplus
}
#endif

#endif
