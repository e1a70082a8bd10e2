/* Scores many disparity maps by one protocol, per scene and overall.
 *
 * Maps may come from files or straight from a matcher. Nothing given is kept or changed; the
 * authors' filter works on a copy. Thread: one per evaluation. */
#ifndef SHEFTOOL_EVALUATION_H
#define SHEFTOOL_EVALUATION_H

#include <jansson.h>
#include <stdio.h>

#include "core/memory.h"
#include "pipeline/outlier_authors.h"
#include "sheftool/protocol.h"
#include "sheftool/scenes.h"
#include "sheftool/stopwatch.h"

struct shef_evaluation {
    const struct shef_protocol *protocol;
    struct shef_score_rules rules;
    bool filter;                           /* the authors' outlier filter, radius 50, then 40 */
    bool has_edges;                        /* coverage and the density curve are known */
    const struct shef_scenes *scenes;      /* borrowed */
    struct shef_tally *tallies;            /* one per scene, then the overall one; owned */
    struct shef_density_curve *curves;     /* the same */
    struct shef_depth_counts *depths;      /* the same */
    struct shef_outlier_authors *outliers; /* scratch; NULL until needed */
    struct shef_timings filter_times;      /* of the first pass, per map */
    struct shef_image_f32 filtered;        /* of the same size; data NULL until needed */
};

struct shef_evaluation_settings {
    enum shef_protocol_index protocol;
    bool filter;
    bool has_edges; /* every map comes with its frame edges */
    struct shef_score_rules rules;
};

/* SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_evaluation_create(
    struct shef_evaluation *out_evaluation, const struct shef_evaluation_settings *settings,
    const struct shef_scenes *scenes, struct shef_error *err);

void shef_evaluation_destroy(struct shef_evaluation *evaluation);

/* Scores one map.
 *   number      of the pair; decides the scene
 *   out_scored  what was scored, after the filter, for pictures; may be NULL; valid until the
 *               next call
 * SHEF_ERR_INVALID: narrower than SHEF_MIN_SCORED_WIDTH. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_evaluation_add(struct shef_evaluation *evaluation,
                                                  int64_t number, const struct shef_scored_map *map,
                                                  struct shef_image_f32 *out_scored,
                                                  struct shef_error *err);

/* Sums the scenes up into the overall tally and curve. The functions below call it. */
void shef_evaluation_sum_up(struct shef_evaluation *evaluation);

/* The figures over all images. */
struct shef_figures shef_evaluation_overall(struct shef_evaluation *evaluation);

/* Everything as JSON: protocol, filter, overall, scenes, density_curve, confidence. Shares that
 * people read as per cent end in _percent, deltas are 0..1, what is unknown is null.
 * NULL: out of memory. */
json_t *shef_evaluation_json(struct shef_evaluation *evaluation);

/* One set of figures as JSON. */
json_t *shef_figures_json(const struct shef_figures *figures);

/* Everything as tables for people. */
void shef_evaluation_print(struct shef_evaluation *evaluation, FILE *out);

#endif
