/* 64-bit event time from the TIME_HIGH words of an EVT stream.
 *
 * A TIME_HIGH word carries the upper bits of a counter that wraps: 28 bits in steps of 64 us
 * (EVT2, EVT2.1: 2^34 us) or 12 bits in steps of 4096 us (EVT3: 2^24 us). Sensors repeat every
 * value many times, one word each 16 us; other writers send it once, when it changes. So a value
 * that jumps means lost or damaged data in the first kind of stream and a quiet scene in the
 * second, and only the first kind is asked for a second opinion.
 *
 *   same, +1      taken
 *   -1            taken, counted as back: neighbours in the sensor's read-out swapped
 *   ahead         taken where values do not repeat; else in doubt until three more words agree
 *   back          in doubt until three more words agree
 *
 * A word that fits the old time again ends the doubt, so a flipped bit costs one word's events
 * and never a wrong time. Pure state, no I/O. Thread: the decoder's. */
#ifndef SHEF_CODECS_EVT_CLOCK_H
#define SHEF_CODECS_EVT_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How many more words must agree with a doubtful one. */
#define SHEF_EVT_CLOCK_N_AGREEING 3

struct shef_evt_clock {
    /* Set by init. */
    int32_t step_us;     /* 64 or 4096 */
    uint32_t mask;       /* 2^bits - 1 */
    uint32_t n_back_max; /* how many steps back still count as back, not as ahead */
    int64_t near_us;     /* what the first TIME_HIGH is unwrapped next to */
    int64_t offset_us;   /* and what is then added; 0 by init */
    /* Set by words. */
    int64_t high_us;    /* 64-bit time of the current TIME_HIGH */
    uint32_t high;      /* its value */
    uint32_t n_wraps;   /* of the value */
    uint32_t candidate; /* the last value in doubt */
    uint8_t n_agreeing; /* words that followed the candidate */
    uint8_t n_repeats;  /* repeated values since the last jump, up to 255 */
    bool known;         /* a first TIME_HIGH has come */
    bool in_doubt;
};

/* A time to go back to. */
struct shef_evt_clock_mark {
    int64_t high_us;
    uint32_t high;
    uint32_t n_wraps;
    bool known;
};

/* What a TIME_HIGH did. */
enum shef_evt_tick {
    SHEF_EVT_TICK_SAME,        /* nothing new */
    SHEF_EVT_TICK_AHEAD,       /* time moved on; low bits start again at 0 */
    SHEF_EVT_TICK_GAP,         /* time moved on over lost data */
    SHEF_EVT_TICK_BACK,        /* time moved back */
    SHEF_EVT_TICK_DOUBT_AHEAD, /* not believed yet: what follows has no time */
    SHEF_EVT_TICK_DOUBT_BACK,
};

/*   n_bits   12 (EVT3) or 28 (EVT2, EVT2.1)
 *   step_us  4096 or 64
 *   near_us  a time within half the counter's range of the first TIME_HIGH, 0 if it is not known */
void shef_evt_clock_init(struct shef_evt_clock *clock, int32_t n_bits, int32_t step_us,
                         int64_t near_us);

/* Takes the value of one TIME_HIGH word. */
enum shef_evt_tick shef_evt_clock_push(struct shef_evt_clock *clock, uint32_t value);

/* Goes back to a mark and takes from there a value that resynchronisation has confirmed: no doubt,
 * only ahead, gap or back. Without a mark, time starts anew. */
enum shef_evt_tick shef_evt_clock_rejoin(struct shef_evt_clock *clock,
                                         const struct shef_evt_clock_mark *mark, uint32_t value);

static inline void shef_evt_clock_mark(const struct shef_evt_clock *clock,
                                       struct shef_evt_clock_mark *out_mark)
{
    out_mark->high_us = clock->high_us;
    out_mark->high = clock->high;
    out_mark->n_wraps = clock->n_wraps;
    out_mark->known = clock->known;
}

/* Whether this stream has shown that it repeats every value, as sensors do. */
bool shef_evt_clock_ticks(const struct shef_evt_clock *clock);

/* Whether events can be given a time now. */
static inline bool shef_evt_clock_runs(const struct shef_evt_clock *clock)
{
    return clock->known && !clock->in_doubt;
}

#ifdef __cplusplus
}
#endif

#endif
