/* How events change the filter's state. */

#include "pipeline/filter_state.h"

#define AHEAD_US        INT64_C(10000000)
#define SWEEP_ROW_US    2000 /* 480 rows within a second */
#define FORGET_AHEAD_US (INT64_C(1) << 30)

static inline int32_t saturated(int64_t level)
{
    /* One branch that is the same for nearly all events, and for all of a hot pixel's. */
    if (level != (int32_t)level)
        return level > 0 ? INT32_MAX : -INT32_MAX;
    return (int32_t)level;
}

/* All events are on the sensor and on course. The last two are constants where this is inlined. */
static inline __attribute__((always_inline)) void update_pixels(const struct shef_filter *filter,
                                                                const struct shef_event *events,
                                                                uint32_t n, uint32_t base_us,
                                                                int low_bits, bool has_gains)
{
    struct shef_decay_cell *const cells = filter->cells;
    int16_t *const sums = filter->sums;
    const struct shef_filter_gain *const gains = filter->gains;
    const uint32_t *const pixels = filter->pixels;
    const uint32_t max_age_us = filter->max_age_us;
    const int32_t level_steps[2] = { filter->level_steps[0], filter->level_steps[1] };
    const int32_t sum_steps[2] = { filter->sum_steps[0], filter->sum_steps[1] };

    for (uint32_t i = 0; i < n; i++) {
        const uint32_t pixel = pixels[i];
        const uint32_t later_pixel = pixels[i + SHEF_FILTER_PREFETCH];
        const struct shef_decay_cell cell = cells[pixel];
        const uint32_t on = events[i].y_on >> 15;
        const int32_t since_us = (int32_t)(base_us + events[i].t_us - cell.t_us);
        const int32_t age_us = since_us > 0 ? since_us : 0;
        int32_t level_step = level_steps[on];
        int32_t sum_step = sum_steps[on];

        __builtin_prefetch(&cells[later_pixel], 1);
        __builtin_prefetch(&sums[later_pixel], 1);
        if (has_gains) {
            const struct shef_filter_gain gain = gains[pixel];
            const int64_t scaled = (int64_t)level_step * (on ? gain.on_q8 : gain.off_q8);

            __builtin_prefetch(&gains[later_pixel]);
            level_step = saturated((scaled + (1 << 7)) >> 8);
            sum_step = (int32_t)((scaled + (1 << 17)) >> 18);
        }
        cells[pixel] = (struct shef_decay_cell){
            .level = saturated(
                shef_filter_decayed(filter, cell.level, age_us, max_age_us, low_bits) + level_step),
            .t_us = cell.t_us + (uint32_t)age_us,
        };
        sums[pixel] = (int16_t)(uint16_t)(sums[pixel] + sum_step);
    }
}

/* Functions of their own: inlined together they run out of registers. */
static __attribute__((noinline)) void update_plain(const struct shef_filter *filter,
                                                   const struct shef_event *events, uint32_t n,
                                                   uint32_t base_us)
{
    update_pixels(filter, events, n, base_us, SHEF_FILTER_MIN_LOW_BITS, false);
}

static __attribute__((noinline)) void update_slow(const struct shef_filter *filter,
                                                  const struct shef_event *events, uint32_t n,
                                                  uint32_t base_us)
{
    update_pixels(filter, events, n, base_us, filter->low_bits, false);
}

static __attribute__((noinline)) void update_gains(const struct shef_filter *filter,
                                                   const struct shef_event *events, uint32_t n,
                                                   uint32_t base_us)
{
    update_pixels(filter, events, n, base_us, filter->low_bits, true);
}

static void update(struct shef_filter *filter, const struct shef_event *events, uint32_t n,
                   int64_t base_us)
{
    for (uint32_t i = n; i < n + SHEF_FILTER_PREFETCH; i++)
        filter->pixels[i] = filter->pixels[n - 1];
    if (filter->gains)
        update_gains(filter, events, n, (uint32_t)base_us);
    else if (filter->low_bits == SHEF_FILTER_MIN_LOW_BITS)
        update_plain(filter, events, n, (uint32_t)base_us);
    else
        update_slow(filter, events, n, (uint32_t)base_us);
    filter->stats.n_events += n;
}

