#include "shefsim/rig_clocks.h"

#include <assert.h>

#include "shefsim/random.h"

/* 2026-01-01T00:00:00Z: rendered recordings do not depend on the day. */
#define UTC_AT_START_NS (INT64_C(1767225600) * SHEF_NS_PER_S)

enum draw {
    EVENT_START,
    FRAME_START,
    FRAME_DRIFT,
    ROBOT_START,
    ROBOT_DRIFT,
    HOST_START,
    HOST_DRIFT
};

static int64_t between_s(uint64_t key, enum draw draw, double from_s, double to_s)
{
    const double s = from_s + (to_s - from_s) * sim_unit(sim_random(key, draw));

    /* Whole microseconds, so that event times have no remainder. */
    return (int64_t)(s * 1e6) * SHEF_NS_PER_US;
}

static double drift_ppm(uint64_t key, enum draw draw, double most_ppm)
{
    return most_ppm * (2 * sim_unit(sim_random(key, draw)) - 1);
}

struct sim_clocks sim_clocks_draw(uint64_t seed, int64_t frame_tick_ns)
{
    const uint64_t key = sim_key(seed, SIM_STREAM_CLOCK, 0);
    struct sim_clocks clocks = {
        .event = { between_s(key, EVENT_START, 1, 5), 0, 1 },
        .frame = { between_s(key, FRAME_START, 10, 110), drift_ppm(key, FRAME_DRIFT, 30),
                   frame_tick_ns },
        .robot = { between_s(key, ROBOT_START, 50, 150), drift_ppm(key, ROBOT_DRIFT, 30), 1 },
        .host = { between_s(key, HOST_START, 1000, 2000), drift_ppm(key, HOST_DRIFT, 10), 1 },
    };

    assert(frame_tick_ns >= 1);
    clocks.utc_minus_host_ns = UTC_AT_START_NS - clocks.host.start_ns;
    return clocks;
}

int64_t sim_clock_at(const struct sim_clock *clock, int64_t true_ns)
{
    const int64_t drifted_ns = (int64_t)((double)true_ns * clock->drift_ppm * 1e-6);
    const int64_t ns = clock->start_ns + true_ns + drifted_ns;

    return ns - ns % clock->tick_ns;
}

int64_t sim_clock_when(const struct sim_clock *clock, int64_t shows_ns)
{
    const double ns = (double)(shows_ns - clock->start_ns);

    return (int64_t)(ns / (1 + clock->drift_ppm * 1e-6));
}

shef_host_time sim_clocks_host(const struct sim_clocks *clocks, int64_t true_ns)
{
    return (shef_host_time){ sim_clock_at(&clocks->host, true_ns) };
}
