#include "shefsim/ranges.h"

enum shef_err sim_ranges_check(const char *of, const struct sim_range *ranges, size_t n_ranges,
                               struct shef_error *err)
{
    for (size_t i = 0; i < n_ranges; i++)
        if (!(ranges[i].value >= ranges[i].min && ranges[i].value <= ranges[i].max))
            return shef_fail(err, SHEF_ERR_INVALID, "%s: %s is %g, but must be %g to %g", of,
                             ranges[i].name, ranges[i].value, ranges[i].min, ranges[i].max);
    return SHEF_OK;
}
