#include "service/picture.h"

#include "core/memory.h"

/* Red at the largest disparity, over yellow, green and cyan to blue at none: a fifth of the range
 * each. */
static struct shef_rgb8 colour_of(float share)
{
    static const uint8_t stops[5][3] = {
        { 40, 60, 255 }, { 0, 220, 255 }, { 40, 230, 60 }, { 255, 230, 0 }, { 255, 40, 20 },
    };
    const float at = share < 0 ? 0 : share < 1 ? share * 4 : 3.999f;
    const int i = (int)at;
    const float weight = at - (float)i;
    uint8_t mixed[3];

    for (int c = 0; c < 3; c++)
        mixed[c] =
            (uint8_t)((float)stops[i][c] + weight * (float)(stops[i + 1][c] - stops[i][c]) + 0.5f);
    return (struct shef_rgb8){ mixed[0], mixed[1], mixed[2] };
}

enum shef_err shef_picture_of_result(const struct shef_result *result,
                                     struct shef_image_rgb8 *out_picture, struct shef_error *err)
{
    const struct shef_image_f32 disparity = result->disparity;
    const enum shef_err code =
        shef_image_create_rgb8(out_picture, disparity.width_px, disparity.height_px, err);

    if (code != SHEF_OK)
        return code;
    for (int32_t y = 0; y < disparity.height_px; y++) {
        const float *values = shef_row_f32(disparity, y);
        const uint8_t *grey = result->has_picture ? shef_row_u8(result->picture, y) : NULL;
        struct shef_rgb8 *row = shef_row_rgb8(*out_picture, y);

        for (int32_t x = 0; x < disparity.width_px; x++) {
            /* Darker than the frame is, so that the colours stand out. */
            const uint8_t dark = grey ? (uint8_t)(grey[x] * 3 / 4) : 0;

            row[x] = values[x] > 0 ? colour_of(values[x] / result->max_disparity_px)
                                   : (struct shef_rgb8){ dark, dark, dark };
        }
    }
    return SHEF_OK;
}
