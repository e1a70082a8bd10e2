#include "codecs/evt_clock.h"

/* Values that repeat this often since the last jump make a stream one that repeats them all. */
#define N_REPEATS_OF_A_SENSOR 8

/* A second opinion agrees if it lies at most so many steps after the candidate. */
#define N_STEPS_AGREEING        1
#define N_STEPS_AGREEING_SPARSE 255

void shef_evt_clock_init(struct shef_evt_clock *clock, int32_t n_bits, int32_t step_us,
                         int64_t near_us)
{
    *clock = (struct shef_evt_clock){
        .step_us = step_us,
        .mask = (1u << n_bits) - 1,
        /* The long counter splits in the middle. The short one wraps every 17 s, and a pause of
         * many seconds is likelier than a step back by more than one: 256 steps are 1.05 s. */
        .n_back_max = n_bits > 12 ? 1u << (n_bits - 1) : 256,
        .near_us = near_us,
    };
}

/* Steps from one value to another, negative if that is back. */
static int64_t steps_between(const struct shef_evt_clock *clock, uint32_t from, uint32_t to)
{
    const uint32_t ahead = (to - from) & clock->mask;

    return ahead > clock->mask - clock->n_back_max ? (int64_t)ahead - clock->mask - 1 : ahead;
}

static void start(struct shef_evt_clock *clock, uint32_t value)
{
    const int64_t range_us = ((int64_t)clock->mask + 1) * clock->step_us;
    /* Of all times with this value, the one nearest to near_us; without a hint, the first. */
    int64_t ahead_us = ((int64_t)value * clock->step_us - clock->near_us) % range_us;

    if (ahead_us < 0)
        ahead_us += range_us;
    if (ahead_us >= range_us / 2 && clock->near_us != 0)
        ahead_us -= range_us;
    clock->high_us = clock->near_us + ahead_us + clock->offset_us;
    clock->high = value;
    clock->known = true;
}

static enum shef_evt_tick move(struct shef_evt_clock *clock, uint32_t value, int64_t n_steps)
{
    clock->n_wraps += n_steps > 0 && value < clock->high;
    clock->high_us += n_steps * clock->step_us;
    clock->high = value;
    clock->in_doubt = false;
    if (n_steps < 0)
        return SHEF_EVT_TICK_BACK;
    return n_steps == 0 ? SHEF_EVT_TICK_SAME : SHEF_EVT_TICK_AHEAD;
}

bool shef_evt_clock_ticks(const struct shef_evt_clock *clock)
{
    return clock->n_repeats >= N_REPEATS_OF_A_SENSOR;
}

/* Whether value, which does not follow the current time, has been confirmed by now. */
static bool confirmed(struct shef_evt_clock *clock, uint32_t value)
{
    const uint32_t n_agreeing_steps =
        shef_evt_clock_ticks(clock) ? N_STEPS_AGREEING : N_STEPS_AGREEING_SPARSE;
    const bool agrees =
        clock->in_doubt && ((value - clock->candidate) & clock->mask) <= n_agreeing_steps;

    clock->n_agreeing = agrees ? clock->n_agreeing + 1 : 0;
    clock->candidate = value;
    clock->in_doubt = true;
    return clock->n_agreeing >= SHEF_EVT_CLOCK_N_AGREEING;
}

static enum shef_evt_tick jump(struct shef_evt_clock *clock, uint32_t value, int64_t n_steps)
{
    const enum shef_evt_tick tick = move(clock, value, n_steps);

    clock->n_repeats = 0;
    return tick == SHEF_EVT_TICK_AHEAD && n_steps > 1 ? SHEF_EVT_TICK_GAP : tick;
}

enum shef_evt_tick shef_evt_clock_push(struct shef_evt_clock *clock, uint32_t value)
{
    if (!clock->known) {
        start(clock, value);
        return SHEF_EVT_TICK_AHEAD;
    }

    const int64_t n_steps = steps_between(clock, clock->high, value);

    if (n_steps == 0 && clock->n_repeats < UINT8_MAX)
        clock->n_repeats++;
    if (n_steps >= -1 && n_steps <= 1)
        return move(clock, value, n_steps);
    if (n_steps > 0 && !shef_evt_clock_ticks(clock)) {
        clock->n_repeats = 0;
        return move(clock, value, n_steps);
    }
    if (!confirmed(clock, value))
        return n_steps < 0 ? SHEF_EVT_TICK_DOUBT_BACK : SHEF_EVT_TICK_DOUBT_AHEAD;
    return jump(clock, value, n_steps);
}

enum shef_evt_tick shef_evt_clock_rejoin(struct shef_evt_clock *clock,
                                         const struct shef_evt_clock_mark *mark, uint32_t value)
{
    if (!mark->known) {
        clock->in_doubt = false;
        clock->n_wraps = 0;
        start(clock, value);
        return SHEF_EVT_TICK_AHEAD;
    }
    clock->high_us = mark->high_us;
    clock->high = mark->high;
    clock->n_wraps = mark->n_wraps;
    return jump(clock, value, steps_between(clock, clock->high, value));
}
