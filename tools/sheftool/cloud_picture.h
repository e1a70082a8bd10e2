/* A picture of a point cloud as seen from beside the camera. Thread: any. */
#ifndef SHEFTOOL_CLOUD_PICTURE_H
#define SHEFTOOL_CLOUD_PICTURE_H

#include <stdint.h>

#include "core/error.h"
#include "pipeline/point_cloud.h"

/* Draws two views of a cloud beside each other: the viewer goes round its middle, to the left and
 * to the right above. Near points are in front and large; the grey of each is tinted by its depth,
 * yellow near and blue far. No points give a black picture.
 *   out_picture  1280 x 480 px; free it with shef_image_destroy_rgb8()
 * SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_cloud_picture_create(struct shef_image_rgb8 *out_picture,
                                                        const struct shef_point *points,
                                                        int32_t n_points, struct shef_error *err);

#endif
