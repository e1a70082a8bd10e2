/* The reference, and the odd segments and row ends of the others. */
#include "core/cpu.h"
#include "pipeline/kernels/rectify.h"

#define ONE         (1 << SHEF_RECTIFY_FRACTION_BITS)
#define FINAL_SHIFT (2 + 2 * SHEF_RECTIFY_FRACTION_BITS - SHEF_RECTIFY_MIDDLE_SHIFT)

static void sum_cells_c(uint16_t *out_cells, const uint8_t *upper, const uint8_t *lower, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out_cells[i] =
            (uint16_t)(upper[2 * i] + upper[2 * i + 1] + lower[2 * i] + lower[2 * i + 1]);
}

static void widen_c(uint16_t *out_cells, const uint8_t *pixels, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        out_cells[i] = (uint16_t)(4 * pixels[i]);
}

static int32_t mixed(int32_t a, int32_t b, int32_t weight_of_b)
{
    return a * (ONE - weight_of_b) + b * weight_of_b;
}

static uint8_t pixel_at(const uint16_t *const *rows, int32_t x, int32_t y, int32_t x_fraction,
                        int32_t y_fraction)
{
    const uint16_t *upper = rows[y] + x;
    const uint16_t *lower = rows[y + 1] + x;
    const int32_t upper_mix = mixed(upper[0], upper[1], x_fraction) >> SHEF_RECTIFY_MIDDLE_SHIFT;
    const int32_t lower_mix = mixed(lower[0], lower[1], x_fraction) >> SHEF_RECTIFY_MIDDLE_SHIFT;

    return (uint8_t)((mixed(upper_mix, lower_mix, y_fraction) + (1 << (FINAL_SHIFT - 1))) >>
                     FINAL_SHIFT);
}

static void row_c(uint8_t *out_pixels, const struct shef_rectify_segment *segments,
                  int32_t n_segments, const uint16_t *const *rows,
                  const struct shef_rectify_position *scattered)
{
    for (int32_t s = 0; s < n_segments; s++) {
        const struct shef_rectify_segment *segment = segments + s;

        for (int32_t j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++) {
            struct shef_rectify_position p;

            if (segment->form == SHEF_RECTIFY_SCATTERED)
                p = scattered[segment->at.scattered + j];
            else
                p = (struct shef_rectify_position){
                    segment->at.first_x[j / SHEF_RECTIFY_HALF_PX] * ONE + segment->x[j],
                    segment->first_y * ONE + segment->y[j],
                };
            out_pixels[s * SHEF_RECTIFY_SEGMENT_PX + j] =
                p.x < 0 ? 0
                        : pixel_at(rows, p.x / ONE, p.y / ONE, p.x & (ONE - 1), p.y & (ONE - 1));
        }
    }
}

const struct shef_rectify_kernels shef_rectify_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .sum_cells = sum_cells_c,
    .widen = widen_c,
    .row = row_c,
};
