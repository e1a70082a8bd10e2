/* The filter's state, shared by what writes it and what reads it. Internal to the filter. */
#ifndef SHEF_PIPELINE_FILTER_STATE_H
#define SHEF_PIPELINE_FILTER_STATE_H

#include "pipeline/filter.h"
#include "pipeline/kernels/decay.h"

#define SHEF_FILTER_CHUNK        256u /* events looked at together */
#define SHEF_FILTER_PREFETCH     16u  /* events ahead; 8 to 32 measured within 2 % */
#define SHEF_FILTER_HIGH_ENTRIES 1024u
#define SHEF_FILTER_MIN_LOW_BITS 8 /* enough from 90 rad/s on */
#define SHEF_FILTER_MAX_LOW_BITS 12

struct shef_filter {
    /* Set by create, then read-only. */
    struct shef_filter_params params;
    const struct shef_decay_kernels *kernels;
    struct shef_decay_cell *cells;  /* row by row */
    int16_t *sums;                  /* running sums, 2^8 a step, modulo 2^16 */
    struct shef_filter_gain *gains; /* NULL: all 1 */
    int32_t level_steps[2];         /* what an off and an on event add */
    int16_t sum_steps[2];
    float halvings_per_us;
    int32_t horizon_us; /* ages beyond it read as zero */
    /* exp(-cutoff * age) = high[age >> low_bits] * low[age mod 2^low_bits]; high in units of
     * 2^-31, low of 2^-32, so that short ages have an exact factor of 1 from the one and the
     * finest rounding from the other. */
    int low_bits;
    uint32_t max_age_us; /* where high[] ends with its zero */
    uint32_t high[SHEF_FILTER_HIGH_ENTRIES + 1];
    uint32_t low[1u << SHEF_FILTER_MAX_LOW_BITS];
    /* The stream. */
    int64_t newest_us;
    int64_t swept_us; /* rows are swept up to this time's turn */
    int32_t sweep_row;
    int64_t stray_us;
    uint32_t n_strays_in_a_row;
    struct shef_filter_stats stats;
    uint32_t masked[SHEF_FILTER_MAX_MASKED];
    uint32_t n_masked;
    /* Of the current chunk. */
    uint32_t pixels[SHEF_FILTER_CHUNK + SHEF_FILTER_PREFETCH];
};

static inline size_t shef_filter_pixel_count(const struct shef_filter *filter)
{
    return (size_t)filter->params.width_px * (size_t)filter->params.height_px;
}

static inline bool shef_filter_is_on_sensor(const struct shef_filter *filter, uint32_t x_px,
                                            uint32_t y_px)
{
    return x_px < (uint32_t)filter->params.width_px && y_px < (uint32_t)filter->params.height_px;
}

/* Microseconds of an instant, rounded down. */
static inline int64_t shef_filter_whole_us(shef_event_time time)
{
    const int64_t us = time.ns / SHEF_NS_PER_US;

    return us - (time.ns < us * SHEF_NS_PER_US);
}

/* level * exp(-cutoff * age), rounded. The last two are filter's, in the caller's registers. */
static inline int64_t shef_filter_decayed(const struct shef_filter *filter, int32_t level,
                                          int32_t age_us, uint32_t max_age_us, int low_bits)
{
    const uint32_t age = (uint32_t)age_us < max_age_us ? (uint32_t)age_us : max_age_us;
    const uint64_t product =
        (uint64_t)filter->high[age >> low_bits] * filter->low[age & ((1u << low_bits) - 1)];
    const uint64_t factor = (product + (1u << 30)) >> 31;

    return ((int64_t)level * (int64_t)factor + (INT64_C(1) << 31)) >> 32;
}

#endif
