#include <string.h>

#include "core/time.h"
#include "shefsim/event_sensor_parts.h"
#include "shefsim/ranges.h"

/* 66 million events a second is what Prophesee states for its VGA sensor. */
#define FASTEST_EVENT_NS 15

bool sim_event_sensor_preset(const char *name, struct sim_event_sensor_params *out_params)
{
    struct sim_event_sensor_params params = {
        .threshold_on = 0.30,
        .threshold_off = 0.30,
        .dark = 0.01,
        .hot_min_hz = 100,
        .hot_max_hz = 500,
        .readout = { .row_ns = 40, .event_ns = FASTEST_EVENT_NS, .capacity = 16384 },
    };

    if (strcmp(name, "typical") == 0) {
        params.mismatch = 0.10;
        params.dead_time_ns = 100 * SHEF_NS_PER_US;
        params.latency_ns = 100 * SHEF_NS_PER_US;
        params.jitter_ns = 40 * SHEF_NS_PER_US;
        params.leak_hz = 0.05;
        params.background_hz = 1;
        params.hot_share = 0.001;
        params.readout.is_limited = true;
    } else if (strcmp(name, "hard") == 0) {
        params.threshold_on = 0.35;
        params.threshold_off = 0.35;
        params.mismatch = 0.20;
        params.dead_time_ns = 300 * SHEF_NS_PER_US;
        params.latency_ns = 300 * SHEF_NS_PER_US;
        params.jitter_ns = 100 * SHEF_NS_PER_US;
        params.leak_hz = 0.2;
        params.background_hz = 5;
        params.hot_share = 0.003;
        params.readout.is_limited = true;
        params.readout.event_ns = 4 * FASTEST_EVENT_NS;
    } else if (strcmp(name, "clean") != 0) {
        return false;
    }
    *out_params = params;
    return true;
}

enum shef_err sim_event_sensor_check(const struct sim_event_sensor_params *params,
                                     struct shef_error *err)
{
    const struct sim_range ranges[] = {
        { "the ON threshold", params->threshold_on, 0.01, 10 },
        { "the OFF threshold", params->threshold_off, 0.01, 10 },
        { "the mismatch of thresholds", params->mismatch, 0, 0.5 },
        { "the dark light", params->dark, SIM_DARK_MIN, 1 },
        { "the dead time in ns", (double)params->dead_time_ns, 0, 1e9 },
        { "the latency in ns", (double)params->latency_ns, 0, 1e7 },
        { "the jitter in ns", (double)params->jitter_ns, 0, 1e6 },
        { "the leak in Hz", params->leak_hz, 0, 100 },
        { "the background in Hz", params->background_hz, 0, 1000 },
        { "the share of hot pixels", params->hot_share, 0, 0.1 },
        { "the lowest rate of hot pixels in Hz", params->hot_min_hz, 1, 1000 },
        { "the highest rate of hot pixels in Hz", params->hot_max_hz, params->hot_min_hz, 1000 },
        { "the time of a row in ns", (double)params->readout.row_ns, 0, 1e5 },
        { "the time of an event in ns", (double)params->readout.event_ns, 1, 1e5 },
        { "the read-out's capacity", params->readout.capacity, 1, SIM_READOUT_MAX_EVENTS },
    };

    return sim_ranges_check("event sensor", ranges, sizeof ranges / sizeof *ranges, err);
}
