/* The clocks of the rig: what each device's own clock shows at a time of the simulation.
 *
 * The simulation counts true time in ns from the start of the recording. Every device started
 * earlier, at an instant of its own; the event camera's clock runs true by definition, the others
 * drift against it. The host's clock is CLOCK_MONOTONIC of a computer that has been up for a while.
 * All is drawn from the seed and written down in truth/. Pure functions. Thread: any. */
#ifndef SHEFSIM_RIG_CLOCKS_H
#define SHEFSIM_RIG_CLOCKS_H

#include <stdint.h>

#include "core/time.h"

struct sim_clock {
    int64_t start_ns; /* what it shows at true time 0 */
    double drift_ppm; /* how much too fast it runs */
    int64_t tick_ns;  /* it shows whole ticks, rounded down; 1: exactly */
};

struct sim_clocks {
    struct sim_clock event;
    struct sim_clock frame;
    struct sim_clock robot;
    struct sim_clock host;
    int64_t utc_minus_host_ns;
};

/* Draws starts (event 1 to 5 s, frame 10 to 110 s, robot 50 to 150 s, host 1000 to 2000 s) and
 * drifts (frame and robot +-30 ppm, host +-10 ppm).
 *   frame_tick_ns  of the frame camera's clock, 1 or more */
struct sim_clocks sim_clocks_draw(uint64_t seed, int64_t frame_tick_ns);

/* What the clock shows. */
int64_t sim_clock_at(const struct sim_clock *clock, int64_t true_ns);

/* When, at the earliest, it shows this: the inverse, to within a tick. */
int64_t sim_clock_when(const struct sim_clock *clock, int64_t shows_ns);

shef_host_time sim_clocks_host(const struct sim_clocks *clocks, int64_t true_ns);

#endif
