/* The reference, and what the others do at the borders. */
#include "core/cpu.h"
#include "pipeline/kernels/warp.h"

#define ONE  (1 << SHEF_WARP_WEIGHT_BITS)
#define HALF (ONE / 2)

static int32_t value_at(const struct shef_warp_source *source, int32_t x, int32_t y)
{
    if (x < 0 || y < 0 || x >= source->width_px || y >= source->height_px)
        return 0;
    return source->pixels[y * source->stride + x];
}

static int32_t mixed(int32_t a, int32_t b, int32_t weight_of_b)
{
    return (a * (ONE - weight_of_b) + b * weight_of_b + HALF) >> SHEF_WARP_WEIGHT_BITS;
}

static void row_c(int16_t *out_values, const struct shef_warp_node *nodes,
                  const struct shef_warp_node *offsets, int32_t n_segments,
                  const struct shef_warp_source *source)
{
    for (int32_t s = 0; s < n_segments; s++) {
        const struct shef_warp_segment segment = shef_warp_segment_at(nodes, offsets, s);

        for (int32_t j = 0; j < SHEF_WARP_SEGMENT_PX; j++) {
            const int32_t x_q16 = segment.x_q16 + (segment.dx_q16 * j >> 3);
            const int32_t y_q16 = segment.y_q16 + (segment.dy_q16 * j >> 3);
            const int32_t x = x_q16 >> 16;
            const int32_t y = y_q16 >> 16;
            const int32_t x_weight = (x_q16 & 0xffff) >> (16 - SHEF_WARP_WEIGHT_BITS);
            const int32_t y_weight = (y_q16 & 0xffff) >> (16 - SHEF_WARP_WEIGHT_BITS);
            const int32_t upper =
                mixed(value_at(source, x, y), value_at(source, x + 1, y), x_weight);
            const int32_t lower =
                mixed(value_at(source, x, y + 1), value_at(source, x + 1, y + 1), x_weight);

            out_values[s * SHEF_WARP_SEGMENT_PX + j] = (int16_t)mixed(upper, lower, y_weight);
        }
    }
}

const struct shef_warp_kernel shef_warp_kernel_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .row = row_c,
};
