/* One row of the inverse bilinear warp, one table of functions per instruction set.
 *
 * A row of the output is cut into segments of SHEF_WARP_SEGMENT_PX pixels. The nodes at their ends
 * say where those pixels lie in the source; in between, positions are linear. All arithmetic is on
 * integers: every implementation is bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_WARP_H
#define SHEF_PIPELINE_KERNELS_WARP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_WARP_SEGMENT_PX  8
#define SHEF_WARP_OFFSET_PX   16 /* one offset for that many pixels of a row: two segments */
#define SHEF_WARP_PAD_BYTES   64 /* readable beyond the source's last pixel */
#define SHEF_WARP_WEIGHT_BITS 14

/* A position in the source, or an offset to one, in 2^-16 px. Positions and offsets are within
 * +-2^28, neighbouring nodes differ by at most 2^28. */
struct shef_warp_node {
    int32_t x_q16;
    int32_t y_q16;
};

struct shef_warp_source {
    const int16_t *pixels; /* values within +-32767; zero beyond the borders */
    ptrdiff_t stride;      /* pixels from row to row */
    int32_t width_px;
    int32_t height_px;
};

/* The output pixels first + j, j = 0..7, of segment s lie at
 *   node[s] + ((node[s + 1] - node[s]) * j >> 3) + offset[s / 2]
 * and are mixed from the four source pixels around: first along x, then along y, each time
 * rounded to an integer by (sum + 2^13) >> 14 with weights of 14 bits.
 *   out_values  n_segments * 8 values
 *   nodes       n_segments + 1
 *   offsets     (n_segments + 1) / 2 */
typedef void shef_warp_row_fn(int16_t *out_values, const struct shef_warp_node *nodes,
                              const struct shef_warp_node *offsets, int32_t n_segments,
                              const struct shef_warp_source *source);

struct shef_warp_kernel {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */
    shef_warp_row_fn *row;
};

/* The best of them for these features. */
const struct shef_warp_kernel *shef_warp_pick(uint32_t cpu_features);

extern const struct shef_warp_kernel shef_warp_kernel_c;
extern const struct shef_warp_kernel shef_warp_kernel_avx2;
extern const struct shef_warp_kernel shef_warp_kernel_avx512;
extern const struct shef_warp_kernel shef_warp_kernel_neon;

/* One segment as the vector versions see it before they decide how to do it. */
struct shef_warp_segment {
    int32_t x_q16; /* of its first pixel, offset included */
    int32_t y_q16;
    int32_t dx_q16; /* over 8 pixels */
    int32_t dy_q16;
};

static inline struct shef_warp_segment shef_warp_segment_at(const struct shef_warp_node *nodes,
                                                            const struct shef_warp_node *offsets,
                                                            int32_t s)
{
    return (struct shef_warp_segment){
        .x_q16 = nodes[s].x_q16 + offsets[s / 2].x_q16,
        .y_q16 = nodes[s].y_q16 + offsets[s / 2].y_q16,
        .dx_q16 = nodes[s + 1].x_q16 - nodes[s].x_q16,
        .dy_q16 = nodes[s + 1].y_q16 - nodes[s].y_q16,
    };
}

/* Whether the segment's source pixels all exist, four outputs in a row need at most 8 adjacent
 * source columns, eight outputs at most 3 adjacent rows, and x grows. */
static inline int shef_warp_is_simple(const struct shef_warp_segment *segment,
                                      const struct shef_warp_source *source)
{
    const int32_t x_first = segment->x_q16 >> 16;
    const int32_t x_last = (segment->x_q16 + (segment->dx_q16 * 7 >> 3)) >> 16;
    const int32_t y_first = segment->y_q16 >> 16;
    const int32_t y_last = (segment->y_q16 + (segment->dy_q16 * 7 >> 3)) >> 16;
    const int32_t y_low = y_first < y_last ? y_first : y_last;
    const int32_t y_high = y_first < y_last ? y_last : y_first;

    return segment->dx_q16 >= 0 && segment->dx_q16 <= 15 << 16 && x_first >= 0 &&
           x_last + 1 < source->width_px && y_low >= 0 && y_high + 1 < source->height_px &&
           y_high - y_low <= 1;
}

#ifdef __cplusplus
}
#endif

#endif
