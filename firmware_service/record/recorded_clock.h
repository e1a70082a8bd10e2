/* Host time from event time in a recording: for joining what came by other ways.
 *
 * The events' index says when each buffer arrived and how far event time had come. Buffers arrive
 * late, never early, so the line through the soonest arrivals is taken: to within a millisecond or
 * so, which is enough for poses at 125 Hz. Frames never come this way. Thread: any. */
#ifndef SHEF_RECORD_RECORDED_CLOCK_H
#define SHEF_RECORD_RECORDED_CLOCK_H

#include <stdbool.h>

#include "core/error.h"
#include "core/time.h"

struct shef_recorded_clock {
    bool is_known;
    shef_event_time event; /* an anchor */
    shef_host_time host;
    double rate;                /* host over event */
    bool starts_whole;          /* the first buffer of all was kept */
    shef_event_time last_event; /* reached by the last buffer */
    shef_host_time first_arrived;
    shef_host_time last_arrived;
};

/* Reads the events' index. SHEF_OK also where too little is there: is_known then says so. */
SHEF_MUST_CHECK enum shef_err shef_recorded_clock_read(const char *recording,
                                                       struct shef_recorded_clock *out_clock,
                                                       struct shef_error *err);

shef_host_time shef_recorded_clock_host(const struct shef_recorded_clock *clock,
                                        shef_event_time event);

#endif
