/* A segment of 8 pixels at a time: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/rectify.h"

#define ONE         (1 << SHEF_RECTIFY_FRACTION_BITS)
#define FINAL_SHIFT (2 + 2 * SHEF_RECTIFY_FRACTION_BITS - SHEF_RECTIFY_MIDDLE_SHIFT)

static void sum_cells_neon(uint16_t *out_cells, const uint8_t *upper, const uint8_t *lower,
                           int32_t n)
{
    int32_t i = 0;

    for (; i + 8 <= n; i += 8)
        vst1q_u16(out_cells + i,
                  vpadalq_u8(vpaddlq_u8(vld1q_u8(upper + 2 * i)), vld1q_u8(lower + 2 * i)));
    shef_rectify_kernels_c.sum_cells(out_cells + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void widen_neon(uint16_t *out_cells, const uint8_t *pixels, int32_t n)
{
    int32_t i = 0;

    for (; i + 8 <= n; i += 8)
        vst1q_u16(out_cells + i, vshll_n_u8(vld1_u8(pixels + i), 2));
    shef_rectify_kernels_c.widen(out_cells + i, pixels + i, n - i);
}

/* Four positions of a half: which bytes fetch their two columns, and the weights. */
struct half {
    uint8x16_t shuffle; /* the left neighbours in the low half of each 32 bits */
    uint16x4_t fractions;
};

static inline struct half half_of(const uint16_t *x)
{
    const uint32x4_t entries = vmovl_u16(vld1_u16(x));
    const uint32x4_t columns = vshrq_n_u32(entries, SHEF_RECTIFY_FRACTION_BITS);
    const uint32x4_t bytes = vmlaq_n_u32(vdupq_n_u32(0x03020100), columns, 0x02020202);

    return (struct half){
        vreinterpretq_u8_u32(bytes),
        vand_u16(vld1_u16(x), vdup_n_u16(ONE - 1)),
    };
}

static inline uint32x4_t mixed(uint16x4_t a, uint16x4_t b, uint16x4_t weight_of_b)
{
    return vmlal_u16(vmull_u16(a, vsub_u16(vdup_n_u16(ONE), weight_of_b)), b, weight_of_b);
}

static inline uint16x4_t mixed_row(const uint16_t *cells, struct half half)
{
    const uint8x16_t bytes = vreinterpretq_u8_u16(vld1q_u16(cells));
    const uint16x8_t pairs = vreinterpretq_u16_u8(vqtbl1q_u8(bytes, half.shuffle));
    const uint16x4_t left = vget_low_u16(vuzp1q_u16(pairs, pairs));
    const uint16x4_t right = vget_low_u16(vuzp2q_u16(pairs, pairs));

    return vshrn_n_u32(mixed(left, right, half.fractions), SHEF_RECTIFY_MIDDLE_SHIFT);
}

static inline uint16x4_t half_pixels(const struct shef_rectify_segment *segment, int side,
                                     const uint16_t *const *rows)
{
    const int first = side * SHEF_RECTIFY_HALF_PX;
    const struct half half = half_of(segment->x + first);
    const uint16x4_t y = vld1_u16(segment->y + first);
    const int32_t x = segment->at.first_x[side];
    const uint16_t *const *row = rows + segment->first_y;
    uint16x4_t upper = mixed_row(row[0] + x, half);
    uint16x4_t lower = mixed_row(row[1] + x, half);

    if (segment->form == SHEF_RECTIFY_THREE_ROWS) {
        const uint16x4_t is_further = vcge_u16(y, vdup_n_u16(ONE));

        upper = vbsl_u16(is_further, lower, upper);
        lower = vbsl_u16(is_further, mixed_row(row[2] + x, half), lower);
    }

    const uint32x4_t mix = mixed(upper, lower, vand_u16(y, vdup_n_u16(ONE - 1)));

    return vmovn_u32(vrshrq_n_u32(mix, FINAL_SHIFT));
}

static void row_neon(uint8_t *out_pixels, const struct shef_rectify_segment *segments,
                     int32_t n_segments, const uint16_t *const *rows,
                     const struct shef_rectify_position *scattered)
{
    for (int32_t s = 0; s < n_segments; s++) {
        uint8_t *out = out_pixels + s * SHEF_RECTIFY_SEGMENT_PX;

        if (segments[s].form == SHEF_RECTIFY_SCATTERED)
            shef_rectify_kernels_c.row(out, segments + s, 1, rows, scattered);
        else
            vst1_u8(out, vmovn_u16(vcombine_u16(half_pixels(segments + s, 0, rows),
                                                half_pixels(segments + s, 1, rows))));
    }
}

const struct shef_rectify_kernels shef_rectify_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .sum_cells = sum_cells_neon,
    .widen = widen_neon,
    .row = row_neon,
};
