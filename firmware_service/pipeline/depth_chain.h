/* From one frame and its snapshot to depth: what the live service and `sheftool run` both do.
 *
 *   frame    -> rectified picture -> edge maps \
 *                                                > matching -> disparity, confidence
 *   snapshot -> rectified edge maps, lag undone /           -> depth, sigma
 *
 * Modes: what is matched, and how.
 *   paper-ds, paper-dp  unsigned maps, the published window correlation and its pyramid
 *   unsigned            the same maps, the robust matcher (robust.h)
 *   ternary, graded     signed maps: the filter's values against the frame's gradient along the
 *                       flow
 *   temporal            signed maps without a motion: the events between two frames against the
 *                       difference of the frames' logarithms, over so many frame intervals that
 *                       the camera travels about travel_m
 *   combined            the scores of graded and temporal, averaged; the default
 *
 * Ternary and graded maps need to know where the scene flows to: from the camera's velocity if it
 * is given, else from the maps themselves (flow_search.h). Where a mode lacks what it needs, the
 * next best one is used, and the report says so: combined and temporal without an earlier frame
 * become graded; without any motion, graded and combined become temporal.
 *
 * The edges in event data trail behind (event_edges.h); where the direction is known, they are
 * moved back by lag_px.
 *
 * create() allocates everything that the listed modes need. process() and the setters allocate,
 * lock and log nothing. Results depend on the inputs and on the frames before, not on workers or
 * instruction set.
 * Thread: create and destroy: setup; the rest: one caller at a time. */
#ifndef SHEF_PIPELINE_DEPTH_CHAIN_H
#define SHEF_PIPELINE_DEPTH_CHAIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "calib/calibration.h"
#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "pipeline/depth.h"
#include "pipeline/edge_map.h"
#include "pipeline/frame_rectify.h"
#include "pipeline/robust.h"
#include "pipeline/snapshot_pool.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_depth_mode {
    SHEF_DEPTH_PAPER_DS,
    SHEF_DEPTH_PAPER_DP,
    SHEF_DEPTH_UNSIGNED,
    SHEF_DEPTH_TERNARY,
    SHEF_DEPTH_GRADED,
    SHEF_DEPTH_TEMPORAL,
    SHEF_DEPTH_COMBINED,
    SHEF_DEPTH_N_MODES,
};

/* In the order of the enum. */
#define SHEF_DEPTH_MODE_CHOICES "paper-ds|paper-dp|unsigned|ternary|graded|temporal|combined"
#define SHEF_DEPTH_ALL_MODES    ((1u << SHEF_DEPTH_N_MODES) - 1)

/* "combined"; never NULL. */
const char *shef_depth_mode_name(enum shef_depth_mode mode);

/* What may be left out when time is short, in this order (later: cloud and full resolution, which
 * are the publisher's, then whole frames). */
#define SHEF_DEPTH_SHED_DENSE      (1u << 0) /* no dense images: they are left as they were */
#define SHEF_DEPTH_SHED_HALF_RANGE (1u << 1) /* robust modes: the far half of the disparities */
#define SHEF_DEPTH_SHED_SINGLE     (1u << 2) /* combined: only graded */

/* How far edges in event data trail behind the true ones, px of an event sensor of f 555 px, for
 * edges of 0.275 ln per px (the steepest tenth of the picture, along the motion). The chain takes
 * more where edges are flatter and less below 0.15 m/s (depth_motion.c). It grows with the sensor's
 * contrast threshold: this is for 0.3. */
#define SHEF_DEPTH_LAG_PX 0.37

struct shef_depth_params {
    const char *profile;           /* "wide" or "paper"; not kept */
    enum shef_frame_pixels pixels; /* of raw frames */
    enum shef_depth_mode mode;     /* to begin with */
    uint32_t modes;                /* bits (1 << mode) that set_mode() may choose; mode's is in */
    int32_t max_disparity_px;      /* of the profile; 0: 47 for wide, 110 for paper */
    double lag_px;                 /* in px of the event sensor, 0..8 */
    double travel_m;               /* of a temporal pair, 0.001..0.1 */
    double least_speed_m_s;        /* below this the camera counts as standing, 1e-6..1 */
    bool searches_flow;            /* where no velocity is given */
    bool align_auto;               /* measures and takes out a vertical residual */
    bool smooths_in_time;          /* the previous pair's result as a prior */
};

/* wide, Mono8, combined alone, lag SHEF_DEPTH_LAG_PX, 10 mm, 5 mm/s, searches, aligns, does not
 * smooth. */
struct shef_depth_params shef_depth_default_params(void);

struct shef_depth_chain;

/* Allocates everything.                                           Thread: setup.
 *   calibration   not kept
 *   workers       may be NULL; must outlive the chain
 *   cpu_features  usually shef_cpu_features()
 * SHEF_ERR_INVALID: a parameter out of range, or a calibration that makes no stereo pair.
 * SHEF_ERR_NO_MEMORY. Nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_depth_chain_create(struct shef_depth_chain **out_chain,
                                                      const struct shef_calibration *calibration,
                                                      const struct shef_depth_params *params,
                                                      struct shef_workers *workers,
                                                      uint32_t cpu_features,
                                                      struct shef_error *err);

/* NULL is allowed. */
void shef_depth_chain_destroy(struct shef_depth_chain *chain);

