#include "shefsim/sensor_options.h"

#include <assert.h>

#include "core/words.h"

#define MIN_THRESHOLD 0.01

struct sim_event_sensor_params sim_sensor_options_params(const struct sim_sensor_options *options)
{
    struct sim_event_sensor_params params = { .threshold_on = 0 };
    char name[32];

    if (!shef_words_at(SIM_EVENT_SENSOR_PRESETS, options->noise, name, sizeof name) ||
        !sim_event_sensor_preset(name, &params))
        assert(!"every name in the list is a preset");
    if (options->threshold > 0) {
        params.threshold_on = options->threshold;
        params.threshold_off = options->threshold;
    }
    if (options->threshold_off > 0)
        params.threshold_off = options->threshold_off;
    return params;
}

static enum shef_err check(const char *name, double threshold, struct shef_error *err)
{
    return threshold == 0 || threshold >= MIN_THRESHOLD
               ? SHEF_OK
               : shef_fail(err, SHEF_ERR_INVALID, "--%s is %g, but must be 0 or at least %g", name,
                           threshold, MIN_THRESHOLD);
}

enum shef_err sim_sensor_options_check(const struct sim_sensor_options *options,
                                       struct shef_error *err)
{
    const enum shef_err code = check("threshold", options->threshold, err);

    return code == SHEF_OK ? check("threshold-off", options->threshold_off, err) : code;
}
