/* Time measurement for reports: wall clock, thread CPU time, and summaries of many readings.
 * Thread: any; one struct shef_timings belongs to one thread. */
#ifndef SHEFTOOL_STOPWATCH_H
#define SHEFTOOL_STOPWATCH_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* CLOCK_MONOTONIC, ns. */
int64_t shef_monotonic_ns(void);

/* CPU time that the calling thread has used, ns. */
int64_t shef_stopwatch_cpu_ns(void);

/* A growing list of durations of one kind of work. Zero it to start. */
struct shef_timings {
    int64_t *ns; /* owned */
    size_t n;
    size_t capacity;
};

struct shef_timing_summary {
    double median_ms;
    double p95_ms; /* the smallest reading that at least 95 % of the readings do not exceed */
    double min_ms;
};

/* SHEF_ERR_NO_MEMORY: the reading is lost. */
SHEF_MUST_CHECK enum shef_err shef_timings_add(struct shef_timings *timings, int64_t ns);

/* Sorts the readings and summarises them; all zero if there are none. The median of an even
 * number of readings is the mean of the middle two. */
struct shef_timing_summary shef_timings_summary(struct shef_timings *timings);

void shef_timings_free(struct shef_timings *timings);

#ifdef __cplusplus
}
#endif

#endif
