#include "frame_cases.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"

static struct shef_rectification on_frame_camera(struct shef_rectification r)
{
    const double a = 0.0087;

    r.sensor_width_px = 2048;
    r.sensor_height_px = 1536;
    r.camera = (struct shef_camera_model){
        .fx_px = 1301.3,
        .fy_px = 1300.6,
        .cx_px = 1029.4,
        .cy_px = 761.7,
        .distortion = { -0.21, 0.11, 4e-4, -3e-4, -0.02 },
    };
    /* Small turns add up. */
    const double turn[9] = { 1, -a, a, a, 1, -a, -a, a, 1 };

    for (int i = 0; i < 9; i++)
        r.r_camera_rectified[i] = turn[i];
    return r;
}

struct shef_rectification shef_test_frame_wide(void)
{
    return on_frame_camera(shef_rectification_wide());
}

struct shef_rectification shef_test_frame_paper(void)
{
    return on_frame_camera(shef_rectification_paper());
}

void shef_test_fill_random(struct shef_image_u8 image, struct shef_test_random *random)
{
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            shef_row_u8(image, y)[x] = (uint8_t)shef_test_random_u64(random);
}

static void blur(double *values, int32_t n, ptrdiff_t step, double sigma_px, double *scratch)
{
    const int32_t reach = (int32_t)ceil(3 * sigma_px);

    for (int32_t i = 0; i < n; i++) {
        double sum = 0;
        double weights = 0;

        for (int32_t k = -reach; k <= reach; k++)
            if (i + k >= 0 && i + k < n) {
                const double weight = exp(-k * k / (2 * sigma_px * sigma_px));

                sum += weight * values[(i + k) * step];
                weights += weight;
            }
        scratch[i] = sum / weights;
    }
    for (int32_t i = 0; i < n; i++)
        values[i * step] = scratch[i];
}

void shef_test_fill_texture(struct shef_image_u8 image, double cell_px, double blur_px,
                            struct shef_test_random *random)
{
    const int32_t n_columns = (int32_t)(image.width_px / cell_px) + 2;
    const int32_t n_rows = (int32_t)(image.height_px / cell_px) + 2;
    const size_t n_pixels = (size_t)image.width_px * (size_t)image.height_px;
    const size_t side = (size_t)(image.width_px + image.height_px);
    double *cells = shef_memory_create((size_t)n_columns * (size_t)n_rows, sizeof *cells);
    double *values = shef_memory_create(n_pixels, sizeof *values);
    double *scratch = shef_memory_create(side, sizeof *scratch);

    if (!cells || !values || !scratch)
        abort();
    for (int32_t i = 0; i < n_columns * n_rows; i++)
        cells[i] = 20 + 220 * shef_test_random_unit(random);
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++) {
            /* Slanted, so that edges run every way. */
            const double across = (x + 0.3 * y) / (1.3 * cell_px);
            const double down = (y + 0.3 * (image.width_px - x)) / (1.3 * cell_px);

            values[y * image.width_px + x] =
                cells[((int32_t)down % n_rows) * n_columns + (int32_t)across % n_columns];
        }
    for (int32_t y = 0; y < image.height_px; y++)
        blur(values + y * image.width_px, image.width_px, 1, blur_px, scratch);
    for (int32_t x = 0; x < image.width_px; x++)
        blur(values + x, image.height_px, image.width_px, blur_px, scratch);
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            shef_row_u8(image, y)[x] = (uint8_t)lrint(values[y * image.width_px + x]);
    free(cells);
    free(values);
    free(scratch);
}

static double cell_at(struct shef_image_u8 raw, int32_t cell_px, int32_t x, int32_t y)
{
    double sum = 0;

    for (int32_t dy = 0; dy < cell_px; dy++)
        for (int32_t dx = 0; dx < cell_px; dx++)
            sum += shef_row_u8(raw, y * cell_px + dy)[x * cell_px + dx];
    return sum / (cell_px * cell_px);
}

double shef_test_rectified(const struct shef_rectification *rectification, struct shef_image_u8 raw,
                           int32_t cell_px, int32_t x, int32_t y)
{
    double raw_x;
    double raw_y;

    if (!shef_rectification_project(rectification, x, y, &raw_x, &raw_y))
        return -1;

    const double cell_x = (raw_x - (cell_px - 1) / 2.0) / cell_px;
    const double cell_y = (raw_y - (cell_px - 1) / 2.0) / cell_px;
    const int32_t left = (int32_t)floor(cell_x);
    const int32_t top = (int32_t)floor(cell_y);
    const double fx = cell_x - left;
    const double fy = cell_y - top;

    if (left < 0 || top < 0 || left + 1 >= raw.width_px / cell_px ||
        top + 1 >= raw.height_px / cell_px)
        return -1;
    return (1 - fy) * ((1 - fx) * cell_at(raw, cell_px, left, top) +
                       fx * cell_at(raw, cell_px, left + 1, top)) +
           fy * ((1 - fx) * cell_at(raw, cell_px, left, top + 1) +
                 fx * cell_at(raw, cell_px, left + 1, top + 1));
}
