#include "publish/picks.h"

#include <assert.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define SPAN_CELLS 8 /* looked at together, to skip empty ones */

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
        .flags = shef_memory_create((size_t)width_px, sizeof *picks.flags),
    };

    if (!picks.mask || !picks.pixels || !picks.row_start || !picks.flags) {
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
    free(picks->flags);
    *picks = (struct shef_picks){ 0 };
}

struct view {
    struct shef_image_f32 value;
    struct shef_image_f32 confidence;
    float least, most;
};

/* Sets flags[x] where any of rows y0..y1 - 1 has a value at x. Compilers turn the loop into vector
 * instructions: no branches. */
static void flag_columns(const struct view *view, int32_t y0, int32_t y1, int32_t *flags)
{
    const int32_t width_px = view->value.width_px;
    const float least = view->least, most = view->most;

    memset(flags, 0, (size_t)width_px * sizeof *flags);
    for (int32_t y = y0; y < y1; y++) {
        const float *value = shef_row_f32(view->value, y);

        for (int32_t x = 0; x < width_px; x++)
            flags[x] |= (value[x] >= least) & (value[x] <= most);
    }
}

#define ALWAYS_INLINE inline __attribute__((always_inline))

static ALWAYS_INLINE bool has_flag(const int32_t *flags, int32_t n_flags)
{
    int32_t any = 0;

    for (int32_t i = 0; i < n_flags; i++)
        any |= flags[i];
    return any != 0;
}

/* The pixel of a cell that has one. Without branches, which nobody could predict: the bits of
 * floats that are not negative rise with their value, so that confidence and position make one
 * number, and the largest wins. */
static ALWAYS_INLINE uint32_t choose_pixel(const struct view *view, int32_t x0, int32_t cell_w,
                                           int32_t y0, int32_t cell_h)
{
    const uint64_t first_of_all = SHEF_PICKS_MAX_STEP * SHEF_PICKS_MAX_STEP;
    uint64_t best = 0;

    for (int32_t y = 0; y < cell_h; y++) {
        const float *value = shef_row_f32(view->value, y0 + y) + x0;
        const float *confidence = shef_row_f32(view->confidence, y0 + y) + x0;

        for (int32_t x = 0; x < cell_w; x++) {
            const bool is_set = (value[x] >= view->least) & (value[x] <= view->most);
            const uint64_t earliness = first_of_all - (uint64_t)(y * SHEF_PICKS_MAX_STEP + x);
            uint32_t bits;

            memcpy(&bits, &confidence[x], sizeof bits);

            const uint64_t key = ((uint64_t)bits << 32 | earliness) & -(uint64_t)is_set;

            best = key > best ? key : best;
        }
    }

    const uint32_t place = (uint32_t)(first_of_all - (best & UINT32_MAX));
    const uint32_t y = (uint32_t)y0 + place / SHEF_PICKS_MAX_STEP;

    return y * (uint32_t)view->value.width_px + (uint32_t)x0 + place % SHEF_PICKS_MAX_STEP;
}

/* Chooses in one row of the grid. Returns how many pixels there are so far. With a step and a
 * height that the compiler knows, the loops over a cell disappear. */
static ALWAYS_INLINE uint32_t choose_row(struct shef_picks *picks, const struct view *view,
                                         int32_t gy, int32_t step, int32_t cell_h, uint32_t n_picks)
{
    const int32_t y0 = gy * picks->grid_step;
    const int32_t n_whole = picks->width_px / step; /* cells that the right edge does not cut */
    uint8_t *mask = picks->mask + (ptrdiff_t)gy * picks->mask_bytes;

    for (int32_t span = 0; span < n_whole; span += SPAN_CELLS) {
        const int32_t end = span + SPAN_CELLS < n_whole ? span + SPAN_CELLS : n_whole;

        if (!has_flag(picks->flags + span * step, (end - span) * step))
            continue;
        for (int32_t gx = span; gx < end; gx++) {
            if (!has_flag(picks->flags + gx * step, step))
                continue;
            picks->pixels[n_picks++] = choose_pixel(view, gx * step, step, y0, cell_h);
            mask[gx / 8] |= (uint8_t)(1u << gx % 8);
        }
    }
    if (n_whole < picks->grid_w) {
        const int32_t x0 = n_whole * step, cell_w = picks->width_px - x0;

        if (has_flag(picks->flags + x0, cell_w)) {
            picks->pixels[n_picks++] = choose_pixel(view, x0, cell_w, y0, cell_h);
            mask[n_whole / 8] |= (uint8_t)(1u << n_whole % 8);
        }
    }
    return n_picks;
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
        picks->row_start[gy] = n_picks;

        const int32_t y0 = gy * step;
        const int32_t cell_h = y0 + step < picks->height_px ? step : picks->height_px - y0;

        flag_columns(&view, y0, y0 + cell_h, picks->flags);
        if (step == 2 && cell_h == 2)
            n_picks = choose_row(picks, &view, gy, 2, 2, n_picks);
        else if (step == 1)
            n_picks = choose_row(picks, &view, gy, 1, 1, n_picks);
        else
            n_picks = choose_row(picks, &view, gy, step, cell_h, n_picks);
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
