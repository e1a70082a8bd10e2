/* Edge maps of rectified frames, to be matched with those of the events (event_edges.h).
 *
 *   unsigned  the paper's: pixels whose Sobel gradient is among the strongest (25 % of the valid
 *             ones); thin ones (non-maximum suppression across the edge) as an option. The thick
 *             map is also where results are scored and read out
 *   along     where brightness rises or falls at a pixel while the camera moves: -(gradient of
 *             log(I + 6)) . u, u = direction of the image flow. For the filter's values
 *   temporal  log(I + 6) of a later frame minus that of an earlier one, unblurred. For the sum of
 *             the events between the two; needs no motion
 * The latter two as ternary bits above a quantile of |value|, or graded: value / quantile, clipped
 * to +-1. Each map finds its own quantile. Rows and columns outside a picture repeat its border.
 *
 * Nothing allocates, locks or logs after create().
 * Thread: one at a time. */
#ifndef SHEF_PIPELINE_FRAME_EDGES_H
#define SHEF_PIPELINE_FRAME_EDGES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"
#include "calib/rectification.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_frame_edges_params {
    double unsigned_quantile; /* of valid pixels, 0.01..0.999 */
    double ternary_quantile;
    double graded_quantile;
    bool is_thin; /* unsigned maps */
    /* But thresholds of at least this much, 0.001..100: an even picture has no edges. */
    double floor_grey_per_px; /* unsigned */
    double floor_ln_per_px;   /* along */
    double floor_ln;          /* temporal */
};

/* Quantiles 0.75, 0.75 and 0.90, thick; floors of 0.5 grey levels a pixel, 0.005 and 0.02. */
struct shef_frame_edges_params shef_frame_edges_default_params(void);

struct shef_frame_edges;

/* Allocates the work space.                                       Thread: setup.
 *   profile       width, height, f, cx and cy of the rectified pictures are used; width at least 2
 *   valid         of that size, 0 where a picture shows nothing; copied. data NULL: it is complete
 *   cpu_features  usually shef_cpu_features()
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_frame_edges_create(struct shef_frame_edges **out_edges,
                                                      const struct shef_rectification *profile,
                                                      struct shef_image_u8 valid,
                                                      const struct shef_frame_edges_params *params,
                                                      uint32_t cpu_features,
                                                      struct shef_error *err);

/* NULL is allowed. */
void shef_frame_edges_destroy(struct shef_frame_edges *edges);

/* Fills an unsigned map. */
void shef_frame_edges_unsigned(struct shef_frame_edges *edges, struct shef_image_u8 image,
                               struct shef_edge_map *out_map);

/* Fills a ternary or graded map of what motion does to brightness.
 *   camera_velocity  translation of the rectified camera over the scene, x y z, any unit: only its
 *                    direction counts. The scene flows the other way; around the point that the
 *                    camera moves to, each pixel has its own direction. All zero: an empty map */
void shef_frame_edges_along(struct shef_frame_edges *edges, struct shef_image_u8 image,
                            const double camera_velocity[3], struct shef_edge_map *out_map);

/* Fills a ternary or graded map of what became brighter or darker between two pictures. */
void shef_frame_edges_temporal(struct shef_frame_edges *edges, struct shef_image_u8 earlier,
                               struct shef_image_u8 later, struct shef_edge_map *out_map);

/* What the last map was cut at: grey levels a pixel (unsigned), ln per pixel of flow (along) or ln
 * (temporal). Pixels of this value are edges, or +-1. */
double shef_frame_edges_threshold(const struct shef_frame_edges *edges);

#ifdef __cplusplus
}
#endif

#endif
