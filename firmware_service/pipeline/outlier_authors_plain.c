#include <math.h>
#include <stdlib.h>

#include "pipeline/outlier_authors.h"

static int32_t clamp(int32_t i, int32_t n)
{
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a;
    const float y = *(const float *)b;

    return (x > y) - (x < y);
}

static double median(float *samples, int32_t n)
{
    qsort(samples, (size_t)n, sizeof *samples, ascending);
    if (n % 2 == 1)
        return samples[n / 2];
    return ((double)samples[n / 2 - 1] + (double)samples[n / 2]) / 2;
}

static float filtered(struct shef_image_f32 image, int32_t r, int32_t c, int32_t radius_px)
{
    float samples[2 * SHEF_OUTLIER_AUTHORS_MAX_RADIUS_PX + 1];
    const float v = shef_row_f32(image, r)[c];
    int32_t n = 0;

    for (int32_t k = -radius_px; k <= radius_px; k++) {
        const float sample =
            shef_row_f32(image, clamp(r + k, image.height_px))[clamp(c + k, image.width_px)];

        if (!isnan(sample))
            samples[n++] = sample;
    }
    if (n < 4)
        return 0;

    const double med = median(samples, n);
    const double difference = fabs(v - med);

    return difference / med > 1.0 / 3 || difference > 10 ? 0 : v;
}

void shef_outlier_authors_plain(struct shef_image_f32 in, int32_t radius_px,
                                struct shef_image_f32 out)
{
    for (int32_t r = 0; r < in.height_px; r++)
        for (int32_t c = 0; c < in.width_px; c++) {
            const float v = shef_row_f32(in, r)[c];

            shef_row_f32(out, r)[c] = v < 1 ? NAN : v;
        }
    for (int32_t r = 0; r < in.height_px; r++)
        for (int32_t c = 0; c < in.width_px; c++)
            shef_row_f32(out, r)[c] = filtered(out, r, c, radius_px);
    for (int32_t r = 0; r < in.height_px; r++)
        for (int32_t c = 0; c < in.width_px; c++)
            if (isnan(shef_row_f32(out, r)[c]))
                shef_row_f32(out, r)[c] = 0;
}
