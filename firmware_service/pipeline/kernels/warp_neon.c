/* Half a segment, 4 pixels, at a time: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/warp.h"

/* Positions of four of a segment's pixels. */
static inline int32x4_t positions(int32_t first, int32_t per_segment, int32x4_t lanes)
{
    return vaddq_s32(vdupq_n_s32(first), vshrq_n_s32(vmulq_n_s32(lanes, per_segment), 3));
}

static inline int32x4_t far_weights(int32x4_t q16)
{
    return vandq_s32(vshrq_n_s32(q16, 16 - SHEF_WARP_WEIGHT_BITS),
                     vdupq_n_s32((1 << SHEF_WARP_WEIGHT_BITS) - 1));
}

/* near * (1 - weight) + far * weight, rounded. */
static inline int32x4_t mixed(int32x4_t near, int32x4_t far, int32x4_t weight)
{
    const int32x4_t rest = vsubq_s32(vdupq_n_s32(1 << SHEF_WARP_WEIGHT_BITS), weight);

    return vrshrq_n_s32(vmlaq_s32(vmulq_s32(near, rest), far, weight), SHEF_WARP_WEIGHT_BITS);
}

static inline int32x4_t mixed_row(const int16_t *row, uint8x16_t shuffle, int32x4_t x_weight)
{
    const uint8x16_t columns = vreinterpretq_u8_s16(vld1q_s16(row));
    const int32x4_t pairs = vreinterpretq_s32_u8(vqtbl1q_u8(columns, shuffle));

    return mixed(vshrq_n_s32(vshlq_n_s32(pairs, 16), 16), vshrq_n_s32(pairs, 16), x_weight);
}

static inline int16x4_t simple_half(const struct shef_warp_segment *segment, int32_t first_lane,
                                    const struct shef_warp_source *source)
{
    static const int32_t counts[4] = { 0, 1, 2, 3 };
    const int32x4_t lanes = vaddq_s32(vld1q_s32(counts), vdupq_n_s32(first_lane));
    const int32x4_t x_q16 = positions(segment->x_q16, segment->dx_q16, lanes);
    const int32x4_t y_q16 = positions(segment->y_q16, segment->dy_q16, lanes);
    const int32_t x_first = vgetq_lane_s32(x_q16, 0) >> 16;
    const int32_t y_first = vgetq_lane_s32(y_q16, 0) >> 16;
    const int32_t y_last = vgetq_lane_s32(y_q16, 3) >> 16;
    const int32_t y_low = y_first < y_last ? y_first : y_last;
    const int32x4_t column = vsubq_s32(vshrq_n_s32(x_q16, 16), vdupq_n_s32(x_first));
    const uint8x16_t shuffle =
        vreinterpretq_u8_s32(vmlaq_n_s32(vdupq_n_s32(0x03020100), column, 0x02020202));
    const int32x4_t x_weight = far_weights(x_q16);
    const int16_t *row = source->pixels + y_low * source->stride + x_first;
    int32x4_t upper = mixed_row(row, shuffle, x_weight);
    int32x4_t lower = mixed_row(row + source->stride, shuffle, x_weight);

    if (y_first != y_last) {
        const uint32x4_t is_low = vceqq_s32(vshrq_n_s32(y_q16, 16), vdupq_n_s32(y_low));

        upper = vbslq_s32(is_low, upper, lower);
        lower = vbslq_s32(is_low, lower, mixed_row(row + 2 * source->stride, shuffle, x_weight));
    }
    return vmovn_s32(mixed(upper, lower, far_weights(y_q16)));
}

static void row_neon(int16_t *out_values, const struct shef_warp_node *nodes,
                     const struct shef_warp_node *offsets, int32_t n_segments,
                     const struct shef_warp_source *source)
{
    for (int32_t s = 0; s < n_segments; s++) {
        const struct shef_warp_segment segment = shef_warp_segment_at(nodes, offsets, s);
        int16_t *out = out_values + s * SHEF_WARP_SEGMENT_PX;

        if (shef_warp_is_simple(&segment, source)) {
            vst1_s16(out, simple_half(&segment, 0, source));
            vst1_s16(out + 4, simple_half(&segment, 4, source));
        } else {
            shef_warp_kernel_c.row(out, nodes + s, offsets + s / 2, 1, source);
        }
    }
}

const struct shef_warp_kernel shef_warp_kernel_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .row = row_neon,
};
