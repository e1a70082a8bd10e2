/* Fitting the two smooth fields of a data set: the vertical residual between its maps, from the
 * maps alone, and the disparity bias against its truth. Thread: main. */
#ifndef SHEFTOOL_FITTING_H
#define SHEFTOOL_FITTING_H

#include "pipeline/bias.h"
#include "sheftool/matching.h"

/* Measures the vertical residual over all pairs of a data set, every row of every pair.
 *   settings       search range, instruction set and workers of the matcher that pairs the pixels
 *   out_spread_px  median distance of the measured blocks from the field
 * SHEF_ERR_EMPTY: too little texture. Also what loading a pair can fail with. */
SHEF_MUST_CHECK enum shef_err shef_fit_alignment(const struct shef_dataset *dataset,
                                                 const struct shef_matcher_settings *settings,
                                                 struct shef_smooth_field *out_field,
                                                 double *out_spread_px, struct shef_error *err);

/* Estimates and truths of many pairs, kept in memory: 8 bytes a pixel and pair. */
struct shef_bias_collection {
    struct shef_bias_sample *samples; /* n, owned with their images */
    int64_t *numbers;                 /* n, of the pairs */
    int32_t n;
    int32_t capacity;
};

/* Copies a matched map and reads the truth beside it. */
SHEF_MUST_CHECK enum shef_err shef_bias_collect(struct shef_bias_collection *collection,
                                                const struct shef_dataset *dataset,
                                                const struct shef_matched *matched,
                                                struct shef_error *err);

/* Fits the bias over all collected pairs but those numbered first..last (first > last: all).
 * SHEF_ERR_EMPTY: too few pixels. */
SHEF_MUST_CHECK enum shef_err shef_bias_fit_without(const struct shef_bias_collection *collection,
                                                    int64_t first, int64_t last, float hole_px,
                                                    struct shef_smooth_field *out_bias,
                                                    struct shef_error *err);

void shef_bias_collection_free(struct shef_bias_collection *collection);

#endif
