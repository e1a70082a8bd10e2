/* What the parts of the event sensor share: its state, and the lists they fill.
 *
 * Private to event_*.c. */
#ifndef SHEFSIM_EVENT_SENSOR_PARTS_H
#define SHEFSIM_EVENT_SENSOR_PARTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/workers.h"
#include "shefsim/event_sensor.h"
#include "shefsim/kernels/event_scan.h"

#define SIM_EVENT_SENSOR_MAX_SIDE_PX 2048

/* Jitter never moves an event by more than this many deviations, see sim_bell(). */
#define SIM_JITTER_MAX 3.47

struct sim_event_list {
    struct shef_event *events; /* owned */
    size_t n;
    size_t capacity;
};

/* Room for at least this many in all. False: out of memory; the list is as it was. */
bool sim_event_list_reserve(struct sim_event_list *list, size_t capacity);

/* Some rows, and what their pixels say in one step. */
struct sim_event_band {
    int32_t y_begin;
    int32_t y_end;
    struct sim_event_list list;
    bool has_failed; /* out of memory */
};

struct sim_hot_pixel {
    uint32_t pixel;
    int64_t period_ns;
    int64_t n_fired;
};

/* Two images, one step. */
struct sim_event_step {
    struct shef_image_f32 image;
    bool is_log;
    int64_t from_ns;
    int64_t to_ns;
    int64_t base_us;     /* of all times in lists */
    int64_t complete_us; /* nothing that comes after this step is earlier */
    int32_t ramp;        /* the leak so far, in levels, at to_ns */
    uint64_t jitter_key;
};

struct sim_event_sensor {
    /* Set by create. */
    struct sim_event_sensor_params params;
    int32_t width_px;
    int32_t height_px;
    uint64_t seed;
    struct shef_workers *workers;
    const struct sim_event_scan_impl *scan;
    int32_t *threshold_on; /* levels, one for each pixel, row by row */
    int32_t *threshold_off;
    struct sim_hot_pixel *hot;
    size_t n_hot;
    struct sim_event_band *bands;
    int32_t n_bands;
    /* What the pixels remember. */
    int32_t *level;      /* at the last image, the leak included */
    int32_t *next_level; /* at the one being taken */
    int32_t *reference;
    int32_t *low; /* reference - threshold_off, and so on */
    int32_t *high;
    int64_t *free_ns; /* until then the pixel is silent; NULL: none ever is */
    /* Where it is. */
    uint64_t n_steps;
    int64_t start_ns;
    int64_t now_ns;
    int64_t base_us;
    int64_t ramp_zero_ns;        /* when the leak's ramp was zero */
    struct sim_event_list loose; /* noise, and what was held back */
    struct sim_event_list sorted;
    struct sim_event_list served;
    uint32_t *buckets;
    size_t n_buckets;
    struct sim_event_readout readout;
    struct sim_event_sensor_stats stats;
};

/* SHEF_ERR_INVALID: a parameter is out of its range. */
SHEF_MUST_CHECK enum shef_err sim_event_sensor_check(const struct sim_event_sensor_params *params,
                                                     struct shef_error *err);

/* Draws the thresholds and picks the hot pixels. */
void sim_event_pixels_draw(struct sim_event_sensor *sensor);

/* Sets all references to the image, less what has leaked from them. */
void sim_event_pixels_start(struct sim_event_sensor *sensor, const struct sim_event_step *step);

/* Lets the pixels of one band speak. Bands can run at the same time. */
void sim_event_pixels_run(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                          struct sim_event_band *band);

/* Adds a step's background and hot events to the loose ones. False: out of memory. */
bool sim_event_noise_run(struct sim_event_sensor *sensor, const struct sim_event_step *step);

/* Sorts all lists by time into `sorted`, keeps what is not complete as loose.
 * Returns how many are complete, or SIZE_MAX: out of memory. */
size_t sim_event_order_run(struct sim_event_sensor *sensor, const struct sim_event_step *step);

#endif
