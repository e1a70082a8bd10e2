/* Per-pixel high-pass filter of the event stream, on the sensor's own pixels.
 *
 * Each event adds plus or minus one contrast step to its pixel's level, and every level decays:
 *   level(t) = sum over the pixel's events of +-gain * exp(-cutoff * (t - t_event))
 * Scheerlinck et al., ACCV 2018, with c = 1; cut-off 120 rad/s as in Wang 2021. What is left shows
 * where brightness changed within the last 1 / cutoff: the edges.
 *
 * Levels are int32 (2^18 a step) and saturate; time is the low 32 bits of the event time in us,
 * exact across their wrap. Small backward steps in time count as no time; a level whose pixel was
 * quiet for about 30 / cutoff is exactly zero. The error against double precision stays below
 * 2e-4 of a step on real streams, pixels that fire every 7 us included.
 *
 * Beside the level each pixel has a running sum of its signed gains, which never decays: the
 * difference of two of its read-outs is what the events between them add up to.
 *
 * Reading changes nothing. After create() nothing allocates, locks or logs.
 * Thread: one at a time per filter. Time: event time. */
#ifndef SHEF_PIPELINE_FILTER_H
#define SHEF_PIPELINE_FILTER_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/packets.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_filter;

#define SHEF_FILTER_LEVEL_STEP 262144 /* one contrast step in levels: 2^18 */
#define SHEF_FILTER_VALUE_STEP 256    /* and in the images read from the filter */
#define SHEF_FILTER_MAX_MASKED 4096

struct shef_filter_params {
    int32_t width_px; /* of the sensor, 1..2048 */
    int32_t height_px;
    double cutoff_rad_s; /* 8..2000 */
    double on_gain;      /* what an event of each polarity adds, in contrast steps, 0.01..16 */
    double off_gain;
    int32_t back_step_us; /* times this much before the newest are jitter, 0..1000000 */
};

/* 120 rad/s, gains of 1, 5 ms of jitter. */
struct shef_filter_params shef_filter_default_params(int32_t width_px, int32_t height_px);

/* Allocates and starts with all levels zero.                      Thread: setup.
 *   cpu_features  the instruction sets to read with, usually shef_cpu_features()
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_filter_create(struct shef_filter **out_filter,
                                                 const struct shef_filter_params *params,
                                                 uint32_t cpu_features, struct shef_error *err);

/* NULL is allowed. */
void shef_filter_destroy(struct shef_filter *filter);

/* Gains of one pixel on top of those of its polarity: 256 = 1, as a calibration gives them. */
struct shef_filter_gain {
    uint16_t on_q8;
    uint16_t off_q8;
};

/* Copies a gain for every pixel, row by row; NULL: all are 1 again, which is faster.
 * Levels keep what they have.                                     Thread: setup.
 * SHEF_ERR_NO_MEMORY: nothing has changed. */
SHEF_MUST_CHECK enum shef_err shef_filter_set_gains(struct shef_filter *filter,
                                                    const struct shef_filter_gain *gains,
                                                    struct shef_error *err);

/* Applies events in their order up to the first one later than `until`.
 *   base_us  what the events' times count from
 * Returns how many events were used up: all, unless one is later, or a new epoch has begun with the
 * last one used. Events outside the sensor are left out and counted. So are times that leave the
 * stream's course (back by more than back_step_us, or ahead by more than 10 s) until
 * SHEF_FILTER_CONFIRMATIONS of them in a row agree: then time goes on from there, after a step back
 * with all levels zero, which is a new epoch. */
#define SHEF_FILTER_CONFIRMATIONS 16
SHEF_MUST_CHECK uint32_t shef_filter_apply(struct shef_filter *filter,
                                           const struct shef_event *events, uint32_t n_events,
                                           int64_t base_us, shef_event_time until);

/* Reads all pixels at one instant, in 1/256 contrast step, clamped to +-32767; masked pixels are
 * zero. Sub-microseconds of the instant are dropped. Events newer than the instant must not have
 * been applied: they would count as if they had come at it.
 *   out_values  of the sensor's size */
void shef_filter_read(const struct shef_filter *filter, shef_event_time at,
                      struct shef_image_i16 out_values);

/* Reads the running sums, in 1/256 contrast step modulo 2^16; masked pixels are zero. */
void shef_filter_read_sums(const struct shef_filter *filter, struct shef_image_i16 out_sums);

/* Adds a share of what the running sums gained since they were last read:
 *   values += weight * (sums - before), saturating;  before = sums
 * Exact for pixels that gained less than 128 contrast steps. Masked pixels become zero.
 *   weight  0..1, rounded to 2^-15 */
void shef_filter_accrue_sums(const struct shef_filter *filter, double weight,
                             struct shef_image_i16 values, struct shef_image_i16 before);

/* The level of one pixel, 2^18 a step, as the filter's own arithmetic continues it. */
int32_t shef_filter_level(const struct shef_filter *filter, int32_t x_px, int32_t y_px,
                          shef_event_time at);

/* Masks these pixels and no others: they read as zero. Their levels live on, so that unmasking
 * needs no time to settle.
 *   pixels    y * width_px + x, not kept
 *   n_pixels  0..SHEF_FILTER_MAX_MASKED */
void shef_filter_set_mask(struct shef_filter *filter, const uint32_t *pixels, uint32_t n_pixels);

struct shef_filter_stats {
    uint64_t n_events;  /* applied */
    uint64_t n_outside; /* left out: not on the sensor */
    uint64_t n_strays;  /* left out: time off the stream's course */
    uint32_t n_epochs;  /* how often time started anew further back */
};

struct shef_filter_stats shef_filter_stats(const struct shef_filter *filter);

/* The newest time applied; INT64_MIN ns before the first event. */
shef_event_time shef_filter_newest(const struct shef_filter *filter);

/* How long the filter's memory is: 1 / cutoff. By this much its read-out lags behind the edges. */
int64_t shef_filter_lag_ns(const struct shef_filter *filter);

const struct shef_filter_params *shef_filter_params(const struct shef_filter *filter);

#ifdef __cplusplus
}
#endif

#endif
