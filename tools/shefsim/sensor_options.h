/* The options about the event sensor that several commands have. Thread: main. */
#ifndef SHEFSIM_SENSOR_OPTIONS_H
#define SHEFSIM_SENSOR_OPTIONS_H

#include <stdint.h>

#include "core/error.h"
#include "sheftool/option.h"
#include "shefsim/event_sensor.h"

struct sim_sensor_options {
    int32_t noise; /* index in SIM_EVENT_SENSOR_PRESETS */
    double threshold;
    double threshold_off;
};

/* Rows for a command's table; its settings have a struct sim_sensor_options `sensor`. */
#define SIM_SENSOR_OPTIONS(type_)                                                                  \
    SHEF_OPT_CHOICE("noise", type_, sensor.noise, SIM_EVENT_SENSOR_PRESETS, "typical",             \
                    "mismatch, dead time, latency, jitter, leak, background, hot pixels and "      \
                    "read-out of the event sensor"),                                               \
        SHEF_OPT_REAL("threshold", type_, sensor.threshold, "0", 0, 10, NULL,                      \
                      "change of ln(light) that makes an event; 0: the preset's, 0.3 or 0.35"),    \
        SHEF_OPT_REAL("threshold-off", type_, sensor.threshold_off, "0", 0, 10, NULL,              \
                      "the same for OFF events; 0: as ON")

/* What the options mean. */
struct sim_event_sensor_params sim_sensor_options_params(const struct sim_sensor_options *options);

/* SHEF_ERR_INVALID: a threshold that is neither 0 nor possible. */
SHEF_MUST_CHECK enum shef_err sim_sensor_options_check(const struct sim_sensor_options *options,
                                                       struct shef_error *err);

#endif
