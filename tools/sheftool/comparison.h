/* The whole comparison: the paper's rows, ours and OpenCV's on the same maps.
 *
 * What `sheftool table` runs and shows. Every row is one matcher under one protocol; all rows see
 * the same pairs, on one thread. Thread: main. */
#ifndef SHEFTOOL_COMPARISON_H
#define SHEFTOOL_COMPARISON_H

#include <jansson.h>
#include <stdio.h>

#include "sheftool/dataset.h"
#include "sheftool/evaluation.h"
#include "sheftool/matching.h"

/* A row that is cited, not measured. NaN: the source does not say. */
struct shef_cited_row {
    const char *name;
    const char *conditions;
    double rmse_px;
    double bad_p_percent;
    double delta[SHEF_N_DELTAS];
    double ms_per_frame;
};

#define SHEF_N_CITED 3
extern const struct shef_cited_row shef_cited_rows[SHEF_N_CITED];

/* What a measured row does; see the table in comparison.c. */
struct shef_row_plan {
    const char *name;
    const char *conditions; /* protocol, alignment and truth used, for the reader */
    const struct shef_matcher_kind *kind;
    enum shef_protocol_index protocol;
    bool filter;
    bool dense;
    enum shef_align_mode align;
    bool gives_bias;   /* the bias is fitted on its estimates; rows with .bias below it use it */
    bool bias;         /* subtracted: fitted with truth on all other scenes */
    bool filter_timed; /* the filter is a part of the method: its first pass counts */
};

#define SHEF_N_ROWS 10
extern const struct shef_row_plan shef_row_plans[SHEF_N_ROWS];

struct shef_row {
    const struct shef_row_plan *plan;
    bool present; /* false: could not be run on these data; `why` says so */
    char why[160];
    struct shef_evaluation evaluation;
    struct shef_timing_summary frame;  /* of the matcher */
    struct shef_timing_summary filter; /* of the filter's first pass; zero if it is not timed */
    struct shef_image_f32 samples[SHEF_MAX_SCENES]; /* the scored map of each scene's sample */
};

struct shef_comparison {
    const struct shef_dataset *dataset; /* borrowed */
    struct shef_score_rules rules;
    int32_t max_disparity_px;
    uint32_t cpu_features;
    size_t sample_index[SHEF_MAX_SCENES]; /* the pair shown of each scene, the middle one */
    struct shef_smooth_field alignment;   /* fitted on all pairs, without truth */
    double alignment_spread_px;
    struct shef_smooth_field biases[SHEF_MAX_SCENES]; /* for each scene, from the other scenes, of
                                                       * the last row that gave one */
    bool has_bias;
    struct shef_row rows[SHEF_N_ROWS];
};

/* Runs every row. The data set must have truth.
 * On failure everything is already freed. */
SHEF_MUST_CHECK enum shef_err shef_comparison_run(struct shef_comparison *out_comparison,
                                                  const struct shef_dataset *dataset,
                                                  const struct shef_score_rules *rules,
                                                  int32_t max_disparity_px, struct shef_error *err);

void shef_comparison_destroy(struct shef_comparison *comparison);

/* The table as Markdown. */
void shef_comparison_print(struct shef_comparison *comparison, FILE *out);

/* Everything that was measured; NULL: out of memory. */
json_t *shef_comparison_json(struct shef_comparison *comparison);

/* Draws one sample of each scene by every row and writes the sheet as a PNG. */
SHEF_MUST_CHECK enum shef_err shef_comparison_draw(struct shef_comparison *comparison,
                                                   const char *path, struct shef_error *err);

#endif
