#include "core/latency.h"

#include <assert.h>
#include <math.h>

/* Durations are counted in units of 1024 ns. Values below one doubling's worth of steps are
 * linear, so the first 16 buckets are one unit wide; then the width doubles every 16 buckets. */
#define UNIT_SHIFT 10

static uint32_t bucket_of(int64_t duration_ns)
{
    const uint64_t units = duration_ns > 0 ? (uint64_t)duration_ns >> UNIT_SHIFT : 0;

    if (units < SHEF_LATENCY_STEPS)
        return (uint32_t)units;

    const uint32_t octave = 63u - (uint32_t)__builtin_clzll(units); /* 4 or more */
    const uint32_t step = (uint32_t)(units >> (octave - 4)) & (SHEF_LATENCY_STEPS - 1);
    const uint32_t bucket = (octave - 3) * SHEF_LATENCY_STEPS + step;

    return bucket < SHEF_LATENCY_BUCKETS ? bucket : SHEF_LATENCY_BUCKETS - 1;
}

/* The first duration above the bucket. */
static int64_t end_of(uint32_t bucket)
{
    const uint32_t row = bucket / SHEF_LATENCY_STEPS;
    const uint64_t step = bucket % SHEF_LATENCY_STEPS;

    if (row == 0)
        return (int64_t)((step + 1) << UNIT_SHIFT);
    return (int64_t)((SHEF_LATENCY_STEPS + step + 1) << (row - 1 + UNIT_SHIFT));
}

/* One writer: a load and a store suffice, and cost less than a locked addition.
 * Release: whoever sees the entry counted also sees the sum and the maximum it belongs to. */
static void bump(_Atomic uint64_t *counter, uint64_t by)
{
    atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + by,
                          memory_order_release);
}

void shef_latency_add(struct shef_latency *latency, int64_t duration_ns)
{
    if (duration_ns > atomic_load_explicit(&latency->max_ns, memory_order_relaxed))
        atomic_store_explicit(&latency->max_ns, duration_ns, memory_order_relaxed);
    bump(&latency->sum_ns, duration_ns > 0 ? (uint64_t)duration_ns : 0);
    bump(&latency->n[bucket_of(duration_ns)], 1);
}

void shef_latency_read(const struct shef_latency *latency, struct shef_latency_counts *out_counts)
{
    out_counts->n_all = 0;
    for (uint32_t i = 0; i < SHEF_LATENCY_BUCKETS; i++) {
        /* Acquire: pairs with the release in bump(). */
        out_counts->n[i] = atomic_load_explicit(&latency->n[i], memory_order_acquire);
        out_counts->n_all += out_counts->n[i];
    }
    out_counts->sum_ns = atomic_load_explicit(&latency->sum_ns, memory_order_relaxed);
    out_counts->max_ns = atomic_load_explicit(&latency->max_ns, memory_order_relaxed);
}

void shef_latency_window(const struct shef_latency_counts *later,
                         const struct shef_latency_counts *earlier,
                         struct shef_latency_counts *out_window)
{
    for (uint32_t i = 0; i < SHEF_LATENCY_BUCKETS; i++) {
        assert(later->n[i] >= earlier->n[i]);
        out_window->n[i] = later->n[i] - earlier->n[i];
    }
    out_window->n_all = later->n_all - earlier->n_all;
    out_window->sum_ns = later->sum_ns - earlier->sum_ns;
    out_window->max_ns = later->max_ns;
}

int64_t shef_latency_percentile_ns(const struct shef_latency_counts *counts, double share)
{
    assert(share >= 0.0 && share <= 1.0);

    const double wanted = ceil(share * (double)counts->n_all);
    const uint64_t rank = wanted > 1.0 ? (uint64_t)wanted : 1;
    uint64_t n_seen = 0;

    for (uint32_t i = 0; i < SHEF_LATENCY_BUCKETS; i++) {
        n_seen += counts->n[i];
        /* The last bucket has no end of its own. */
        if (n_seen >= rank)
            return i + 1 < SHEF_LATENCY_BUCKETS && end_of(i) < counts->max_ns ? end_of(i)
                                                                              : counts->max_ns;
    }
    return 0;
}

int64_t shef_latency_mean_ns(const struct shef_latency_counts *counts)
{
    return counts->n_all > 0 ? (int64_t)(counts->sum_ns / counts->n_all) : 0;
}
