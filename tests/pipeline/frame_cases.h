/* Frames, rectifications and double-precision references for the tests of the frame side.
 *
 * Thread: the test's own. */
#ifndef SHEF_TESTS_FRAME_CASES_H
#define SHEF_TESTS_FRAME_CASES_H

#include "calib/rectification.h"
#include "core/image.h"
#include "support/support.h"

/* A frame camera of 2048 x 1536 px with f 1301 px, a lens that bends and a mount that is turned by
 * half a degree about each axis; rectified to the profiles of the same names. */
struct shef_rectification shef_test_frame_wide(void);
struct shef_rectification shef_test_frame_paper(void);

/* Fills an image with random grey values: the hardest case for anything that interpolates. */
void shef_test_fill_random(struct shef_image_u8 image, struct shef_test_random *random);

/* Fills an image with texture as lenses draw it: cells of random brightness, blurred. */
void shef_test_fill_texture(struct shef_image_u8 image, double cell_px, double blur_px,
                            struct shef_test_random *random);

/* What the rectifier should give at one pixel, in double precision: the mean of 2 x 2 pixels
 * (cell_px 2; 1: single pixels), bilinear between their centres; -1 where one is missing. */
double shef_test_rectified(const struct shef_rectification *rectification, struct shef_image_u8 raw,
                           int32_t cell_px, int32_t x, int32_t y);

#endif
