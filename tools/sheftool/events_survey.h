/* What a stream of events is like: rate, triggers, pauses, and how often each pixel fires.
 *
 * Batches go in one after the other; memory does not grow with the length of the stream.
 * Thread: main. */
#ifndef SHEFTOOL_EVENTS_SURVEY_H
#define SHEFTOOL_EVENTS_SURVEY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/packets.h"

#define SHEF_SURVEY_BINS     2000
#define SHEF_SURVEY_CHANNELS 32
#define SHEF_SURVEY_MARKS    65536 /* rising edges kept: 20 minutes at 54 Hz */
#define SHEF_SURVEY_LOSSES   256

/* Events in one stretch of time. */
struct shef_survey_bin {
    uint64_t n_on;
    uint64_t n_off;
};

/* One trigger input. Intervals are between rising edges. */
struct shef_survey_channel {
    uint64_t n_rising;
    uint64_t n_falling;
    int64_t last_rising_us;
    int64_t min_interval_us;
    int64_t max_interval_us;
    double sum_high_us; /* from a rising edge to the falling one after it */
    uint64_t n_high;
    bool is_high;
};

/* A rising edge. */
struct shef_survey_mark {
    int64_t t_us;
    uint8_t channel;
};

/* Data that were lost between two times. */
struct shef_survey_loss {
    int64_t from_us;
    int64_t to_us;
};

struct shef_survey {
    /* Set by create. */
    int64_t pause_us; /* a silence from this length on is a pause */
    /* Times of events and triggers, event time. */
    bool has_time;
    int64_t first_us;
    int64_t last_us;
    bool has_event;
    int64_t latest_us; /* of the last event seen, for pauses */
    uint64_t n_on;
    uint64_t n_off;
    /* The rate over time: bins of equal length from first_us on. */
    int64_t bin_us;
    uint32_t n_bins;
    struct shef_survey_bin bins[SHEF_SURVEY_BINS];
    /* The busiest millisecond. */
    int64_t peak_ms;
    uint64_t peak_n;
    int64_t current_ms;
    uint64_t current_n;
    /* How often each pixel fired; grows with the coordinates. */
    uint32_t width_px;
    uint32_t height_px;
    uint32_t *on; /* width_px * height_px, owned */
    uint32_t *off;
    uint32_t used_width_px; /* the largest coordinates that came, and one more */
    uint32_t used_height_px;
    /* Triggers. */
    struct shef_survey_channel channels[SHEF_SURVEY_CHANNELS];
    struct shef_survey_mark marks[SHEF_SURVEY_MARKS]; /* the first ones */
    uint32_t n_marks;
    uint64_t n_triggers;
    /* Silences, in which triggers may come. */
    uint64_t n_pauses;
    int64_t longest_us;
    int64_t longest_at_us;
    /* Places where the stream itself shows that data were lost, the first ones. */
    struct shef_survey_loss losses[SHEF_SURVEY_LOSSES];
    uint32_t n_losses;
};

/*   width_px, height_px  of the sensor; 0: not known
 * SHEF_ERR_NO_MEMORY */
SHEF_MUST_CHECK enum shef_err shef_survey_create(struct shef_survey *survey, uint32_t width_px,
                                                 uint32_t height_px, int64_t pause_us,
                                                 struct shef_error *err);

/* Takes a batch in.
 *   n_jumps  how often time jumped over lost data in it
 * SHEF_ERR_NO_MEMORY: the coordinates became too large. */
SHEF_MUST_CHECK enum shef_err shef_survey_add(struct shef_survey *survey,
                                              const struct shef_event_batch *batch,
                                              uint64_t n_jumps, struct shef_error *err);

/* The usual interval between the rising edges of a channel: the median of those that are kept.
 * 0 where there are not two. */
int64_t shef_survey_usual_interval_us(const struct shef_survey *survey, int channel);

/* How many edges seem to be missing in longer intervals between those that are kept. */
uint64_t shef_survey_missing_edges(const struct shef_survey *survey, int channel);

/* How long a bin is, in us: the last one ends with the stream. */
double shef_survey_bin_us(const struct shef_survey *survey, uint32_t bin);

/* The bins whose rate says something: not a last one that ends within its first half, in which a
 * single event would look like a burst. */
uint32_t shef_survey_rated_bins(const struct shef_survey *survey);

double shef_survey_duration_s(const struct shef_survey *survey);

/* Millions of events a second, 0 where there is no duration. */
double shef_survey_mean_mev_per_s(const struct shef_survey *survey);
double shef_survey_peak_mev_per_s(const struct shef_survey *survey);

struct shef_survey_hot_pixel {
    uint32_t x_px;
    uint32_t y_px;
    double per_s;
};

#define SHEF_SURVEY_HOT_PIXELS 4096

/* The pixels that fired more often than limit_per_s over the whole stream, at least 20 times, and
 * four times as often as their neighbours; the busiest first.
 *   out_pixels  SHEF_SURVEY_HOT_PIXELS
 * Returns how many there are, which may be more than were stored. */
uint32_t shef_survey_hot_pixels(const struct shef_survey *survey, double limit_per_s,
                                struct shef_survey_hot_pixel *out_pixels);

/* A zeroed survey is allowed. */
void shef_survey_destroy(struct shef_survey *survey);

#endif
