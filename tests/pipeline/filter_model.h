/* The filter in double precision and without tricks, to compare with.
 *
 * Thread: the test's own. */
#ifndef SHEF_TESTS_FILTER_MODEL_H
#define SHEF_TESTS_FILTER_MODEL_H

#include "pipeline/filter.h"
#include "support/support.h"

struct shef_test_model {
    struct shef_filter_params params;
    double *levels; /* in contrast steps, just after the pixel's newest event */
    int64_t *t_us;
    int64_t *sums;    /* of signed gains, in 1/256 contrast step */
    double worst_c;   /* the largest error found by shef_test_model_compare */
    double largest_c; /* the largest level compared */
};

struct shef_test_model shef_test_model_create(const struct shef_filter_params *params);
void shef_test_model_destroy(struct shef_test_model *model);

/* One event that the filter applies, times as a batch has them. */
void shef_test_model_apply(struct shef_test_model *model, struct shef_event event, int64_t base_us);

/* The level of one pixel in contrast steps. */
double shef_test_model_level(const struct shef_test_model *model, int32_t x_px, int32_t y_px,
                             int64_t at_us);

/* Compares one pixel's level, or every pixel's, at an instant and keeps the largest difference. */
void shef_test_model_compare_pixel(struct shef_test_model *model, const struct shef_filter *filter,
                                   int32_t x_px, int32_t y_px, int64_t at_us);
void shef_test_model_compare(struct shef_test_model *model, const struct shef_filter *filter,
                             int64_t at_us);

static inline shef_event_time shef_test_us(int64_t us)
{
    return (shef_event_time){ us * SHEF_NS_PER_US };
}

#define SHEF_TEST_FOREVER ((shef_event_time){ INT64_MAX })

/* A filter with these parameters, or the test fails. */
struct shef_filter *shef_test_filter(const struct shef_filter_params *params);

/* Applies one event that must be used up. */
void shef_test_apply_one(struct shef_filter *filter, int64_t t_us, uint32_t x_px, uint32_t y_px,
                         bool on);

/* The instruction sets of this processor.  Returns how many, 1 to 3. */
int shef_test_features(uint32_t out_features[4]);

#endif
