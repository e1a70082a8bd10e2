/* The flow kernels on vectors of 16-bit lanes, written once for every instruction set.
 *
 * The including file first includes its vec_*.h and defines the further vec_ functions used here
 * and wide, a vector of 32-bit sums. VEC_LANES divides SHEF_FLOW_BLOCK_PX. The meaning of every
 * line is in flow_c.c. */

#include "pipeline/kernels/flow.h"

static void halve_vec(int16_t *out, const int8_t *upper, const int8_t *lower, int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, vec_cell_sums(upper + 2 * i, lower + 2 * i));
    shef_flow_kernels_c.halve(out + i, upper + 2 * i, lower + 2 * i, n - i);
}

static void shrink_vec(int16_t *out, const int16_t *slopes, int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, vec_shift_right(vec_load(slopes + i), 5));
    shef_flow_kernels_c.shrink(out + i, slopes + i, n - i);
}

static struct shef_flow_sums correlate_vec(const int16_t *events, const int16_t *gx,
                                           const int16_t *gy, ptrdiff_t stride)
{
    wide ex = wide_zero();
    wide ey = wide_zero();
    wide ee = wide_zero();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, events += stride, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += VEC_LANES) {
            const vec e = vec_load(events + x);

            ex = wide_add_products(ex, e, vec_load(gx + x));
            ey = wide_add_products(ey, e, vec_load(gy + x));
            ee = wide_add_products(ee, e, e);
        }

    int32_t totals[3];

    wide_totals(totals, ex, ey, ee);
    return (struct shef_flow_sums){ totals[0], totals[1], totals[2] };
}

static struct shef_flow_slope_sums measure_vec(const int16_t *gx, const int16_t *gy,
                                               ptrdiff_t stride)
{
    wide xx = wide_zero();
    wide xy = wide_zero();
    wide yy = wide_zero();

    for (int y = 0; y < SHEF_FLOW_BLOCK_PX; y++, gx += stride, gy += stride)
        for (int x = 0; x < SHEF_FLOW_BLOCK_PX; x += VEC_LANES) {
            const vec slope_x = vec_load(gx + x);
            const vec slope_y = vec_load(gy + x);

            xx = wide_add_products(xx, slope_x, slope_x);
            xy = wide_add_products(xy, slope_x, slope_y);
            yy = wide_add_products(yy, slope_y, slope_y);
        }

    int32_t totals[3];

    wide_totals(totals, xx, xy, yy);
    return (struct shef_flow_slope_sums){ totals[0], totals[1], totals[2] };
}
