/* Colour pictures of disparity maps, for people to look at.
 *
 * Disparities are shown from 0 px (dark blue, far) to the top of the scale (yellow, near), as in
 * the figures of Wang 2021; black = no estimate. Errors are shown from blue (estimate too far)
 * over white (right) to red (too near): the colour is full at 5 px, where a pixel counts as bad,
 * and darkens towards 20 px. Pictures are borrowed views. Thread: one per picture. */
#ifndef SHEFTOOL_PICTURE_H
#define SHEFTOOL_PICTURE_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"

/* Where on the scale a disparity lies. 0 or less: black.
 *   top_px  the disparity shown as the brightest yellow, above 0 */
struct shef_rgb8 shef_colour_of_disparity(float disparity_px, float top_px);

/* The colour of estimate - truth. */
struct shef_rgb8 shef_colour_of_error(float error_px);

/* What a picture of a map shows at each pixel. */
struct shef_map_drawing {
    struct shef_image_f32 disparity; /* px, 0 = none */
    struct shef_image_f32 truth;     /* data NULL: draw disparities, else errors against it */
    float top_px;                    /* of the disparity scale */
};

/* Draws a map at 1 / shrink of its size with its top-left corner at (x, y); a drawn pixel is the
 * mean of the estimates in its shrink x shrink block. Parts outside the picture are cut off. */
void shef_picture_draw_map(struct shef_image_rgb8 picture, int32_t x, int32_t y,
                           const struct shef_map_drawing *map, int32_t shrink);

/* Draws two edge maps on top of each other at 1 / shrink of their size: frame edges orange, event
 * edges blue, both white, mixed by how much of a block each fills. */
void shef_picture_draw_edges(struct shef_image_rgb8 picture, int32_t x, int32_t y,
                             const struct shef_edge_map *frame, const struct shef_edge_map *event,
                             int32_t shrink);

/* Draws a horizontal scale of the disparity colours, width x height px. */
void shef_picture_draw_scale(struct shef_image_rgb8 picture, int32_t x, int32_t y, int32_t width_px,
                             int32_t height_px);

/* Writes ASCII text, 6 x 8 px a letter times scale; other bytes appear as '?'. */
void shef_picture_draw_text(struct shef_image_rgb8 picture, int32_t x, int32_t y, int32_t scale,
                            struct shef_rgb8 colour, const char *text);

/* Draws one map at full size and writes it as a PNG. */
SHEF_MUST_CHECK enum shef_err shef_picture_write_map(const struct shef_map_drawing *map,
                                                     const char *path, struct shef_error *err);

#endif