/* What a look at a chunk finds; fills filter->pixels, of use if all are on the sensor. */
struct survey {
    bool is_on_sensor;
    bool is_ordered; /* no time steps back */
    uint32_t first_us;
    uint32_t last_us;
};

static struct survey take_survey(struct shef_filter *filter, const struct shef_event *events,
                                 uint32_t n)
{
    const uint32_t width_px = (uint32_t)filter->params.width_px;
    const uint32_t last_x_px = width_px - 1;
    const uint32_t last_y_px = (uint32_t)filter->params.height_px - 1;
    uint32_t *const pixels = filter->pixels;
    uint32_t before_us = events[0].t_us;
    /* Sign bits of differences that must not be negative. A step ahead by more than half of the
     * 32 bits looks like one back, which costs a closer look and no more. */
    uint32_t is_outside = 0;
    uint32_t steps_back = 0;

    for (uint32_t i = 0; i < n; i++) {
        const uint32_t x_px = events[i].x_px;
        const uint32_t y_px = shef_event_y_px(events[i]);

        pixels[i] = y_px * width_px + x_px;
        is_outside |= (last_x_px - x_px) | (last_y_px - y_px);
        steps_back |= events[i].t_us - before_us;
        before_us = events[i].t_us;
    }
    is_outside >>= 31;
    steps_back >>= 31;

    struct survey survey = { !is_outside, !steps_back, events[0].t_us, events[n - 1].t_us };

    for (uint32_t i = 0; steps_back && i < n; i++) {
        survey.first_us = events[i].t_us < survey.first_us ? events[i].t_us : survey.first_us;
        survey.last_us = events[i].t_us > survey.last_us ? events[i].t_us : survey.last_us;
    }
    return survey;
}

static bool is_on_course(const struct shef_filter *filter, int64_t first_us, int64_t last_us)
{
    return filter->newest_us != INT64_MIN &&
           first_us >= filter->newest_us - filter->params.back_step_us &&
           last_us <= filter->newest_us + AHEAD_US;
}

/* Whether each event finds itself on the sensor and on course when its turn comes. */
static bool is_plain(const struct shef_filter *filter, const struct survey *survey, int64_t base_us)
{
    const bool is_short =
        survey->last_us - survey->first_us <= (uint32_t)filter->params.back_step_us;

    return survey->is_on_sensor && (survey->is_ordered || is_short) &&
           is_on_course(filter, base_us + survey->first_us, base_us + survey->last_us);
}

/* A pixel without level. Its time is the oldest that may still come, so that an event keeps its
 * own time even if it is late. */
static struct shef_decay_cell empty_cell(const struct shef_filter *filter, int64_t now_us)
{
    return (struct shef_decay_cell){
        .level = 0,
        .t_us = (uint32_t)now_us - (uint32_t)filter->params.back_step_us,
    };
}

static void forget(struct shef_filter *filter, int64_t now_us)
{
    const size_t n_pixels = shef_filter_pixel_count(filter);

    for (size_t i = 0; i < n_pixels; i++)
        filter->cells[i] = empty_cell(filter, now_us);
    filter->swept_us = now_us;
}

/* A time off the course: whether it has been confirmed, so that time goes on from here. */
static bool is_confirmed(struct shef_filter *filter, int64_t t_us)
{
    if (filter->newest_us == INT64_MIN)
        return true;

    const bool agrees = t_us >= filter->stray_us - filter->params.back_step_us &&
                        t_us <= filter->stray_us + AHEAD_US;

    filter->n_strays_in_a_row = agrees ? filter->n_strays_in_a_row + 1 : 1;
    filter->stray_us = t_us;
    return filter->n_strays_in_a_row >= SHEF_FILTER_CONFIRMATIONS;
}

