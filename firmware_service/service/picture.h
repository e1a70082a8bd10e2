/* What the service sees now, as a picture for people: the rectified frame, and over it the depth of
 * every point, red near to blue far; without depth the frame alone. Thread: control. */
#ifndef SHEF_SERVICE_PICTURE_H
#define SHEF_SERVICE_PICTURE_H

#include "core/error.h"
#include "core/image.h"
#include "publish/result.h"

/* Draws a result. Allocates the picture; shef_image_destroy_rgb8() frees it.
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_picture_of_result(const struct shef_result *result,
                                                     struct shef_image_rgb8 *out_picture,
                                                     struct shef_error *err);

#endif
