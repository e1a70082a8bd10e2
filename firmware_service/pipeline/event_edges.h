/* Event edge maps on the rectified profile, from snapshots on the sensor's pixels.
 *
 *   unsigned  the paper's binary map: the quantile of |value| is the threshold, edges are as thick
 *             as the filter draws them; thin ones (ridges, one pixel wide) as an option
 *   ternary   the same threshold, with the sign: + where brightness rises
 *   graded    value / quantile, clipped to +-1, as int8: live data. Clipped on the sensor's pixels,
 *             before the warp: clipping a value that the warp has spread over two pixels would
 *             move the edge, by up to 0.3 px where events are few
 * The source is either a snapshot's filter values, to be matched with the frame's gradient along
 * the image flow, or the temporal pair: the sum of all events between two mid-exposures, to be
 * matched with the difference of the two frames' logarithms. The pair's sign needs no motion.
 *
 * Nothing allocates, locks or logs after create().
 * Thread: one at a time. */
#ifndef SHEF_PIPELINE_EVENT_EDGES_H
#define SHEF_PIPELINE_EVENT_EDGES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"
#include "pipeline/warp.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How far edges in event data trail behind the true ones along the image flow, in pixels of a
 * sensor of f 555 px: the events' threshold has a dead band. The same at all speeds, but not for
 * all textures: 0.20 for strong contrast, 0.37 for weak (simulated, test_event_edges_motion). A rig
 * measures its own from opposite passes. */
#define SHEF_EVENT_EDGES_LAG_PX 0.26

struct shef_event_edges_params {
    enum shef_edge_kind kind;
    double quantile; /* of |value|, 0.01..0.999: of rectified pixels for bits, of the sensor's
                      * pixels that the profile shows for graded maps */
    double floor_c;  /* but a threshold of at least this many contrast steps, 0.004..100 */
    bool is_thin;    /* only with the unsigned kind */
};

/* Quantile 0.75 for the two kinds of bits, 0.90 for graded ones; a floor of 0.3 steps; thick. */
struct shef_event_edges_params shef_event_edges_default_params(enum shef_edge_kind kind);

struct shef_event_edges;

/* Allocates the work space.                                       Thread: setup.
 *   map           of the sensor that the sources come from; kept and used until destroy()
 *   cpu_features  usually shef_cpu_features()
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_event_edges_create(struct shef_event_edges **out_edges,
                                                      const struct shef_warp_map *map,
                                                      const struct shef_event_edges_params *params,
                                                      uint32_t cpu_features,
                                                      struct shef_error *err);

/* NULL is allowed. */
void shef_event_edges_destroy(struct shef_event_edges *edges);

/* The map of one snapshot.
 *   values   of the sensor's size, SHEF_WARP_PAD_BYTES readable behind them, as snapshots have them
 *   shift    takes the lag back; NULL: none
 *   out_map  of the profile's size and the kind of create() */
void shef_event_edges_of_values(struct shef_event_edges *edges, struct shef_image_i16 values,
                                const struct shef_warp_shift *shift, struct shef_edge_map *out_map);

/* The map of a temporal pair: all events between the mid-exposures of two snapshots of one epoch.
 * Up to 127 contrast steps a pixel are exact.
 *   earlier, later  running sums of the sensor's size */
void shef_event_edges_of_pair(struct shef_event_edges *edges, struct shef_image_i16 earlier,
                              struct shef_image_i16 later, const struct shef_warp_shift *shift,
                              struct shef_edge_map *out_map);

/* What the last map was made from: rectified values in 1/256 contrast step (clipped for a graded
 * map), valid until the next one is made; and its threshold, or what became +-1, in contrast
 * steps. */
struct shef_image_i16 shef_event_edges_values(const struct shef_event_edges *edges);
double shef_event_edges_threshold_c(const struct shef_event_edges *edges);

/* The instruction set that was picked: "avx512", "avx2", "neon" or "c". */
const char *shef_event_edges_isa(const struct shef_event_edges *edges);

#ifdef __cplusplus
}
#endif

#endif
