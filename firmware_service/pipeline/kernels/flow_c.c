/* The reference, and the last values of a row for the others. */
#include "core/cpu.h"
#include "pipeline/kernels/flow.h"

static void halve_c(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = (int16_t)(upper[2 * i] + upper[2 * i + 1] + lower[2 * i] + lower[2 * i + 1]);
}

static void shrink_c(int16_t *out, const int16_t *slopes, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out[i] = (int16_t)(slopes[i] >> 5);
}

static struct shef_flow_sums correlate_c(const int16_t *events, const int16_t *gx,
                                         const int16_t *gy, ptrdiff_t stride)
{
    struct shef_flow_sums sums = { 0 };

    for (ptrdiff_t y = 0; y < SHEF_FLOW_BLOCK_PX; y++)
        for (ptrdiff_t x = 0; x < SHEF_FLOW_BLOCK_PX; x++) {
            const int32_t e = events[y * stride + x];

            sums.ex += e * gx[y * stride + x];
            sums.ey += e * gy[y * stride + x];
            sums.ee += e * e;
        }
    return sums;
}

static struct shef_flow_slope_sums measure_c(const int16_t *gx, const int16_t *gy, ptrdiff_t stride)
{
    struct shef_flow_slope_sums sums = { 0 };

    for (ptrdiff_t y = 0; y < SHEF_FLOW_BLOCK_PX; y++)
        for (ptrdiff_t x = 0; x < SHEF_FLOW_BLOCK_PX; x++) {
            const int32_t slope_x = gx[y * stride + x];
            const int32_t slope_y = gy[y * stride + x];

            sums.xx += slope_x * slope_x;
            sums.xy += slope_x * slope_y;
            sums.yy += slope_y * slope_y;
        }
    return sums;
}

const struct shef_flow_kernels shef_flow_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .halve = halve_c,
    .shrink = shrink_c,
    .correlate = correlate_c,
    .measure = measure_c,
};
