/* The event camera's pixels: rendered images in, events in the order of their times out.
 *
 * Each pixel watches the logarithm of the light that falls on it, linear in time between two
 * images. When it has moved by a threshold from the pixel's reference, the pixel fires and its
 * reference moves by that threshold; the event's time is when the line crosses. With everything
 * else switched off a step yields floor(change / threshold) events, as published models do (ESIM,
 * Rebecq 2018; v2e, Hu 2021). On top of that, each switched by its parameter:
 *
 *   mismatch    every pixel's thresholds differ, ON and OFF independently
 *   latency     every event comes later by this; jitter: and by a random time, different each time
 *   dead time   after an event a pixel is silent; what it would have said it says afterwards
 *   leak        references sink, so pixels in constant light say ON now and then; how far they
 *               have sunk at the first image is random
 *   background  random events of both signs that have nothing to do with the light
 *   hot pixels  a few pixels that fire by themselves, two thirds ON, in jittered intervals
 *   read-out    events leave row by row at a limited rate, see event_readout.h
 *
 * Background and hot events leave a pixel's reference alone, but keep it busy for the dead time;
 * if one falls into a step, the pixel's own events of that step come after it.
 *
 * Same parameters, seed and images: same events, whatever the threads and instruction sets.
 * Thread: one at a time; steps share their work with the workers. */
#ifndef SHEFSIM_EVENT_SENSOR_H
#define SHEFSIM_EVENT_SENSOR_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/packets.h"
#include "core/workers.h"
#include "shefsim/event_readout.h"

struct sim_event_sensor_params {
    double threshold_on;  /* change of ln(light) that makes an event, 0.01..10 */
    double threshold_off; /* the same */
    double mismatch;      /* deviation of the thresholds between pixels, share of them, 0..0.5 */
    double dark;          /* light added before the logarithm, share of white, 1e-6..1 */
    int64_t dead_time_ns; /* 0..1 s */
    int64_t latency_ns;   /* 0..10 ms */
    int64_t jitter_ns;    /* deviation, 0..1 ms; at most 3.46 times this */
    double leak_hz;       /* ON events per pixel and second, 0..100 */
    double background_hz; /* events per pixel and second, 0..1000 */
    double hot_share;     /* of the pixels, 0..0.1 */
    double hot_min_hz;    /* rates of hot pixels are even between these, 1..1000 */
    double hot_max_hz;    /* at least hot_min_hz */
    struct sim_event_readout_params readout;
};

/* The named noise: "clean" (exact thresholds of 0.30 and nothing else), "typical", "hard".
 * False: there is no such name. */
bool sim_event_sensor_preset(const char *name, struct sim_event_sensor_params *out_params);

/* The names, "clean|typical|hard". */
#define SIM_EVENT_SENSOR_PRESETS "clean|typical|hard"

/* What a sensor has done since it was made. */
struct sim_event_sensor_stats {
    uint64_t n_events;     /* that left the sensor */
    uint64_t n_signal;     /* that the pixels made, of the light and the leak */
    uint64_t n_background; /* that were not swallowed by a dead time */
    uint64_t n_hot;        /* the same */
    uint64_t n_lost;       /* that the read-out had no room for */
    uint64_t n_bursts;     /* rows that it read with more than one event */
};

/* Lent until the next call. Times rise; an event's time is base_us + t_us. */
struct sim_events {
    const struct shef_event *events;
    size_t n;
    int64_t base_us;
    int64_t complete_us; /* all events before this have been handed over */
};

struct sim_event_sensor;

/*   params        within their ranges, or SHEF_ERR_INVALID names the one that is not
 *   width_px, height_px  1..2048
 *   cpu_features  which implementations may be picked
 *   workers       may be NULL; kept
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_event_sensor_create(struct sim_event_sensor **out_sensor,
                                                      const struct sim_event_sensor_params *params,
                                                      int32_t width_px, int32_t height_px,
                                                      uint64_t seed, uint32_t cpu_features,
                                                      struct shef_workers *workers,
                                                      struct shef_error *err);

/* Takes the next image. The first one sets all references and yields no events.
 *   t_ns      event time, at most 1 s after the last one's, and later
 *   radiance  of the sensor's size; 1 is white, below 0 counts as 0
 * SHEF_ERR_NO_MEMORY: the sensor is of no more use. */
SHEF_MUST_CHECK enum shef_err sim_event_sensor_step(struct sim_event_sensor *sensor, int64_t t_ns,
                                                    struct shef_image_f32 radiance,
                                                    struct sim_events *out_events,
                                                    struct shef_error *err);

/* The same for an image of logarithms: only the thresholds' unit counts. */
SHEF_MUST_CHECK enum shef_err sim_event_sensor_step_log(struct sim_event_sensor *sensor,
                                                        int64_t t_ns, struct shef_image_f32 log,
                                                        struct sim_events *out_events,
                                                        struct shef_error *err);

/* Hands over what latency, jitter and read-out still hold back. Then only destroy may follow. */
SHEF_MUST_CHECK enum shef_err sim_event_sensor_flush(struct sim_event_sensor *sensor,
                                                     struct sim_events *out_events,
                                                     struct shef_error *err);

/* The logarithms that the last step saw, without the leak: exact as floats. */
void sim_event_sensor_log(const struct sim_event_sensor *sensor, struct shef_image_f32 out_log);

struct sim_event_sensor_stats sim_event_sensor_stats(const struct sim_event_sensor *sensor);

/* NULL is allowed. */
void sim_event_sensor_destroy(struct sim_event_sensor *sensor);

#endif
