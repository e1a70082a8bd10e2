/* Which way the picture flows, found from one frame and the events around it: what the signed
 * matcher needs where no robot says how the camera moves.
 *
 * Events say where brightness rises; the frame says where it would for each direction of motion.
 * The right direction is the one in which both agree best, wherever each block of the picture
 * finds its disparity. On pictures of half the size: blocks of 64 x 64 px are correlated with the
 * frame's slope along x and along y for every disparity; all 16 directions are combinations of
 * those two. Between directions the best fit of all blocks together decides.
 *
 * Nothing allocates, locks or logs after create(). The same input gives the same result with every
 * instruction set. Thread: one at a time. */
#ifndef SHEF_PIPELINE_FLOW_SEARCH_H
#define SHEF_PIPELINE_FLOW_SEARCH_H

#include <stdint.h>

#include "calib/rectification.h"
#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FLOW_DIRECTIONS 16

struct shef_flow_search_params {
    double first_disparity_px; /* 0..128, of the profile */
    double last_disparity_px;
    double min_significance; /* below: no motion; standard deviations, 0 or more */
    double sure_margin;      /* below: the direction is not sure; 0..1 */
};

/* Disparities 4..48 px at f 555, more in proportion to f. */
struct shef_flow_search_params shef_flow_search_default_params(
    const struct shef_rectification *profile);

enum shef_flow_state {
    SHEF_FLOW_NONE,   /* no motion that events and frame agree on */
    SHEF_FLOW_UNSURE, /* some, but two directions explain it nearly as well */
    SHEF_FLOW_FOUND,
};

struct shef_flow {
    enum shef_flow_state state;
    /* The best direction, whatever the state; 0 if there are no edges at all. */
    double direction_rad;      /* of the flow of the picture, 0: right, pi/2: down; -pi..pi */
    double camera_velocity[3]; /* the opposite of it, of length 1, z 0: what frame_edges.h takes.
                                * Motion along z beside it turns the flow a little from place to
                                * place and is not found; motion along z alone is not, either */
    double score;  /* mean correlation of the blocks at the best of the 16 directions, 0..1 */
    double margin; /* share of the score that the best direction 90 degrees or more away lacks,
                    * 0..1 */
    double significance; /* of the lead over the opposite direction, over all blocks, in standard
                          * deviations; by chance seldom above 3 */
    double direction_scores[SHEF_FLOW_DIRECTIONS]; /* of flow along k * 22.5 degrees */
};

struct shef_flow_search;

/* Allocates the work space.                                       Thread: setup.
 *   profile  width, height and f are used; sides of 64 px or more
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_flow_search_create(struct shef_flow_search **out_search,
                                                      const struct shef_rectification *profile,
                                                      const struct shef_flow_search_params *params,
                                                      uint32_t cpu_features,
                                                      struct shef_error *err);

/* NULL is allowed. */
void shef_flow_search_destroy(struct shef_flow_search *search);

/* Finds the direction.
 *   image   rectified left frame
 *   events  graded map of the filter's values around the same mid-exposure (event_edges.h); best
 *           without a shift, as the shift needs the direction */
void shef_flow_search_run(struct shef_flow_search *search, struct shef_image_u8 image,
                          const struct shef_edge_map *events, struct shef_flow *out_flow);

/* The instruction set that was picked: "avx512", "avx2", "neon" or "c". */
const char *shef_flow_search_isa(const struct shef_flow_search *search);

#ifdef __cplusplus
}
#endif

#endif
