/* What `match` says at the end about how well the maps went together, so that swapped, empty or
 * unrelated folders are noticed. Thread: main. */
#ifndef SHEFTOOL_MATCH_SUMMARY_H
#define SHEFTOOL_MATCH_SUMMARY_H

#include <stdio.h>

#include "sheftool/matching.h"

/* Sums over all pairs; zeroed at the start. */
struct shef_match_summary {
    int64_t n_pairs;
    int64_t n_edges;   /* frame edge pixels */
    int64_t n_matched; /* of them, those with an estimate */
    double sum_confidence;
    bool has_confidence;
    bool has_report;
    int64_t n_saturated;  /* pairs */
    int64_t n_empty;      /* pairs without a single event edge */
    int64_t first_empty;  /* number of the first of them */
    int64_t n_scene_cuts; /* pairs */
};

/* Adds one pair. */
void shef_match_summary_add(struct shef_match_summary *summary, const struct shef_matched *matched);

/* One line of results.
 *   out  results; what the matcher does not know is left out */
void shef_match_summary_print(const struct shef_match_summary *summary, FILE *out);

/* A line for each sign that the input is not what it should be; none if all is well. */
void shef_match_summary_warn(const struct shef_match_summary *summary, FILE *out);

#endif
