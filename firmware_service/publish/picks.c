#include "publish/picks.h"

#include <assert.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

/* Pixels of a row that are looked at together to skip empty ones; a multiple of 8 cells. */
#define SPAN_CELLS 8

enum shef_err shef_picks_create(struct shef_picks *out_picks, int32_t width_px, int32_t height_px,
                                struct shef_error *err)
{
    if (width_px < 1 || width_px > SHEF_IMAGE_MAX_SIDE_PX || height_px < 1 ||
        height_px > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "images of %dx%d px: 1 to %d px a side are possible", width_px, height_px,
                         SHEF_IMAGE_MAX_SIDE_PX);

    const size_t n_pixels = (size_t)width_px * (size_t)height_px;
    struct shef_picks picks = {
        .width_px = width_px,
        .height_px = height_px,
        .mask = shef_memory_create((size_t)height_px, ((size_t)width_px + 7) / 8),
        .pixels = shef_memory_create(n_pixels, sizeof *picks.pixels),
        .row_start = shef_memory_create((size_t)height_px + 1, sizeof *picks.row_start),
    };

    if (!picks.mask || !picks.pixels || !picks.row_start) {
        shef_picks_destroy(&picks);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "publishing images of %dx%d px: out of memory",
                         width_px, height_px);
    }
    *out_picks = picks;
    return SHEF_OK;
}

void shef_picks_destroy(struct shef_picks *picks)
{
    free(picks->mask);
    free(picks->pixels);
    free(picks->row_start);
    *picks = (struct shef_picks){ 0 };
}

struct view {
    struct shef_image_f32 value;
    struct shef_image_f32 confidence;
    float least, most;
};

/* The cell's pixel; false: none. */
static bool choose_pixel(const struct view *view, int32_t x0, int32_t x1, int32_t y0, int32_t y1,
                         uint32_t *out_pixel)
{
    float best = -1.0f;

    for (int32_t y = y0; y < y1; y++) {
        const float *value = shef_row_f32(view->value, y);
        const float *confidence = shef_row_f32(view->confidence, y);

        for (int32_t x = x0; x < x1; x++) {
            if (value[x] >= view->least && value[x] <= view->most && confidence[x] > best) {
                best = confidence[x];
                *out_pixel = (uint32_t)(y * view->value.width_px + x);
            }
        }
    }
    return best >= 0.0f;
}

/* Whether any pixel is not +0.0; a loop that compilers turn into vector instructions. */
static bool has_any(struct shef_image_f32 image, int32_t x0, int32_t x1, int32_t y0, int32_t y1)
{
    uint32_t any = 0;

    for (int32_t y = y0; y < y1; y++) {
        const float *row = shef_row_f32(image, y);

        for (int32_t x = x0; x < x1; x++) {
            uint32_t bits;

            memcpy(&bits, &row[x], sizeof bits);
            any |= bits;
        }
    }
    return any != 0;
}

static int32_t least_of(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

void shef_picks_choose(struct shef_picks *picks, struct shef_image_f32 value,
                       struct shef_image_f32 confidence, int32_t step, float least, float most)
{
    assert(step >= 1 && step <= SHEF_PICKS_MAX_STEP && least > 0.0f);
    assert(value.width_px == picks->width_px && value.height_px == picks->height_px);
    assert(confidence.width_px == picks->width_px && confidence.height_px == picks->height_px);

    const struct view view = { value, confidence, least, most };
    uint32_t n_picks = 0;

    picks->grid_step = step;
    picks->grid_w = (picks->width_px + step - 1) / step;
    picks->grid_h = (picks->height_px + step - 1) / step;
    picks->mask_bytes = (picks->grid_w + 7) / 8;
    memset(picks->mask, 0, (size_t)picks->mask_bytes * (size_t)picks->grid_h);

    for (int32_t gy = 0; gy < picks->grid_h; gy++) {
        const int32_t y0 = gy * step, y1 = least_of(y0 + step, picks->height_px);
        uint8_t *mask = picks->mask + (ptrdiff_t)gy * picks->mask_bytes;

        picks->row_start[gy] = n_picks;
        for (int32_t span = 0; span < picks->grid_w; span += SPAN_CELLS) {
            const int32_t span_end = least_of(span + SPAN_CELLS, picks->grid_w);

            if (!has_any(value, span * step, least_of(span_end * step, picks->width_px), y0, y1))
                continue;
            for (int32_t gx = span; gx < span_end; gx++) {
                const int32_t x0 = gx * step, x1 = least_of(x0 + step, picks->width_px);

                if (choose_pixel(&view, x0, x1, y0, y1, &picks->pixels[n_picks])) {
                    n_picks++;
                    mask[gx / 8] |= (uint8_t)(1u << gx % 8);
                }
            }
        }
    }
    picks->row_start[picks->grid_h] = n_picks;
}

float shef_disparity_unit_px(float max_disparity_px)
{
    float unit_px = 1.0f / 32;

    while (max_disparity_px > 4064 * unit_px) /* 127 px, 254 px, ...: room for sub-pixels above */
        unit_px *= 2;
    return unit_px;
}

uint16_t shef_disparity_code(float disparity_px, float confidence, float per_px)
{
    const float scaled = disparity_px * per_px + 0.5f;

    if (!(scaled >= 1.0f && scaled < 4096.0f))
        return 0;

    const float clamped = confidence > 0.0f ? confidence < 1.0f ? confidence : 1.0f : 0.0f;

    return (uint16_t)((uint32_t)scaled | (uint32_t)(clamped * 15.0f + 0.5f) << 12);
}

uint16_t shef_depth_code(float depth_m)
{
    /* 4000 units a metre: exact, unlike a division by the unit. */
    const float scaled = depth_m * 4000.0f + 0.5f;

    return scaled >= 1.0f && scaled < 65536.0f ? (uint16_t)scaled : 0;
}

uint8_t shef_sigma_code(float sigma_m)
{
    const float scaled = sigma_m * 4000.0f;

    if (scaled <= 1.0f)
        return 0;
    if (!(scaled <= 63488.0f)) /* (1 + 15/16) * 2^15; NaN comes here too */
        return 255;

    /* A float's bits are exponent and mantissa already: keep 4 bits of the latter, rounded up, and
     * count the exponent from 1.0 on. */
    uint32_t bits;

    memcpy(&bits, &scaled, sizeof bits);
    return (uint8_t)(((bits + (1u << 19) - 1) >> 19) - (127u << 4));
}
