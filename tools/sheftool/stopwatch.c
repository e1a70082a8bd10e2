#include "sheftool/stopwatch.h"

#include <stdlib.h>
#include <time.h>

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;

    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

int64_t shef_monotonic_ns(void)
{
    return clock_ns(CLOCK_MONOTONIC);
}

int64_t shef_stopwatch_cpu_ns(void)
{
    return clock_ns(CLOCK_THREAD_CPUTIME_ID);
}

enum shef_err shef_timings_add(struct shef_timings *timings, int64_t ns)
{
    if (timings->n == timings->capacity) {
        const size_t capacity = timings->capacity ? 2 * timings->capacity : 64;
        int64_t *grown = realloc(timings->ns, capacity * sizeof *grown);

        if (!grown)
            return SHEF_ERR_NO_MEMORY;
        timings->ns = grown;
        timings->capacity = capacity;
    }
    timings->ns[timings->n++] = ns;
    return SHEF_OK;
}

static int compare_ns(const void *a, const void *b)
{
    const int64_t left = *(const int64_t *)a;
    const int64_t right = *(const int64_t *)b;

    return (left > right) - (left < right);
}

struct shef_timing_summary shef_timings_summary(struct shef_timings *timings)
{
    const size_t n = timings->n;

    if (n == 0)
        return (struct shef_timing_summary){ 0 };
    qsort(timings->ns, n, sizeof *timings->ns, compare_ns);
    return (struct shef_timing_summary){
        .median_ms = (double)(timings->ns[(n - 1) / 2] + timings->ns[n / 2]) / 2e6,
        .p95_ms = (double)timings->ns[(95 * n + 99) / 100 - 1] / 1e6,
        .min_ms = (double)timings->ns[0] / 1e6,
    };
}

void shef_timings_free(struct shef_timings *timings)
{
    free(timings->ns);
    *timings = (struct shef_timings){ 0 };
}
