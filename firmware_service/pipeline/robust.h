/* The robust matcher: disparity of a left (frame) and a right (event) edge map.
 *
 * Normalised window correlation (ZNCC) on the half grid, a temporal prior carried from the
 * previous pair, semi-global aggregation along four paths, a sub-pixel fit, and a read-out at
 * the left view's edge pixels with a calibrated confidence; if wanted, outlines at jumps of depth
 * put right pixel by pixel. It differs from the paper's method
 * (paper.h) in every step but the idea; docs/matcher.md says why, with measurements.
 *
 * Memory is allocated once, by create(). match() allocates nothing and locks nothing; its result
 * is the same for every number of workers and every instruction set.
 * Thread: create and destroy: setup; match and the setters: one caller at a time. */
#ifndef SHEF_PIPELINE_ROBUST_H
#define SHEF_PIPELINE_ROBUST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "pipeline/align.h"
#include "pipeline/edge_map.h"
#include "pipeline/smooth_field.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_ROBUST_MAX_SIDE_PX  4096
#define SHEF_ROBUST_MAX_REACH_PX 4

struct shef_robust_params {
    int32_t width_px;             /* of both maps, 32..SHEF_ROBUST_MAX_SIDE_PX */
    int32_t height_px;            /* 32..SHEF_ROBUST_MAX_SIDE_PX */
    int32_t max_disparity_px;     /* candidates step, 2 step, .. max; 16..256, below the width */
    int32_t step_px;              /* between candidates: 2, or 1 for small ranges */
    int32_t window_width_cells;   /* odd, 1..31; a cell is 2x2 px */
    int32_t window_height_cells;  /* odd, 1..31 */
    enum shef_edge_kind kind;     /* of every map given to match() */
    double regularisation;        /* share of the largest variance added to each; 0.005..0.5 */
    int32_t p1;                   /* cost of a step of one level along a path; 500 = uncorrelated */
    int32_t p2;                   /* cost of any larger jump; p1..4000 */
    double score_weight;          /* of the pair's own costs in the sub-pixel fit, beside the path
                                   * sums; 0: sums alone; 0..64 */
    bool use_past;                /* carry a prior from pair to pair */
    double prior_cost_per_px;     /* 0..64, for a fully confident previous disparity */
    double saturated_cost_per_px; /* the same where the event map is saturated */
    double prior_cap_px;          /* differences count up to here; at most 31 */
    double confidence_scale;      /* of the confidence's logit, 0.1..10: fits it to another image */
    double confidence_offset;     /* scale, kind of map or limit of error; -10..10 */
    double saturated_share;       /* an event map with more edge pixels than this is saturated */
    int32_t jump_reach_px;      /* how far the outline at a jump of depth may be moved to where the
                                 * pixels want it, 0..SHEF_ROBUST_MAX_REACH_PX; 0: it stays */
    double jump_least_px;       /* what counts as a jump, 0.25..16 */
    double jump_picture_weight; /* of a step of brightness there, 0..64; evidence of the maps that
                                 * one place holds is at most 14 */
    double jump_growth_cost;    /* for each pixel that the nearer surface grows by, 0..64 */
};

/* What runs live: unsigned maps, 80 px in steps of 2, window 38x18 px.
 * Graded and ternary maps: a window of 14x14 px (signs need less support). Outlines stay. */
struct shef_robust_params shef_robust_defaults(int32_t width_px, int32_t height_px,
                                               enum shef_edge_kind kind);

struct shef_edge_pair {
    const struct shef_edge_map *left;  /* frame edges, the reference view */
    const struct shef_edge_map *right; /* event edges: left(x, y) matches right(x - d, y) */
    /* The left view itself, of the same size, for the outlines at jumps of depth; data NULL: they
     * go by the maps alone. That of the first pair counts. */
    struct shef_image_u8 picture;
};

/* Where the results go: images of the matcher's size. Those with data NULL are skipped.
 * Left edge pixels are those of the first pair. Graded ones count from half a grade on: the
 * matcher works on at most 15 grades each way (12 in the default window: |value| >= 6 of 127). */
