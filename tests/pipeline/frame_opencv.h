/* OpenCV for the tests of the frame side: the peer of the rectifier, and chessboards.
 *
 * Nothing of OpenCV shows here, and no exception leaves. Thread: one at a time. */
#ifndef SHEF_TESTS_FRAME_OPENCV_H
#define SHEF_TESTS_FRAME_OPENCV_H

#include <stdbool.h>

#include "calib/calibration.h"
#include "calib/rectification.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* OpenCV's fastest way through the same rectification: fixed-point maps, one thread. */
struct shef_test_opencv;

/* NULL: OpenCV failed; it said why on stderr. */
struct shef_test_opencv *shef_test_opencv_create(const struct shef_rectification *rectification);
void shef_test_opencv_destroy(struct shef_test_opencv *peer);

/* Bilinear from the raw frame. */
void shef_test_opencv_remap(struct shef_test_opencv *peer, struct shef_image_u8 raw);

/* Bilinear from the means of 2 x 2 pixels. */
void shef_test_opencv_halve_and_remap(struct shef_test_opencv *peer, struct shef_image_u8 raw);

/* The picture that the last of these made; valid until the next. */
struct shef_image_u8 shef_test_opencv_result(const struct shef_test_opencv *peer);

/* Reads a picture as grey values into an image of its size. Returns whether it could. */
bool shef_test_opencv_read(const char *path, struct shef_image_u8 out);

/* Finds the inner corners of a chessboard, to a fraction of a pixel.
 *   out_xy_px  2 * columns * rows values
 * Returns whether all of them are there. */
bool shef_test_opencv_find_corners(struct shef_image_u8 image, int columns, int rows,
                                   double *out_xy_px);

/* One look of both cameras at the board. */
#define SHEF_TEST_BOARD_COLUMNS 9
#define SHEF_TEST_BOARD_ROWS    6
#define SHEF_TEST_BOARD_CORNERS (SHEF_TEST_BOARD_COLUMNS * SHEF_TEST_BOARD_ROWS)

struct shef_test_board_pair {
    double left_xy_px[2 * SHEF_TEST_BOARD_CORNERS];
    double right_xy_px[2 * SHEF_TEST_BOARD_CORNERS];
};

/* Calibrates both cameras, of 640 x 480 px, and where they are; the left one becomes the frame
 * camera.
 *   square_m     side of the board's squares
 *   out_rms_px   reprojection error
 * Returns whether OpenCV could. */
bool shef_test_opencv_calibrate(const struct shef_test_board_pair *pairs, int n_pairs,
                                double square_m, struct shef_calibration *out_calibration,
                                double *out_rms_px);

#ifdef __cplusplus
}
#endif

#endif
