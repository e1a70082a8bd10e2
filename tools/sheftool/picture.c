#include "sheftool/picture.h"

#include <assert.h>
#include <math.h>

#include "core/memory.h"
#include "core/png_io.h"

#define FULL_ERROR_PX 5.0f  /* where a pixel counts as bad and the colour is full */
#define DARK_ERROR_PX 20.0f /* where an error is as dark as it gets */

/* Evenly spaced over the scale: dark blue, blue, cyan, green, olive, orange, yellow. */
static const struct shef_rgb8 ramp[] = {
    { 52, 38, 148 },  { 42, 104, 232 }, { 18, 158, 212 }, { 46, 188, 142 },
    { 152, 196, 76 }, { 248, 188, 54 }, { 250, 250, 28 },
};

static uint8_t mix(uint8_t from, uint8_t to, float share)
{
    return (uint8_t)lrintf((float)from + share * ((float)to - (float)from));
}

static struct shef_rgb8 mix_colours(struct shef_rgb8 from, struct shef_rgb8 to, float share)
{
    return (struct shef_rgb8){
        mix(from.red, to.red, share),
        mix(from.green, to.green, share),
        mix(from.blue, to.blue, share),
    };
}

struct shef_rgb8 shef_colour_of_disparity(float disparity_px, float top_px)
{
    const int n_steps = (int)(sizeof ramp / sizeof ramp[0]) - 1;

    assert(top_px > 0);
    if (!(disparity_px > 0))
        return (struct shef_rgb8){ 0, 0, 0 };

    const float at = fminf(disparity_px / top_px, 1.0f) * (float)n_steps;
    const int step = at < (float)n_steps ? (int)at : n_steps - 1;

    return mix_colours(ramp[step], ramp[step + 1], at - (float)step);
}

struct shef_rgb8 shef_colour_of_error(float error_px)
{
    static const struct shef_rgb8 right = { 245, 245, 245 };
    static const struct shef_rgb8 near[2] = { { 235, 40, 25 }, { 110, 0, 20 } };
    static const struct shef_rgb8 far[2] = { { 40, 105, 255 }, { 15, 25, 120 } };
    const struct shef_rgb8 *side = error_px > 0 ? near : far;
    const float size_px = fminf(fabsf(error_px), DARK_ERROR_PX);

    if (size_px <= FULL_ERROR_PX)
        return mix_colours(right, side[0], size_px / FULL_ERROR_PX);
    return mix_colours(side[0], side[1],
                       (size_px - FULL_ERROR_PX) / (DARK_ERROR_PX - FULL_ERROR_PX));
}

static void set_pixel(struct shef_image_rgb8 picture, int32_t x, int32_t y, struct shef_rgb8 colour)
{
    if (x >= 0 && x < picture.width_px && y >= 0 && y < picture.height_px)
        shef_row_rgb8(picture, y)[x] = colour;
}

/* The colour of one block: the mean over its pixels that have something to show. */
static struct shef_rgb8 block_colour(const struct shef_map_drawing *map, int32_t x0, int32_t y0,
                                     int32_t shrink)
{
    float sum = 0;
    int32_t n = 0;

    for (int32_t y = y0; y < y0 + shrink && y < map->disparity.height_px; y++)
        for (int32_t x = x0; x < x0 + shrink && x < map->disparity.width_px; x++) {
            const float disparity = shef_row_f32(map->disparity, y)[x];
            const float truth = map->truth.data ? shef_row_f32(map->truth, y)[x] : 0;

            if (!(disparity > 0) || (map->truth.data && !(truth > 0)))
                continue;
            sum += disparity - truth;
            n++;
        }
    if (n == 0)
        return (struct shef_rgb8){ 0, 0, 0 };
    return map->truth.data ? shef_colour_of_error(sum / (float)n)
                           : shef_colour_of_disparity(sum / (float)n, map->top_px);
}

void shef_picture_draw_map(struct shef_image_rgb8 picture, int32_t x, int32_t y,
                           const struct shef_map_drawing *map, int32_t shrink)
{
    for (int32_t row = 0; row * shrink < map->disparity.height_px; row++)
        for (int32_t col = 0; col * shrink < map->disparity.width_px; col++)
            set_pixel(picture, x + col, y + row,
                      block_colour(map, col * shrink, row * shrink, shrink));
}

/* Counts the set pixels of each block that row `line` crosses. */
static void count_row(const struct shef_edge_map *map, int32_t line, int32_t shrink,
                      int32_t *counts)
{
    int8_t row[SHEF_IMAGE_MAX_SIDE_PX];

    shef_edge_map_row(map, line, row);
    for (int32_t x = 0; x < map->width_px / shrink * shrink; x++)
        counts[x / shrink] += row[x] != 0;
}

void shef_picture_draw_edges(struct shef_image_rgb8 picture, int32_t x, int32_t y,
                             const struct shef_edge_map *frame, const struct shef_edge_map *event,
                             int32_t shrink)
{
    const int32_t n_cols = frame->width_px / shrink;
    const float full = (float)(shrink * shrink);

    assert(frame->width_px == event->width_px && frame->height_px == event->height_px);
    for (int32_t row = 0; row < frame->height_px / shrink; row++) {
        int32_t n_frame[SHEF_IMAGE_MAX_SIDE_PX] = { 0 };
        int32_t n_event[SHEF_IMAGE_MAX_SIDE_PX] = { 0 };

        for (int32_t line = row * shrink; line < (row + 1) * shrink; line++) {
            count_row(frame, line, shrink, n_frame);
            count_row(event, line, shrink, n_event);
        }
        for (int32_t col = 0; col < n_cols; col++) {
            const float f = (float)n_frame[col] / full;
            const float e = (float)n_event[col] / full;

            /* Orange (255, 150, 40) and blue (0, 105, 215) add up to white. */
            set_pixel(picture, x + col, y + row,
                      (struct shef_rgb8){
                          (uint8_t)(255 * f),
                          (uint8_t)(150 * f + 105 * e),
                          (uint8_t)(40 * f + 215 * e),
                      });
        }
    }
}

void shef_picture_draw_scale(struct shef_image_rgb8 picture, int32_t x, int32_t y, int32_t width_px,
                             int32_t height_px)
{
    for (int32_t row = 0; row < height_px; row++)
        for (int32_t col = 0; col < width_px; col++)
            set_pixel(picture, x + col, y + row,
                      shef_colour_of_disparity((float)col + 0.5f, (float)width_px));
}

enum shef_err shef_picture_write_map(const struct shef_map_drawing *map, const char *path,
                                     struct shef_error *err)
{
    struct shef_image_rgb8 picture;
    enum shef_err code =
        shef_image_create_rgb8(&picture, map->disparity.width_px, map->disparity.height_px, err);

    if (code != SHEF_OK)
        return code;
    shef_picture_draw_map(picture, 0, 0, map, 1);
    code = shef_png_write_rgb8(path, picture, err);
    shef_image_destroy_rgb8(&picture);
    return code;
}
