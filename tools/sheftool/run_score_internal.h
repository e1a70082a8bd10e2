/* A scorer's memory; only run_score.c and run_score_truth.c include this. */
#ifndef SHEFTOOL_RUN_SCORE_INTERNAL_H
#define SHEFTOOL_RUN_SCORE_INTERNAL_H

#include "pipeline/frame_edges.h"
#include "pipeline/frame_rectify.h"
#include "sheftool/run_score.h"

#define FIGURE_F_PX 555.0 /* errors in px are of this focal length */

/* Where a pixel of the true view lies in the estimates', and what to make of their depth. */
struct lookup {
    int32_t at;     /* y * width + x; -1: outside */
    float z_factor; /* true z over their z */
};

struct scored_pixel {
    float error_px; /* of f 555 px; infinite: none */
    float relative; /* (Z - Z_true) / Z_true */
    float confidence;
    bool is_away;
    bool is_within_sigma;
};

struct shef_run_scorer {
    struct shef_recorded_truth truth;
    struct shef_recorded_frames *frames;
    struct shef_frame_rectify *rectify;
    struct shef_frame_edges *edges;
    struct shef_edge_map map;
    struct shef_image_u8 picture;
    struct lookup *lookups; /* NULL: the views are the same */
    double f_px;            /* of the estimates */
    double baseline_m;
    struct scored_pixel *pixels;

    struct shef_truth_maps maps; /* of the loaded frame */
    uint8_t *near_jump;
    struct shef_image_f32 scored_truth;
    struct shef_image_f32 estimate;
    double velocity_m_s[3];
    enum shef_run_direction direction;
};

#endif