struct shef_robust_output {
    struct shef_image_f32 disparity;        /* px at left edge pixels; 0 = none */
    struct shef_image_f32 confidence;       /* P(|error| <= 3 px after the declared bias), 0..1 */
    struct shef_image_f32 dense_disparity;  /* px at every pixel */
    struct shef_image_f32 dense_confidence; /* 0..1 */
};

enum shef_robust_stage {
    SHEF_ROBUST_PREPARE,   /* bytes, alignment */
    SHEF_ROBUST_CORRELATE, /* window sums, costs, prior, horizontal paths */
    SHEF_ROBUST_AGGREGATE, /* vertical paths, winner */
    SHEF_ROBUST_READ_OUT,  /* confidence, edge pixels, dense */
    SHEF_ROBUST_OBSERVE,   /* vertical residual for the next pair */
    SHEF_ROBUST_N_STAGES,
};

/* A stage's name for reports, e.g. "correlate". */
const char *shef_robust_stage_name(enum shef_robust_stage stage);

struct shef_robust_report {
    int64_t stage_ns[SHEF_ROBUST_N_STAGES];
    double right_share; /* of the first right map's pixels that are edges */
    bool is_saturated;  /* right_share is above the limit */
    bool used_past;     /* the prior came from the previous pair */
    bool is_cut;        /* the left map no longer resembles the previous one: prior dropped */
    struct shef_smooth_field alignment; /* vertical residual applied to this pair, px */
    double alignment_spread_px;         /* of the block measurements about the field; 0: not auto */
};

struct shef_robust;

/* Allocates everything match() needs.
 *   cpu_features  core/cpu.h; fewer bits force a lesser instruction set
 *   workers       may be NULL (one thread); must outlive the matcher
 * NULL and a sentence in err: a parameter out of range, or out of memory. */
struct shef_robust *shef_robust_create(const struct shef_robust_params *params,
                                       uint32_t cpu_features, struct shef_workers *workers,
                                       struct shef_error *err);

/* The same, but the volumes, most of a matcher's memory, are those of another matcher.
 *   lender  for images of the same size, the same step and at least the same range of disparities;
 *           must outlive this one and must not match at the same time; NULL: none */
struct shef_robust *shef_robust_create_beside(const struct shef_robust_params *params,
                                              uint32_t cpu_features, struct shef_workers *workers,
                                              const struct shef_robust *lender,
                                              struct shef_error *err);

/* Bytes allocated by create(), without what is lent. */
size_t shef_robust_memory_bytes(const struct shef_robust *matcher);

/* The instruction set the kernels use, e.g. "avx512". */
const char *shef_robust_isa(const struct shef_robust *matcher);

/* How the vertical residual is corrected, from the next pair on.
 *   auto   measured from past pairs; the very first pair is matched once to measure, then again
 *   fixed  the given field, of the matcher's size; NULL: none */
void shef_robust_align_auto(struct shef_robust *matcher);
void shef_robust_align_fixed(struct shef_robust *matcher, const struct shef_smooth_field *field);

/* Subtracts a declared bias (bias.h) of the matcher's size from every disparity read out; NULL:
 * none. */
void shef_robust_set_bias(struct shef_robust *matcher, const struct shef_smooth_field *bias);

/* Searches only 1 step .. max_disparity_px, from the next pair on: less work when time is short.
 *   max_disparity_px  16 .. the parameters' own; rounded down to whole steps */
void shef_robust_set_max_disparity(struct shef_robust *matcher, int32_t max_disparity_px);

/* Matches one pair, or two pairs of the same views whose scores are averaged.
 *   pairs    n_pairs (1 or 2) pairs of the matcher's size and kind
 *   number   the pair's place in its sequence; the past is used only from number - 1
 *   report   may be NULL */
void shef_robust_match(struct shef_robust *matcher, const struct shef_edge_pair *pairs,
                       int32_t n_pairs, int64_t number, const struct shef_robust_output *output,
                       struct shef_robust_report *report);

/* Forgets the past: the next pair starts a new sequence. A measured alignment is kept. */
void shef_robust_reset(struct shef_robust *matcher);

/* NULL is allowed. */
void shef_robust_destroy(struct shef_robust *matcher);

#ifdef __cplusplus
}
#endif

#endif
