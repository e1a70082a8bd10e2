/* What bin_corr.c and its implementations agree on: one band of rows, one group of disparities.
 *
 * Private to kernels/bin_corr*.c. */
#ifndef SHEF_PIPELINE_KERNELS_BIN_CORR_BAND_H
#define SHEF_PIPELINE_KERNELS_BIN_CORR_BAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"

#define SHEF_BIN_CORR_MAX_LANES 128
#define SHEF_BIN_CORR_BLOCK_PX  64 /* one word of the left map: the read-out's step along x */
#define SHEF_BIN_CORR_BOX_BYTES (2 * SHEF_BIN_CORR_MAX_LANES)

/* Signed maps: column sums are kept this much too high, so that they are unsigned bytes. */
#define SHEF_BIN_CORR_BIAS 128

/* One pair, prepared; shared by all bands. */
struct shef_bin_corr_job {
    int32_t width_px;
    int32_t height_px;
    int32_t radius_px;
    bool is_signed; /* either map is ternary */
    bool everywhere;
    /* Left map: bit planes as in struct shef_edge_map; minus is NULL if it is unsigned. */
    const uint64_t *plus;
    const uint64_t *minus;
    int32_t stride_words;
    /* Right map as bytes -1, 0, 1, rows reversed, so that rising disparities are rising
     * addresses: E(x - d, y) is right[y * right_stride_bytes + right_origin - x + d]. Zero outside
     * the image, for every lane of every group. */
    const int8_t *right;
    ptrdiff_t right_stride_bytes;
    int32_t right_origin;
    struct shef_image_i16 disparity;
    struct shef_image_i16 sum;
};

/* Disparities d_first .. d_first + n_disparities - 1. */
struct shef_bin_corr_group {
    int32_t d_first;
    int32_t n_disparities; /* 1..SHEF_BIN_CORR_MAX_LANES */
    bool is_first;         /* writes the output; later groups replace only smaller sums */
};

/* Correlates rows y_begin <= y < y_end.
 *   scratch  shef_bin_corr_scratch_bytes() bytes of the calling thread's own, 64-byte aligned */
typedef void shef_bin_corr_band_fn(const struct shef_bin_corr_job *job,
                                   const struct shef_bin_corr_group *group, int32_t y_begin,
                                   int32_t y_end, uint8_t *scratch);

shef_bin_corr_band_fn shef_bin_corr_band_c;
shef_bin_corr_band_fn shef_bin_corr_band_avx2;
shef_bin_corr_band_fn shef_bin_corr_band_avx512;
shef_bin_corr_band_fn shef_bin_corr_band_neon;

/* Columns that a box centred in the image can meet as it moves: -radius_px - 1 and on. Those
 * outside the image stay empty, so that the box needs no border cases. */
static inline size_t shef_bin_corr_columns(int32_t width_px, int32_t radius_px)
{
    return (size_t)width_px + 2 * (size_t)radius_px + 1;
}

/* Column sums, and the boxes parked for one block's read-out. */
static inline size_t shef_bin_corr_scratch_bytes(int32_t width_px, int32_t radius_px)
{
    return shef_bin_corr_columns(width_px, radius_px) * SHEF_BIN_CORR_MAX_LANES +
           (size_t)SHEF_BIN_CORR_BLOCK_PX * SHEF_BIN_CORR_BOX_BYTES;
}

/* Word i of row y of the pixels to read out: bit k is pixel 64 i + k. */
static inline uint64_t shef_bin_corr_read_out_word(const struct shef_bin_corr_job *job, int32_t y,
                                                   int32_t i)
{
    const size_t at = (size_t)y * (size_t)job->stride_words + (size_t)i;
    const int32_t n_left = job->width_px - i * SHEF_BIN_CORR_BLOCK_PX;

    if (job->everywhere)
        return n_left >= 64 ? UINT64_MAX : (UINT64_C(1) << n_left) - 1;
    return job->plus[at] ^ (job->minus ? job->minus[at] : 0);
}

/* Puts a group's best sum at a pixel into the output, or keeps an earlier group's. Groups come in
 * the order of their disparities, so an equal sum is a larger disparity and loses. */
static inline void shef_bin_corr_put(const struct shef_bin_corr_group *group, int16_t *disparity,
                                     int16_t *sum, int32_t lane, int32_t best)
{
    if (group->is_first || best > *sum) {
        *disparity = (int16_t)(group->d_first + lane);
        *sum = (int16_t)best;
    }
}

#endif
