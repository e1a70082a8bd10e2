/* How long something took, as a histogram that one thread fills and any thread reads.
 *
 * Log-linear: 16 buckets per doubling from 1 us to 68 s, so a percentile is at most 6.25 % too
 * high and never too low. No locks, no allocation; adding costs one bucket increment. The reader
 * takes a copy of the counts and works on that; two copies subtracted give a time window. */
#ifndef SHEF_CORE_LATENCY_H
#define SHEF_CORE_LATENCY_H

#include <stdatomic.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_LATENCY_STEPS   16                        /* buckets per doubling */
#define SHEF_LATENCY_BUCKETS (27 * SHEF_LATENCY_STEPS) /* 1.024 us * 2^26 = 68.7 s */

/* Zeroed memory is an empty histogram. */
struct shef_latency {
    /* The one writer writes, any thread reads. */
    _Atomic uint64_t n[SHEF_LATENCY_BUCKETS];
    _Atomic uint64_t sum_ns;
    _Atomic int64_t max_ns;
};

/* A copy, of one thread. */
struct shef_latency_counts {
    uint64_t n[SHEF_LATENCY_BUCKETS];
    uint64_t n_all;
    uint64_t sum_ns;
    int64_t max_ns; /* since the start, also in a window */
};

/* Counts one duration.                                            Thread: the one writer.
 *   duration_ns  negative counts as 0; beyond the last bucket counts there */
void shef_latency_add(struct shef_latency *latency, int64_t duration_ns);

/* Copies what there is. While the writer goes on, the copy may lack or have its last few
 * entries, but it is consistent in itself: n_all is the sum of n.  Thread: any. */
void shef_latency_read(const struct shef_latency *latency, struct shef_latency_counts *out_counts);

/* What came between two copies of one histogram; max_ns is that of `later`. */
void shef_latency_window(const struct shef_latency_counts *later,
                         const struct shef_latency_counts *earlier,
                         struct shef_latency_counts *out_window);

/* The duration that a share of all entries does not exceed, rounded up to its bucket's end and
 * at most max_ns; 0 if there are none.
 *   share  0..1: 0.5 is the median */
int64_t shef_latency_percentile_ns(const struct shef_latency_counts *counts, double share);

/* The arithmetic mean; 0 if there are no entries. */
int64_t shef_latency_mean_ns(const struct shef_latency_counts *counts);

#ifdef __cplusplus
}
#endif

#endif
