/* Learns which pixels of the event camera fire on their own.
 *
 * Every eighth event of the stream is counted for its pixel. A pixel whose rate stays above the
 * limit for several windows in a row is hot; it is let go when it has stayed below half the limit
 * for eight times as long. Both depend on the events and their times only, not on how they come
 * in batches. Known hot pixels can be given in advance; they stay.
 *
 * After create() nothing allocates, locks or logs. Thread: one at a time. Time: event time. */
#ifndef SHEF_PIPELINE_HOT_PIXELS_H
#define SHEF_PIPELINE_HOT_PIXELS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/packets.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_HOT_PIXELS_MAX 4096

struct shef_hot_pixels_params {
    int32_t width_px; /* of the sensor, 1..2048 */
    int32_t height_px;
    double limit_per_s; /* 10..1e6 events a second */
    int32_t window_ms;  /* 1..10000 */
    int32_t n_windows;  /* hot for so many in a row, 1..15 */
};

/* 2700 a second (50 in a frame of 54 a second), 3 windows of 100 ms. Edges of strong texture that
 * pass at 0.35 m/s stay below 1000 a second. */
struct shef_hot_pixels_params shef_hot_pixels_default_params(int32_t width_px, int32_t height_px);

struct shef_hot_pixels;

/* SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated.    Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_hot_pixels_create(struct shef_hot_pixels **out_hot,
                                                     const struct shef_hot_pixels_params *params,
                                                     struct shef_error *err);

/* NULL is allowed. */
void shef_hot_pixels_destroy(struct shef_hot_pixels *hot);

/* Takes a pixel as hot for good, as an earlier recording found it.
 * SHEF_ERR_INVALID: not on the sensor. SHEF_ERR_FULL: there are SHEF_HOT_PIXELS_MAX. */
SHEF_MUST_CHECK enum shef_err shef_hot_pixels_add(struct shef_hot_pixels *hot, int32_t x_px,
                                                  int32_t y_px, struct shef_error *err);

/* Starts the first window, or starts anew after time has jumped. What is learnt is kept. */
void shef_hot_pixels_start(struct shef_hot_pixels *hot, shef_event_time now);

/* Counts the stream's next events, all before the window's end. Those outside the sensor are
 * passed over. */
void shef_hot_pixels_count(struct shef_hot_pixels *hot, const struct shef_event *events,
                           uint32_t n_events);

/* When the window ends; INT64_MAX ns before start(). */
shef_event_time shef_hot_pixels_due(const struct shef_hot_pixels *hot);

/* Ends the window at its due time, or later after a gap in the stream, and starts the next.
 * Returns whether the hot pixels are others than before. */
bool shef_hot_pixels_learn(struct shef_hot_pixels *hot, shef_event_time now);

struct shef_hot_pixel {
    uint16_t x_px;
    uint16_t y_px;
    float per_s; /* rate when last seen above half the limit; 0 for a given one not yet seen so */
};

/* The hot pixels, and as y * width_px + x; both valid until the next learn() or add().
 * Returns how many. */
uint32_t shef_hot_pixels_list(const struct shef_hot_pixels *hot,
                              const struct shef_hot_pixel **out_pixels,
                              const uint32_t **out_indices);

#ifdef __cplusplus
}
#endif

#endif
