/* Settings that are numbers within limits. Thread: any. */
#ifndef SHEFSIM_RANGES_H
#define SHEFSIM_RANGES_H

#include <stddef.h>

#include "core/error.h"

struct sim_range {
    const char *name; /* with its unit, "the leak in Hz" */
    double value;
    double min; /* both allowed */
    double max;
};

/* Whether all values lie within their limits.
 *   of  what they belong to, "event sensor"
 * SHEF_ERR_INVALID: the sentence names the first that does not. */
SHEF_MUST_CHECK enum shef_err sim_ranges_check(const char *of, const struct sim_range *ranges,
                                               size_t n_ranges, struct shef_error *err);

#endif
