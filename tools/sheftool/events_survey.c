#include "sheftool/events_survey.h"

#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define FIRST_BIN_US   100
#define HOT_MIN_EVENTS 20
#define HOT_FACTOR     4 /* above its neighbours' mean: busy places are not hot pixels */

enum shef_err shef_survey_create(struct shef_survey *survey, uint32_t width_px, uint32_t height_px,
                                 int64_t pause_us, struct shef_error *err)
{
    /* Without a size, start with VGA and grow. */
    const uint32_t w = width_px ? width_px : 640;
    const uint32_t h = height_px ? height_px : 480;

    *survey = (struct shef_survey){
        .pause_us = pause_us,
        .bin_us = FIRST_BIN_US,
        .width_px = w,
        .height_px = h,
        .on = shef_memory_create((size_t)w * h, sizeof *survey->on),
        .off = shef_memory_create((size_t)w * h, sizeof *survey->off),
    };
    if (survey->on && survey->off)
        return SHEF_OK;
    shef_survey_destroy(survey);
    return shef_fail(err, SHEF_ERR_NO_MEMORY, "count events of %u x %u px: out of memory", w, h);
}

void shef_survey_destroy(struct shef_survey *survey)
{
    free(survey->on);
    free(survey->off);
    survey->on = NULL;
    survey->off = NULL;
}

/* Copies counts into a larger map. Returns NULL without memory. */
static uint32_t *grown(const uint32_t *counts, const struct shef_survey *survey, uint32_t w,
                       uint32_t h)
{
    uint32_t *larger = shef_memory_create((size_t)w * h, sizeof *larger);

    for (uint32_t y = 0; larger && y < survey->height_px; y++)
        memcpy(larger + (size_t)y * w, counts + (size_t)y * survey->width_px,
               survey->width_px * sizeof *counts);
    return larger;
}

static enum shef_err grow(struct shef_survey *survey, uint32_t x_px, uint32_t y_px,
                          struct shef_error *err)
{
    uint32_t w = survey->width_px;
    uint32_t h = survey->height_px;

    while (w <= x_px)
        w *= 2;
    while (h <= y_px)
        h *= 2;

    uint32_t *on = grown(survey->on, survey, w, h);
    uint32_t *off = grown(survey->off, survey, w, h);

    if (!on || !off) {
        free(on);
        free(off);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "count events of %u x %u px: out of memory", w,
                         h);
    }
    shef_survey_destroy(survey);
    survey->on = on;
    survey->off = off;
    survey->width_px = w;
    survey->height_px = h;
    return SHEF_OK;
}

/* Halves the number of bins by joining neighbours. */
static void join_bins(struct shef_survey *survey)
{
    for (uint32_t i = 0; i < SHEF_SURVEY_BINS / 2; i++)
        survey->bins[i] = (struct shef_survey_bin){
            survey->bins[2 * i].n_on + survey->bins[2 * i + 1].n_on,
            survey->bins[2 * i].n_off + survey->bins[2 * i + 1].n_off,
        };
    memset(survey->bins + SHEF_SURVEY_BINS / 2, 0, sizeof survey->bins / 2);
    survey->bin_us *= 2;
    survey->n_bins = (survey->n_bins + 1) / 2;
}

static void note_time(struct shef_survey *survey, int64_t t_us)
{
    if (!survey->has_time) {
        survey->has_time = true;
        survey->first_us = t_us;
        survey->last_us = t_us;
    }
    if (t_us > survey->last_us)
        survey->last_us = t_us;
}

static void note_pause(struct shef_survey *survey, int64_t t_us)
{
    const int64_t silence_us = survey->has_event ? t_us - survey->latest_us : 0;

    if (silence_us >= survey->pause_us)
        survey->n_pauses++;
    if (silence_us > survey->longest_us) {
        survey->longest_us = silence_us;
        survey->longest_at_us = survey->latest_us;
    }
    survey->has_event = true;
    survey->latest_us = t_us;
}

static struct shef_survey_bin *bin_of(struct shef_survey *survey, int64_t t_us)
{
    /* Steps back before the first event belong to the first bin. */
    const int64_t since_us = t_us > survey->first_us ? t_us - survey->first_us : 0;

    while (since_us / survey->bin_us >= SHEF_SURVEY_BINS)
        join_bins(survey);

    const uint32_t bin = (uint32_t)(since_us / survey->bin_us);

    if (bin >= survey->n_bins)
        survey->n_bins = bin + 1;
    return &survey->bins[bin];
}

