/* Which pixels are published, and their numbers as the messages write them.
 *
 * An image is divided into cells of step x step pixels. Of each cell the pixel with the highest
 * confidence stands for it. Disparity, depth and cloud all speak of the same pixels. The layouts
 * are described in lcm_types/. Nothing here allocates after create(). Thread: one at a time. */
#ifndef SHEF_PUBLISH_PICKS_H
#define SHEF_PUBLISH_PICKS_H

#include <stdint.h>
#include <string.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_PICKS_MAX_STEP 16

struct shef_picks {
    /* Set by create, then read-only. */
    int32_t width_px;
    int32_t height_px;
    int32_t *flags; /* width_px, for choose() */
    /* Of the last choose(). */
    int32_t grid_step;
    int32_t grid_w;
    int32_t grid_h;
    int32_t mask_bytes;  /* of a row of the mask */
    uint8_t *mask;       /* grid_h rows; bit gx % 8 of byte gx / 8: the cell has a pixel */
    uint32_t *pixels;    /* y * width_px + x of each, row by row of the grid */
    uint32_t *row_start; /* grid_h + 1: where a row of the grid begins in pixels */
};

/* Allocates for images of one size, 1 to 16384 px a side. */
SHEF_MUST_CHECK enum shef_err shef_picks_create(struct shef_picks *out_picks, int32_t width_px,
                                                int32_t height_px, struct shef_error *err);

/* A zeroed struct is allowed. */
void shef_picks_destroy(struct shef_picks *picks);

/* Chooses a pixel for each cell that has one with a value in least..most.
 *   value       0 or NaN: none
 *   confidence  0 or more; of two alike the upper, then the left pixel is taken
 *   step        1 to SHEF_PICKS_MAX_STEP */
void shef_picks_choose(struct shef_picks *picks, struct shef_image_f32 value,
                       struct shef_image_f32 confidence, int32_t step, float least, float most);

/* The unit of disparity codes: 1/32 px, doubled until max_disparity_px fits into 12 bits. */
float shef_disparity_unit_px(float max_disparity_px);

/* 12 bits of disparity, nearest, 4 of confidence above them.
 *   disparity_px  codes 1..4095 of 1 / per_px; what would be 0 or more than 4095 becomes 0, none
 *   confidence    clamped to 0..1 */
static inline uint16_t shef_disparity_code(float disparity_px, float confidence, float per_px)
{
    const float scaled = disparity_px * per_px + 0.5f;

    if (!(scaled >= 1.0f && scaled < 4096.0f))
        return 0;

    const float clamped = confidence > 0.0f ? confidence < 1.0f ? confidence : 1.0f : 0.0f;

    return (uint16_t)((uint32_t)scaled | (uint32_t)(clamped * 15.0f + 0.5f) << 12);
}

#define SHEF_DEPTH_UNIT_M 0.00025f

/* Nearest multiple of 0.25 mm; 0 where that is 0 or more than 65535. */
static inline uint16_t shef_depth_code(float depth_m)
{
    /* 4000 units a metre: exact, unlike a division by the unit. */
    const float scaled = depth_m * 4000.0f + 0.5f;

    return scaled >= 1.0f && scaled < 65536.0f ? (uint16_t)scaled : 0;
}

/* Never understates: 4 bits of exponent, 4 of mantissa, rounded up. NaN gives the largest. */
static inline uint8_t shef_sigma_code(float sigma_m)
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

#ifdef __cplusplus
}
#endif

#endif
