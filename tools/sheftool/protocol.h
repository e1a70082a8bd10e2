/* The ways to score a disparity map.
 *
 *   authors  every estimate counts, truth holes too; the authors' outlier filter belongs to it
 *   density  at frame edges with truth; ranked by confidence, the best 25, 50, 75, 100 % count
 *   dense    every pixel with truth
 *
 * All look at columns 50 .. width - 22 only (0-based; 50..618 at 640 px): the authors zero columns
 * 1..50 and 620..640, counted from 1. Source: the authors' evaluation, and Wang 2021, sec. V.
 * Thread: one per score. */
#ifndef SHEFTOOL_PROTOCOL_H
#define SHEFTOOL_PROTOCOL_H

#include <stdbool.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/edge_map.h"
#include "sheftool/metrics.h"

#define SHEF_FIRST_COLUMN     50
#define SHEF_LAST_MARGIN_PX   22 /* the last column is width - 22 */
#define SHEF_MIN_SCORED_WIDTH 80

/* From here on a truth value marks a hole of the authors' data, px. */
#define SHEF_TRUTH_HOLE_PX 79.9

/* One image to score. All images of one size. */
struct shef_scored_map {
    struct shef_image_f32 disparity;         /* px, 0 = none */
    struct shef_image_f32 confidence;        /* 0..1; data NULL: none */
    struct shef_image_f32 truth;             /* px, 0 = none */
    const struct shef_edge_map *frame_edges; /* NULL: not given */
};

/* What all images of one evaluation share. */
struct shef_score_rules {
    struct shef_rig rig;
    float hole_px; /* truth from here on is a hole */
};

#define SHEF_N_LEVELS 4
extern const int shef_level_percent[SHEF_N_LEVELS]; /* 25, 50, 75, 100 */

/* The density curve: the most confident share of the frame edges, per image. Without confidences
 * only the last level is filled. A level's coverage is the density that is really there. */
struct shef_density_curve {
    struct shef_tally level[SHEF_N_LEVELS];
    bool ranked; /* every image had confidences */
};

/* Scores one image's density curve; frame_edges must be given.
 * SHEF_ERR_NO_MEMORY: the curve is unchanged. */
SHEF_MUST_CHECK enum shef_err shef_density_curve_add(struct shef_density_curve *curve,
                                                     const struct shef_scored_map *map,
                                                     const struct shef_score_rules *rules);

struct shef_protocol {
    const char *name;
    bool filters; /* the authors' filter is on unless the user says otherwise */
    bool needs_edges;
    /* Adds one image, and closes it. */
    void (*add)(struct shef_tally *tally, const struct shef_scored_map *map,
                const struct shef_score_rules *rules);
};

/* In the order of SHEF_PROTOCOL_CHOICES. */
#define SHEF_PROTOCOL_CHOICES "authors|density|dense"
enum shef_protocol_index { SHEF_AUTHORS, SHEF_DENSITY, SHEF_DENSE, SHEF_N_PROTOCOLS };
extern const struct shef_protocol shef_protocols[SHEF_N_PROTOCOLS];

#endif