static void note_peak(struct shef_survey *survey, int64_t t_us)
{
    const int64_t ms = t_us / 1000;

    if (!survey->has_event || ms != survey->current_ms) {
        survey->current_ms = ms;
        survey->current_n = 0;
    }
    if (++survey->current_n > survey->peak_n) {
        survey->peak_n = survey->current_n;
        survey->peak_ms = ms;
    }
}

static void add_trigger(struct shef_survey *survey, const struct shef_trigger *trigger)
{
    struct shef_survey_channel *channel =
        &survey->channels[trigger->channel % SHEF_SURVEY_CHANNELS];

    note_time(survey, trigger->t_us);
    survey->n_triggers++;
    if (!trigger->rising) {
        channel->n_falling++;
        if (channel->is_high) {
            channel->sum_high_us += (double)(trigger->t_us - channel->last_rising_us);
            channel->n_high++;
        }
        channel->is_high = false;
        return;
    }
    if (channel->n_rising > 0) {
        const int64_t interval_us = trigger->t_us - channel->last_rising_us;

        if (channel->n_rising == 1 || interval_us < channel->min_interval_us)
            channel->min_interval_us = interval_us;
        if (channel->n_rising == 1 || interval_us > channel->max_interval_us)
            channel->max_interval_us = interval_us;
    }
    channel->n_rising++;
    channel->last_rising_us = trigger->t_us;
    channel->is_high = true;
    if (survey->n_marks < SHEF_SURVEY_MARKS)
        survey->marks[survey->n_marks++] =
            (struct shef_survey_mark){ trigger->t_us, trigger->channel };
}

static enum shef_err add_event(struct shef_survey *survey, struct shef_event event, int64_t t_us,
                               struct shef_error *err)
{
    const uint32_t x_px = event.x_px;
    const uint32_t y_px = shef_event_y_px(event);

    note_time(survey, t_us);
    note_peak(survey, t_us);
    note_pause(survey, t_us);
    if (x_px >= survey->width_px || y_px >= survey->height_px) {
        const enum shef_err code = grow(survey, x_px, y_px, err);

        if (code != SHEF_OK)
            return code;
    }
    if (x_px >= survey->used_width_px)
        survey->used_width_px = x_px + 1;
    if (y_px >= survey->used_height_px)
        survey->used_height_px = y_px + 1;

    const size_t pixel = (size_t)y_px * survey->width_px + x_px;
    struct shef_survey_bin *bin = bin_of(survey, t_us);

    if (shef_event_is_on(event)) {
        survey->n_on++;
        survey->on[pixel]++;
        bin->n_on++;
    } else {
        survey->n_off++;
        survey->off[pixel]++;
        bin->n_off++;
    }
    return SHEF_OK;
}

/* Remembers where a batch begins and ends in which time has jumped. */
static void add_loss(struct shef_survey *survey, int64_t before_us,
                     const struct shef_event_batch *batch)
{
    if (survey->n_losses < SHEF_SURVEY_LOSSES)
        survey->losses[survey->n_losses++] =
            (struct shef_survey_loss){ before_us, batch->reached_us > before_us ? batch->reached_us
                                                                                : before_us };
}

enum shef_err shef_survey_add(struct shef_survey *survey, const struct shef_event_batch *batch,
                              uint64_t n_jumps, struct shef_error *err)
{
    const int64_t before_us = survey->has_event ? survey->latest_us : batch->base_us;
    enum shef_err code = SHEF_OK;
    uint32_t k = 0;

    for (uint32_t i = 0; code == SHEF_OK && i <= batch->n_events; i++) {
        for (; k < batch->n_triggers && batch->triggers[k].n_before == i; k++)
            add_trigger(survey, &batch->triggers[k]);
        if (i < batch->n_events)
            code = add_event(survey, batch->events[i], shef_event_batch_time_us(batch, i), err);
    }
    if (n_jumps > 0)
        add_loss(survey, before_us, batch);
    return code;
}

static int compare_times(const void *a, const void *b)
{
    const int64_t one = *(const int64_t *)a;
    const int64_t other = *(const int64_t *)b;

    return one < other ? -1 : one > other;
}

/* The intervals between a channel's kept edges. Returns how many; the caller frees them. */
static size_t list_intervals(const struct shef_survey *survey, int channel, int64_t **out_intervals)
{
    int64_t *intervals = calloc(survey->n_marks + 1, sizeof *intervals);
    int64_t last_us = 0;
    size_t n = 0;
    bool has_last = false;

    for (uint32_t i = 0; intervals && i < survey->n_marks; i++) {
        if (survey->marks[i].channel != channel)
            continue;
        if (has_last)
            intervals[n++] = survey->marks[i].t_us - last_us;
        last_us = survey->marks[i].t_us;
        has_last = true;
    }
    *out_intervals = intervals;
    return n;
}

