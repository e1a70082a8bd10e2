/* One row of an area-averaging rectification, one table of functions per instruction set.
 *
 * The source is a picture of cells, the sums of 2 x 2 raw pixels (or single ones times 4), made row
 * by row just before they are read. A row of the output is cut into segments of
 * SHEF_RECTIFY_SEGMENT_PX pixels, each with a table of where its pixels lie among the cells. All
 * arithmetic is on integers: every implementation is bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_RECTIFY_H
#define SHEF_PIPELINE_KERNELS_RECTIFY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_RECTIFY_SEGMENT_PX    8
#define SHEF_RECTIFY_HALF_PX       4  /* pixels that share a first column */
#define SHEF_RECTIFY_FRACTION_BITS 12 /* a cell is 4096 steps wide */
#define SHEF_RECTIFY_PAD_CELLS     16 /* readable beyond a row's last cell */
#define SHEF_RECTIFY_CELL_MAX      1020
#define SHEF_RECTIFY_MIDDLE_SHIFT  7 /* between the mix along x and the one along y */

/* A position among the cells, in 1/4096. x < 0: nowhere, the pixel is 0. */
struct shef_rectify_position {
    int32_t x;
    int32_t y;
};

enum shef_rectify_form {
    SHEF_RECTIFY_TWO_ROWS,   /* all pixels between the first row and the next */
    SHEF_RECTIFY_THREE_ROWS, /* some of them one row further down */
    SHEF_RECTIFY_SCATTERED,  /* none of these: eight positions of their own, in another table */
};

struct shef_rectify_segment {
    /* Cells after the first (x: 0..6 after that of the half, y: 0 or 1) in the high 4 bits, the
     * fraction in the low 12. */
    uint16_t x[SHEF_RECTIFY_SEGMENT_PX];
    uint16_t y[SHEF_RECTIFY_SEGMENT_PX];
    union {
        int16_t first_x[2]; /* of pixels 0..3 and 4..7 */
        int32_t scattered;  /* index of the first of eight positions */
    } at;
    int16_t first_y;
    uint16_t form; /* enum shef_rectify_form */
};

struct shef_rectify_kernels {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */

    /* Sums of n cells of 2 x 2 pixels of two adjacent rows of 2 n pixels. */
    void (*sum_cells)(uint16_t *out_cells, const uint8_t *upper, const uint8_t *lower, int32_t n);

    /* n single pixels times 4. */
    void (*widen)(uint16_t *out_cells, const uint8_t *pixels, int32_t n);

    /* n_segments * 8 pixels. Each is mixed from the four cells around, first along x:
     *   (a * (4096 - fraction) + b * fraction) >> 7
     * of the upper and of the lower row, then along y: (... + 2^18) >> 19.
     *   rows       by the cells' y; SHEF_RECTIFY_CELL_MAX at most, padding readable
     *   scattered  positions of all scattered segments of the picture */
    void (*row)(uint8_t *out_pixels, const struct shef_rectify_segment *segments,
                int32_t n_segments, const uint16_t *const *rows,
                const struct shef_rectify_position *scattered);
};

/* The best of them for these features. */
const struct shef_rectify_kernels *shef_rectify_pick(uint32_t cpu_features);

extern const struct shef_rectify_kernels shef_rectify_kernels_c;
extern const struct shef_rectify_kernels shef_rectify_kernels_avx2;
extern const struct shef_rectify_kernels shef_rectify_kernels_avx512;
extern const struct shef_rectify_kernels shef_rectify_kernels_neon;

#ifdef __cplusplus
}
#endif

#endif
