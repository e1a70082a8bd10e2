#include "record/recorded_clock.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "record/block_reader.h"
#include "record/event_part.h"

/* The soonest arrivals of so many stretches make the line. */
#define N_STRETCHES 16

struct soonest {
    bool is_set;
    double event_ns;
    double delay_ns; /* host minus event */
};

/* Slope and height of the line through delays, by least squares. */
static void fit_line(const struct soonest *at, struct shef_recorded_clock *clock)
{
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;

    for (int i = 0; i < N_STRETCHES; i++) {
        if (!at[i].is_set)
            continue;
        const double u = at[i].event_ns - (double)clock->event.ns;
        const double v = at[i].delay_ns - at[0].delay_ns;

        n += 1;
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
    }
    const double spread = xx - x * x / n;
    const double slope = n > 1 && spread > 0 ? (xy - x * y / n) / spread : 0;
    /* Clocks of crystals: more is jitter over a short recording. */
    const double least = fmin(fmax(slope, -200e-6), 200e-6);

    clock->rate = 1 + least;
    clock->host.ns = clock->event.ns + (int64_t)llrint(at[0].delay_ns + (y - least * x) / n);
    clock->is_known = true;
}

enum shef_err shef_recorded_clock_read(const char *recording, struct shef_recorded_clock *out_clock,
                                       struct shef_error *err)
{
    char folder[PATH_MAX];
    struct soonest at[N_STRETCHES] = { { false } };
    struct shef_recorded_clock clock = { .rate = 1 };
    struct shef_block_reader *reader;
    struct shef_block block;

    if (snprintf(folder, sizeof folder, "%s/" SHEF_EVENT_FOLDER, recording) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "read '%s': the path is too long", recording);

    enum shef_err code = shef_block_reader_open(folder, SHEF_PART_EVENTS, SHEF_EVENT_ENDING,
                                                SHEF_EVENT_BLOCK_MAX_BYTES, &reader, err);

    if (code != SHEF_OK)
        return code;

    const struct shef_block_summary *summary = shef_block_reader_summary(reader);

    if (summary->has_blocks) {
        const int64_t first_us = summary->first.last_us;
        const double span_us = (double)summary->last.last_us - (double)first_us + 1;

        clock.starts_whole = summary->first.number == 0 && summary->first.n_lost_before == 0;
        clock.event.ns = first_us * SHEF_NS_PER_US;
        clock.last_event.ns = summary->last.last_us * SHEF_NS_PER_US;
        clock.first_arrived = summary->first.arrived;
        clock.last_arrived = summary->last.arrived;
        while ((code = shef_block_reader_next(reader, NULL, &block, err)) == SHEF_OK) {
            const double since_us = (double)block.record.last_us - (double)first_us;
            const double event_ns = (double)block.record.last_us * SHEF_NS_PER_US;
            const double delay_ns = (double)block.record.arrived.ns - event_ns;

            /* Where event time has been set back, what lies outside tells nothing. */
            if (since_us < 0 || since_us >= span_us)
                continue;

            struct soonest *soonest = &at[(int)(since_us / span_us * N_STRETCHES)];

            if (!soonest->is_set || delay_ns < soonest->delay_ns)
                *soonest = (struct soonest){ true, event_ns, delay_ns };
        }
        if (at[0].is_set)
            fit_line(at, &clock);
    }
    shef_block_reader_close(reader);
    *out_clock = clock;
    return code == SHEF_ERR_EMPTY || code == SHEF_OK ? SHEF_OK : code;
}

shef_host_time shef_recorded_clock_host(const struct shef_recorded_clock *clock,
                                        shef_event_time event)
{
    const double since_ns = (double)shef_event_time_since(event, clock->event);

    return shef_host_time_add(clock->host, llrint(since_ns * clock->rate));
}