static void start_time(struct shef_filter *filter, int64_t t_us)
{
    if (filter->newest_us == INT64_MIN || t_us < filter->newest_us ||
        t_us - filter->newest_us > FORGET_AHEAD_US) {
        filter->stats.n_epochs += t_us < filter->newest_us;
        forget(filter, t_us);
    }
    filter->newest_us = t_us;
}

/* Rows whose levels have died get a fresh time, so that no age ever leaves 32 bits. */
static void sweep(struct shef_filter *filter)
{
    const int32_t width_px = filter->params.width_px;
    const uint32_t now_us = (uint32_t)filter->newest_us;
    const struct shef_decay_cell empty = empty_cell(filter, filter->newest_us);
    int64_t n_rows = (filter->newest_us - filter->swept_us) / SWEEP_ROW_US;

    filter->swept_us += n_rows * SWEEP_ROW_US;
    if (n_rows > filter->params.height_px)
        n_rows = filter->params.height_px;
    for (; n_rows > 0; n_rows--) {
        struct shef_decay_cell *row = filter->cells + (size_t)filter->sweep_row * (size_t)width_px;

        for (int32_t x = 0; x < width_px; x++)
            if (now_us - row[x].t_us >= filter->max_age_us && now_us - row[x].t_us <= INT32_MAX)
                row[x] = empty;
        filter->sweep_row = (filter->sweep_row + 1) % filter->params.height_px;
    }
}

/* The chunk needs a look at each event. Returns how many were used up; sets *out_is_done where the
 * caller has to know before it goes on. */
static uint32_t apply_each(struct shef_filter *filter, const struct shef_event *events, uint32_t n,
                           int64_t base_us, int64_t until_us, bool *out_is_done)
{
    const uint32_t n_epochs = filter->stats.n_epochs;

    for (uint32_t i = 0; i < n; i++) {
        const int64_t t_us = base_us + events[i].t_us;
        const uint32_t y_px = shef_event_y_px(events[i]);

        if (!shef_filter_is_on_sensor(filter, events[i].x_px, y_px)) {
            filter->stats.n_outside++;
            continue;
        }

        const bool is_stray = !is_on_course(filter, t_us, t_us);

        if (is_stray && !is_confirmed(filter, t_us)) {
            filter->stats.n_strays++;
            continue;
        }
        if (t_us > until_us) {
            *out_is_done = true;
            return i;
        }
        if (is_stray)
            start_time(filter, t_us);
        filter->n_strays_in_a_row = 0;
        filter->pixels[0] = y_px * (uint32_t)filter->params.width_px + events[i].x_px;
        update(filter, events + i, 1, base_us);
        filter->newest_us = t_us > filter->newest_us ? t_us : filter->newest_us;
        if (filter->stats.n_epochs != n_epochs) {
            *out_is_done = true;
            return i + 1;
        }
    }
    return n;
}

uint32_t shef_filter_apply(struct shef_filter *filter, const struct shef_event *events,
                           uint32_t n_events, int64_t base_us, shef_event_time until)
{
    const int64_t until_us = shef_filter_whole_us(until);
    bool is_done = false;
    uint32_t i = 0;

    while (i < n_events && !is_done) {
        const uint32_t n = n_events - i < SHEF_FILTER_CHUNK ? n_events - i : SHEF_FILTER_CHUNK;
        const struct survey survey = take_survey(filter, events + i, n);
        const int64_t last_us = base_us + survey.last_us;

        if (last_us <= until_us && is_plain(filter, &survey, base_us)) {
            update(filter, events + i, n, base_us);
            filter->newest_us = last_us > filter->newest_us ? last_us : filter->newest_us;
            filter->n_strays_in_a_row = 0;
            i += n;
        } else {
            i += apply_each(filter, events + i, n, base_us, until_us, &is_done);
        }
        sweep(filter);
    }
    return i;
}
