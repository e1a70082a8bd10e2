/* The depth chain's memory; only depth_chain*.c include this.
 *
 *   depth_chain_create.c  parameters -> objects and images
 *   depth_chain.c         the order of the stages, which mode is possible
 *   depth_motion.c        where the camera moves to and how far, told or found
 *   depth_history.c       earlier frames, for temporal pairs */
#ifndef SHEF_PIPELINE_DEPTH_CHAIN_INTERNAL_H
#define SHEF_PIPELINE_DEPTH_CHAIN_INTERNAL_H

#include "pipeline/depth_chain.h"
#include "pipeline/depth_history.h"
#include "pipeline/event_edges.h"
#include "pipeline/flow_search.h"
#include "pipeline/frame_edges.h"
#include "pipeline/kernels/rows.h"
#include "pipeline/paper.h"
#include "pipeline/warp.h"

#define N_KINDS   3 /* of edge maps */
#define N_PAPER   2 /* D_s and D_p */
#define N_SCRATCH 2
#define N_BANDS   16 /* of rows, for the workers */

/* What a mode is made of. */
struct depth_mode {
    const char *name;
    enum shef_edge_kind kind; /* of its maps */
    bool is_paper;
    bool needs_direction;
    bool needs_past;
};

extern const struct depth_mode depth_modes[SHEF_DEPTH_N_MODES];

struct shef_depth_chain {
    /* Set by create, then read-only but for the objects' own state. */
    struct shef_depth_params params;
    struct shef_depth_geometry geometry;
    struct shef_depth_model model;
    struct shef_rectification left;
    struct shef_rectification right;
    struct shef_workers *workers;
    struct shef_warp_map map;
    struct shef_warp_shift shift;
    struct shef_frame_rectify *rectify;
    struct shef_frame_edges *frame_edges;
    struct shef_flow_search *search;               /* NULL: not wanted */
    struct shef_event_edges *event_edges[N_KINDS]; /* NULL: no mode needs them */
    struct shef_robust *robust[N_KINDS];
    struct shef_paper *paper[N_PAPER];
    struct shef_edge_map edges; /* unsigned: where results are read out */
    struct shef_edge_map unsigned_right;
    struct shef_edge_map ternary_left;
    struct shef_edge_map ternary_right;
    struct shef_edge_map graded_left[2]; /* along the flow, temporal */
    struct shef_edge_map graded_right[2];
    struct shef_image_f32 scratch[N_SCRATCH]; /* what the caller does not want */
    const struct shef_row_kernels *rows;
    int8_t *edge_rows; /* one a band */
    size_t memory_bytes;

    /* State between frames. */
    enum shef_depth_mode mode;
    uint32_t shed;
    struct shef_depth_history history;

    /* The frame under way; written before its tasks start. */
    const struct shef_depth_input *input;
    const struct depth_past *now;      /* its slot of the history */
    const struct depth_past *earlier;  /* the temporal pair's; NULL: none */
    const struct shef_warp_shift *lag; /* NULL: no direction is known */
    double direction[3];
    bool is_rectified;
    enum shef_depth_mode used;
    struct shef_edge_pair pairs[2];
    int32_t n_pairs;
    const struct shef_depth_output *output;
    struct shef_image_f32 everywhere; /* disparities; data NULL: output has them at edges */
    struct shef_image_f32 how_sure;   /* their confidences */
    int64_t n_depths[N_BANDS];
};

/* Finds out where the camera moves to, and which earlier frame makes the temporal pair: direction,
 * lag and earlier. Rectifies the picture if it has to look at it.
 *   report  flags, span */
void depth_motion_find(struct shef_depth_chain *chain, struct shef_depth_report *report);

#endif