int64_t shef_survey_usual_interval_us(const struct shef_survey *survey, int channel)
{
    int64_t *intervals;
    const size_t n = list_intervals(survey, channel, &intervals);
    int64_t usual_us = 0;

    if (n > 0) {
        qsort(intervals, n, sizeof *intervals, compare_times);
        usual_us = intervals[n / 2];
    }
    free(intervals);
    return usual_us;
}

uint64_t shef_survey_missing_edges(const struct shef_survey *survey, int channel)
{
    const int64_t usual_us = shef_survey_usual_interval_us(survey, channel);
    int64_t *intervals;
    const size_t n = list_intervals(survey, channel, &intervals);
    uint64_t n_missing = 0;

    for (size_t i = 0; usual_us > 0 && i < n; i++)
        if (intervals[i] > usual_us + usual_us / 2)
            n_missing += (uint64_t)((intervals[i] + usual_us / 2) / usual_us - 1);
    free(intervals);
    return n_missing;
}

double shef_survey_bin_us(const struct shef_survey *survey, uint32_t bin)
{
    const int64_t left_us = survey->last_us - survey->first_us - bin * survey->bin_us;

    if (left_us >= survey->bin_us)
        return (double)survey->bin_us;
    return left_us > 0 ? (double)left_us : 1;
}

uint32_t shef_survey_rated_bins(const struct shef_survey *survey)
{
    const uint32_t last = survey->n_bins - 1;

    if (survey->n_bins < 2 || 2 * shef_survey_bin_us(survey, last) >= (double)survey->bin_us)
        return survey->n_bins;
    return last;
}

double shef_survey_duration_s(const struct shef_survey *survey)
{
    return (double)(survey->last_us - survey->first_us) / 1e6;
}

double shef_survey_mean_mev_per_s(const struct shef_survey *survey)
{
    const double duration_s = shef_survey_duration_s(survey);

    return duration_s > 0 ? (double)(survey->n_on + survey->n_off) / duration_s / 1e6 : 0;
}

double shef_survey_peak_mev_per_s(const struct shef_survey *survey)
{
    /* A stream of less than a millisecond has no busiest one. */
    if (survey->last_us - survey->first_us < 1000)
        return shef_survey_mean_mev_per_s(survey);
    return (double)survey->peak_n / 1e3;
}

static int compare_hot(const void *a, const void *b)
{
    const struct shef_survey_hot_pixel *one = a;
    const struct shef_survey_hot_pixel *other = b;

    if (one->per_s != other->per_s)
        return one->per_s > other->per_s ? -1 : 1;
    if (one->y_px != other->y_px)
        return one->y_px < other->y_px ? -1 : 1;
    return one->x_px < other->x_px ? -1 : one->x_px > other->x_px;
}

static uint64_t events_at(const struct shef_survey *survey, uint32_t x, uint32_t y)
{
    const size_t pixel = (size_t)y * survey->width_px + x;

    return (uint64_t)survey->on[pixel] + survey->off[pixel];
}

/* Whether a pixel fires on its own and not with its neighbours. */
static bool stands_out(const struct shef_survey *survey, uint32_t x, uint32_t y, uint64_t n_events)
{
    uint64_t n_around = 0;
    uint64_t n_neighbours = 0;

    for (uint32_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < survey->height_px; v++)
        for (uint32_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < survey->width_px; u++) {
            if (u == x && v == y)
                continue;
            n_around += events_at(survey, u, v);
            n_neighbours++;
        }
    return n_events * n_neighbours > HOT_FACTOR * n_around;
}

uint32_t shef_survey_hot_pixels(const struct shef_survey *survey, double limit_per_s,
                                struct shef_survey_hot_pixel *out_pixels)
{
    const double duration_s = shef_survey_duration_s(survey);
    uint32_t n = 0;
    uint32_t n_stored = 0;

    if (!(duration_s > 0))
        return 0;
    for (uint32_t y = 0; y < survey->used_height_px; y++)
        for (uint32_t x = 0; x < survey->used_width_px; x++) {
            const uint64_t n_events = events_at(survey, x, y);
            const double per_s = (double)n_events / duration_s;

            if (per_s <= limit_per_s || n_events < HOT_MIN_EVENTS ||
                !stands_out(survey, x, y, n_events))
                continue;
            if (n_stored < SHEF_SURVEY_HOT_PIXELS)
                out_pixels[n_stored++] = (struct shef_survey_hot_pixel){ x, y, per_s };
            n++;
        }
    qsort(out_pixels, n_stored, sizeof *out_pixels, compare_hot);
    return n;
}
