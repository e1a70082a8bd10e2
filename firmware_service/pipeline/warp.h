/* Rectification of event images: the inverse bilinear warp that fetches each pixel of a profile
 * from the sensor.
 *
 * Geometry: pixel centres at integer coordinates, x right, y down, z forward. A map is made once;
 * warping streams and does not allocate, lock or log. A map is read-only after create() and can be
 * used by several threads; a shift belongs to one thread at a time. */
#ifndef SHEF_PIPELINE_WARP_H
#define SHEF_PIPELINE_WARP_H

#include <stdint.h>

#include "calib/rectification.h"
#include "core/error.h"
#include "core/image.h"
#include "pipeline/kernels/warp.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_WARP_MAX_SIDE_PX 2048 /* of the sensor; positions have 28 bits */

/* The map in the form the warp reads it: nodes every SHEF_WARP_SEGMENT_PX along each row. */
struct shef_warp_map {
    struct shef_rectification rectification;
    struct shef_warp_node *nodes; /* n_segments + 1 a row */
    int32_t n_segments;           /* of a row, the last one possibly beyond its end */
    double max_error_px;          /* of positions between nodes */
};

/* Makes a map; between nodes it is off by at most 0.05 px of the sensor.   Thread: setup.
 * SHEF_ERR_INVALID: sizes or focal lengths out of range, a sensor larger than
 * SHEF_WARP_MAX_SIDE_PX, or a lens that bends rows more than the nodes can follow.
 * SHEF_ERR_NO_MEMORY. Nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_warp_map_create(struct shef_warp_map *out_map,
                                                   const struct shef_rectification *rectification,
                                                   struct shef_error *err);

/* A zeroed map is allowed. */
void shef_warp_map_destroy(struct shef_warp_map *map);

/* A small offset of where the map fetches from, one for each SHEF_WARP_OFFSET_PX square. */
struct shef_warp_shift {
    struct shef_warp_node *offsets; /* n_columns a row of squares */
    double *jacobians;              /* sensor px per rectified px at the squares' centres: 4 each */
    int32_t n_columns;
    int32_t n_rows;
    double f_px;
    double cx_px, cy_px;
};

/* Makes a shift of zero for this map.                                      Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_warp_shift_create(struct shef_warp_shift *out_shift,
                                                     const struct shef_warp_map *map,
                                                     struct shef_error *err);

/* A zeroed shift is allowed. */
void shef_warp_shift_destroy(struct shef_warp_shift *shift);

/* Moves what is seen by this much along the image flow, the same way everywhere in sensor pixels:
 * this undoes a lag of that size.
 *   camera_velocity  translation of the rectified camera over the scene, x y z, any unit. Only its
 *                    direction counts, not the depth. All zero: no shift.
 *   lag_px           in pixels of the sensor, 0..8 */
void shef_warp_shift_set(struct shef_warp_shift *shift, const double camera_velocity[3],
                         double lag_px);

/* Warps an image of the sensor's size to one of the profile's.
 *   shift   NULL: none
 *   source  within +-32767; SHEF_WARP_PAD_BYTES readable behind its last row; rows a whole number
 *           of pixels apart
 *   out     rows at least width rounded up to whole segments; pixels the sensor does not see are
 *           zero */
void shef_warp_run(const struct shef_warp_map *map, const struct shef_warp_kernel *kernel,
                   const struct shef_warp_shift *shift, struct shef_image_i16 source,
                   struct shef_image_i16 out);

#ifdef __cplusplus
}
#endif

#endif
