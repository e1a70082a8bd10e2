/* Runs one matcher over the pairs of a data set, in order, and times every stage.
 *
 * What `match` and `table` share: load a pair, match it, hand the result to a function, count the
 * time. Only the matcher's own work is timed, not reading or writing files. Thread: main. */
#ifndef SHEFTOOL_MATCHING_H
#define SHEFTOOL_MATCHING_H

#include <jansson.h>

#include "core/memory.h"
#include "sheftool/dataset.h"
#include "sheftool/matcher.h"
#include "sheftool/stopwatch.h"

struct shef_matching {
    const struct shef_dataset *dataset; /* borrowed */
    const struct shef_matcher_kind *kind;
    struct shef_matcher_settings settings;
    void *matcher;
    struct shef_edge_map frame;
    struct shef_edge_map event;
    struct shef_edge_map aligned; /* the event map moved by a fixed field */
    struct shef_match_output output;
    struct shef_timings stages[SHEF_MATCHER_MAX_STAGES];
    struct shef_timings total;
    struct shef_timings cpu; /* of the calling thread */
};

/* One matched pair, lent to the receiver. */
struct shef_matched {
    size_t index; /* in the data set */
    int64_t number;
    const struct shef_edge_map *frame;
    const struct shef_edge_map *event;
    struct shef_image_f32 disparity;
    struct shef_image_f32 confidence;        /* data NULL: the matcher has none */
    const struct shef_robust_report *report; /* NULL: the matcher gives none */
    int64_t total_ns;
};

/* Takes a result; an error ends the run. */
typedef enum shef_err shef_matched_fn(void *context, const struct shef_matched *matched,
                                      struct shef_error *err);

/* Makes the matcher for the data set's size.
 *   settings  sizes are filled in here
 * SHEF_ERR_INVALID: the matcher cannot do what the settings ask, or a field is for another size. */
SHEF_MUST_CHECK enum shef_err shef_matching_create(struct shef_matching *out_matching,
                                                   const struct shef_dataset *dataset,
                                                   const struct shef_matcher_kind *kind,
                                                   const struct shef_matcher_settings *settings,
                                                   struct shef_error *err);

void shef_matching_destroy(struct shef_matching *matching);

/* Matches all pairs in the order of their numbers, with a progress bar. A pair whose event map is
 * empty gets no estimates: it is not given to the matcher, takes 0 ms and is not counted in the
 * times; the next pair starts without a past.
 *   what  for the bar, "matching" */
SHEF_MUST_CHECK enum shef_err shef_matching_run(struct shef_matching *matching, const char *what,
                                                shef_matched_fn *receive, void *context,
                                                struct shef_error *err);

/* Median, p95 and min in ms of every stage and of the whole, as JSON. */
json_t *shef_matching_timing_json(struct shef_matching *matching);

#endif