/* What the results' geometry is: both rectified views share it. */
struct shef_depth_geometry {
    int32_t width_px;
    int32_t height_px;
    double f_px;
    double cx_px, cy_px;
    double baseline_m;
    int32_t max_disparity_px;
    double r_camera_rectified[9]; /* of the frame camera: T_C_R without a translation */
};

struct shef_depth_geometry shef_depth_chain_geometry(const struct shef_depth_chain *chain);

/* Bytes of the pictures, maps and matchers that create() allocated. */
size_t shef_depth_chain_memory_bytes(const struct shef_depth_chain *chain);

/* From the next frame on.
 * SHEF_ERR_INVALID: the mode was not listed at create(); nothing changed. */
SHEF_MUST_CHECK enum shef_err shef_depth_chain_set_mode(struct shef_depth_chain *chain,
                                                        enum shef_depth_mode mode);

/* SHEF_DEPTH_SHED_... bits, from the next frame on. */
void shef_depth_chain_set_shed(struct shef_depth_chain *chain, uint32_t shed);

/* Forgets earlier frames. */
void shef_depth_chain_reset(struct shef_depth_chain *chain);

struct shef_depth_input {
    int64_t number;                       /* of the frame; one after the other, with gaps */
    struct shef_image_u8 frame;           /* raw, of the calibration's size */
    const struct shef_snapshot *snapshot; /* the frame's */
    bool has_velocity;
    double velocity_m_s[3]; /* of the left camera over the scene, in rectified axes */
};

/* Images of the geometry's size, the caller's. */
struct shef_depth_output {
    struct shef_image_f32 disparity;  /* px at frame edges (unsigned map), 0 = none */
    struct shef_image_f32 confidence; /* P(|error| <= 1 px of f 555 px), 0..1 */
    struct shef_image_f32 depth_m;    /* at the same pixels */
    struct shef_image_f32 sigma_m;
    /* Everywhere; data NULL: not wanted. The paper's modes, whose estimates are at edges, leave
     * them as they were. */
    struct shef_image_f32 dense_disparity;
    struct shef_image_f32 dense_confidence;
};

/* Allocates all images.                                           Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_depth_output_create(struct shef_depth_output *out_output,
                                                       const struct shef_depth_geometry *geometry,
                                                       bool has_dense, struct shef_error *err);

/* A zeroed output is allowed. */
void shef_depth_output_destroy(struct shef_depth_output *output);

enum shef_depth_stage {
    SHEF_DEPTH_PICTURES, /* rectification and both sides' edge maps */
    SHEF_DEPTH_FLOW,     /* search of the direction */
    SHEF_DEPTH_MATCH,
    SHEF_DEPTH_CONVERT, /* depth and sigma */
    SHEF_DEPTH_N_STAGES,
};

/* A stage's name for reports, e.g. "match". */
const char *shef_depth_stage_name(enum shef_depth_stage stage);

#define SHEF_DEPTH_NO_PAST       (1u << 0) /* no earlier frame for a temporal pair */
#define SHEF_DEPTH_NO_MOTION     (1u << 1) /* standing, or no direction was found */
#define SHEF_DEPTH_SEARCHED      (1u << 2) /* the direction comes from the maps */
#define SHEF_DEPTH_IS_SATURATED  (1u << 3) /* too many event edges */
#define SHEF_DEPTH_NO_CONFIDENCE (1u << 4) /* this mode has none: all are 1 */
/* The first frames after a start, a reset or a jump of event time: the filter or the temporal pair
 * has seen less than it is made for, and all depths tend to be too far (docs/accuracy.md). */
#define SHEF_DEPTH_SETTLING (1u << 5)

struct shef_depth_report {
    enum shef_depth_mode mode; /* what was used in the end */
    uint32_t flags;
    uint32_t shed;       /* bits that took effect */
    double direction[3]; /* of the camera's motion, length 1; zero: not known */
    double flow_margin;  /* of a search */
    int32_t span_frames; /* of the temporal pair; 0: none */
    int64_t span_ns;     /* the same */
    int64_t t_err_ns;    /* of the snapshot */
    int64_t n_edges;     /* frame-edge pixels */
    int64_t n_depths;    /* with depth */
    int64_t stage_ns[SHEF_DEPTH_N_STAGES];
    struct shef_robust_report match; /* of robust modes */
};

/* Processes one frame. The snapshot may be given back afterwards.
 *   report  may be NULL */
void shef_depth_chain_process(struct shef_depth_chain *chain, const struct shef_depth_input *input,
                              const struct shef_depth_output *output,
                              struct shef_depth_report *report);

/* What the last frame was made from, for pictures; valid until the next one.
 *   pair  0, or 1 of the combined mode */
struct shef_image_u8 shef_depth_chain_picture(const struct shef_depth_chain *chain);
const struct shef_edge_map *shef_depth_chain_frame_edges(const struct shef_depth_chain *chain);
struct shef_edge_pair shef_depth_chain_pair(const struct shef_depth_chain *chain, int32_t pair);

/* Velocity of the left camera in rectified axes, from what the robot says.
 *   t_world_hand  pose of the tool
 *   speed         of the tool in world axes: m/s, then rad/s */
void shef_depth_velocity(const struct shef_calibration *calibration,
                         const struct shef_depth_geometry *geometry,
                         const struct shef_rigid *t_world_hand, const double speed[6],
                         double out_velocity_m_s[3]);

#ifdef __cplusplus
}
#endif

#endif
