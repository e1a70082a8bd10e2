#include "publish/picks.h"

#include <assert.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define SPAN_CELLS 8 /* looked at together: those of a byte of the mask */

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

/* A pixel's confidence where it has a value, less than any other where it has none. */
static ALWAYS_INLINE float standing(const struct view *view, float value, float confidence)
{
    return ((value >= view->least) & (value <= view->most)) ? confidence : -1.0f;
}

/* Which of its 2x2 pixels each cell of a row takes, as its distance from the first in memory
 * order; -1: none. Compilers turn the loop into vector instructions. */
static void place_quads(const struct view *view, int32_t y0, int32_t n_cells,
                        int32_t *restrict out_places)
{
    const struct view v = *view;
    const int32_t below = view->value.width_px;
    const float *restrict value[2] = { shef_row_f32(v.value, y0), shef_row_f32(v.value, y0 + 1) };
    const float *restrict confidence[2] = { shef_row_f32(v.confidence, y0),
                                            shef_row_f32(v.confidence, y0 + 1) };

    for (int32_t gx = 0; gx < n_cells; gx++) {
        const int32_t x = 2 * gx;
        const float upper_left = standing(&v, value[0][x], confidence[0][x]);
        const float upper_right = standing(&v, value[0][x + 1], confidence[0][x + 1]);
        const float lower_left = standing(&v, value[1][x], confidence[1][x]);
        const float lower_right = standing(&v, value[1][x + 1], confidence[1][x + 1]);
        /* Of two alike the one that comes first stays. */
        const int32_t upper = upper_right > upper_left;
        const int32_t lower = below + (lower_right > lower_left);
        const float best_upper = upper_right > upper_left ? upper_right : upper_left;
        const float best_lower = lower_right > lower_left ? lower_right : lower_left;
        const float best = best_lower > best_upper ? best_lower : best_upper;
        const int32_t place = best_lower > best_upper ? lower : upper;

        out_places[gx] = best < 0.0f ? -1 : place;
    }
}

/* The same as choose_row() for whole cells of 2x2 pixels, which is what is published by default.
 * Without branches: each cell's pixel is noted, and kept if there is one. */
static uint32_t choose_quads(struct shef_picks *picks, const struct view *view, int32_t gy,
                             uint32_t n_picks)
{
    const int32_t first_pixel = 2 * gy * picks->width_px;
    const int32_t n_cells = picks->grid_w;
    const int32_t *restrict places = picks->flags;
    uint32_t *restrict pixels = picks->pixels + n_picks;
    uint8_t *mask = picks->mask + (ptrdiff_t)gy * picks->mask_bytes;
    uint32_t n = 0;

    place_quads(view, 2 * gy, n_cells, picks->flags);
    for (int32_t span = 0; span < n_cells; span += SPAN_CELLS) {
        const int32_t n_span = n_cells - span < SPAN_CELLS ? n_cells - span : SPAN_CELLS;
        uint32_t bits = 0;

        for (int32_t i = 0; i < n_span; i++) {
            const int32_t place = places[span + i];
            const uint32_t is_there = place >= 0;

            pixels[n] = (uint32_t)(first_pixel + 2 * (span + i) + place);
            bits |= is_there << i;
            n += is_there;
        }
        mask[span / SPAN_CELLS] = (uint8_t)bits;
    }
    return n_picks + n;
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

        if (step == 2 && cell_h == 2 && picks->width_px % 2 == 0) {
            n_picks = choose_quads(picks, &view, gy, n_picks);
            continue;
        }
        flag_columns(&view, y0, y0 + cell_h, picks->flags);
        if (step == 1)
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
