/* Row loops of the robust matcher and the read-out: plain C, compiled once per instruction set.
 *
 * Every loop is written so that compilers vectorise it (rows_body.h); floating point rounds the
 * same everywhere because products and sums are never fused, so all tables give the same bits. */
#ifndef SHEF_PIPELINE_KERNELS_ROWS_H
#define SHEF_PIPELINE_KERNELS_ROWS_H

#include <stddef.h>
#include <stdint.h>

/* Sums of values (or of their squares) that two rows of byte pairs add and two others take off.
 *   entering, leaving  two rows of n_pairs * 2 bytes; offset is subtracted from each byte
 *   sum                n_pairs values, updated */
typedef void shef_rows_slide_fn(const uint8_t *const entering[2], const uint8_t *const leaving[2],
                                int32_t n_pairs, int32_t offset, int16_t *sum);

/* Window sums at positions 0..n-1 from column sums: those of 2 * half_width + 1 columns, spacing
 * apart, about the position. Columns outside 0..n_columns-1 are empty. */
typedef void shef_rows_window_fn(const int16_t *column, int32_t n_columns, int32_t half_width,
                                 int32_t spacing, int32_t n, int32_t *out_sum);

/* Pairs of neighbouring bytes from right to left: pair i holds row[-i * step] in its low byte and
 * the byte after that one in its high byte.
 *   step  1 or 2 */
typedef void shef_rows_mirror_fn(const int8_t *row, int32_t step, int32_t n, uint16_t *out_pairs);

/* Q15 factors sqrt(floor2 / (variance + floor2)) with variance = square - sum^2 * inverse_n. */
typedef void shef_rows_gains_fn(const int32_t *sum, const int32_t *square, int32_t n,
                                float inverse_n, float floor2, int16_t *out_gain);

/* A row of cells as the read-out wants them; valid from -1 to the number of cells. */
struct shef_cell_row {
    float *disparity; /* 1/32 px */
    float *weight;    /* margin + 1 */
    float *confidence;
};

/* Every second pixel of a pixel row: of each cell the left (side -1) or the right one (side 1).
 *
 * A pixel is the mean of the four cells whose centres surround it, weighted by margin and
 * bilinearly (9, 3, 3 and 1 sixteenths: it lies a quarter cell from its own cell's centre); cells
 * more than same_surface (1/32 px) from the heaviest one lie on another surface and stay out.
 *   near_row, far_row               the pixel's own cell row, and the nearer neighbouring one
 *   out_disparity, out_confidence   one value per cell; px and 0..1 */
typedef void shef_rows_side_fn(const struct shef_cell_row *near_row,
                               const struct shef_cell_row *far_row, int32_t side, int32_t n_cells,
                               float same_surface, float *out_disparity, float *out_confidence);

/* out = even[0], odd[0], even[1], ...; n values of each. */
typedef void shef_rows_interleave_fn(const float *even, const float *odd, int32_t n, float *out);

/* Disparities less the bias; one that falls below zero would lie beyond infinity: none. */
typedef void shef_rows_bias_fn(const float *bias, int32_t n, float *disparity, float *confidence);

/* out = values where left is not 0, else 0. */
typedef void shef_rows_keep_fn(const int8_t *left, const float *values, int32_t n, float *out);

/* depth.h's formulas with everything that is the same for a row. */
struct shef_depth_terms {
    float fb;       /* px m */
    float angle_px; /* f sigma_angle */
    float shared;   /* what does not depend on the disparity: (sigma_b / b)^2 + ... */
};

/* Depth and its sigma, 0 where the disparity is 0 or less. */
typedef void shef_rows_depth_fn(const struct shef_depth_terms *terms, const float *disparity,
                                const float *confidence, int32_t n, float *out_depth_m,
                                float *out_sigma_m);

/* Marks where values jump: 1 where lines[3] and lines[0] differ by more than least, and lines[2]
 * and lines[1] by more than the neighbours before and by no less than those behind; else 0. */
typedef void shef_rows_jumps_fn(const float *const lines[4], int32_t n, float least,
                                uint8_t *out_marks);

#define SHEF_ROWS_EVIDENCE_PX   8
#define SHEF_ROWS_EVIDENCE_FINE 4 /* steps of a fraction of a pixel */

/* A patch of both maps, seen at two disparities: SHEF_ROWS_EVIDENCE_PX columns, n_rows rows. Pixel
 * x of the left map meets at[x] and at[x - 1] of the right one, weighted. */
struct shef_rows_patch {
    const int8_t *left; /* values of at most 15 either way */
    ptrdiff_t left_stride;
    const int8_t *at[2]; /* the first row at each disparity */
    ptrdiff_t right_stride;
    int16_t weight[2][2]; /* of both pixels; SHEF_ROWS_EVIDENCE_FINE in all */
    int32_t n_rows;
};

/* By how much each pixel is more like the right map at the first disparity than at the second: half
 * the difference of the squared differences, times 2 SHEF_ROWS_EVIDENCE_FINE^2.
 *   sum  SHEF_ROWS_EVIDENCE_PX values, added to; those of the next row are row_step further */
typedef void shef_rows_evidence_fn(const struct shef_rows_patch *patch, ptrdiff_t row_step,
                                   int32_t *sum);

struct shef_row_kernels {
    uint32_t cpu_features;
    shef_rows_window_fn *window_sums;
    shef_rows_mirror_fn *mirror_pairs;
    shef_rows_slide_fn *slide_values;
    shef_rows_slide_fn *slide_squares;
    shef_rows_gains_fn *gains;
    shef_rows_side_fn *side;
    shef_rows_interleave_fn *interleave;
    shef_rows_bias_fn *take_off_bias;
    shef_rows_keep_fn *keep_edges;
    shef_rows_depth_fn *depth;
    shef_rows_jumps_fn *find_jumps;
    shef_rows_evidence_fn *evidence;
};

/* The best table that these features (core/cpu.h) allow. Never NULL. */
const struct shef_row_kernels *shef_rows_pick(uint32_t cpu_features);

extern const struct shef_row_kernels shef_row_kernels_c;
#if defined(__x86_64__)
extern const struct shef_row_kernels shef_row_kernels_avx2;
extern const struct shef_row_kernels shef_row_kernels_avx512;
#endif

#endif
