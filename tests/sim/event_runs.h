/* Runs of the event sensor on images made here, and all events they gave.
 *
 * The images are 80 x 64 px: waves of several lengths that move, from deep black to white, each
 * pixel a little different; or one light everywhere. setUp() makes the image and takes the preset
 * `clean`; tearDown() frees everything. Thread: the test's main thread. */
#ifndef SHEF_TESTS_SIM_EVENT_RUNS_H
#define SHEF_TESTS_SIM_EVENT_RUNS_H

#include <stddef.h>
#include <stdint.h>

#include "core/workers.h"
#include "shefsim/event_sensor.h"

enum { WIDTH = 80, HEIGHT = 64, N_PIXELS = WIDTH * HEIGHT, STEP_US = 2000 };

/* All events of a run. */
struct seen_events {
    struct shef_event *events;
    int64_t *t_us;
    size_t n;
    size_t capacity;
    int64_t complete_us;
};

extern struct shef_image_f32 image;
extern struct sim_event_sensor *sensor;
extern struct sim_event_sensor_params params;
extern struct seen_events seen;

/* Makes the sensor with params. */
void sensor_make_with(uint64_t seed, uint32_t features, struct shef_workers *workers);
void sensor_make(uint64_t seed);

/* Destroys the sensor and forgets its events. */
void sensor_forget(void);

/* ln(light) at a pixel of the waves after so many seconds, without the dark light. */
double light_log(int32_t x, int32_t y, double s);

/* Fill the image. */
void image_paint(double s);
void image_paint_constant(float light);

/* Shows the image to the sensor, or ends the run; keeps the events and checks their order. */
void sensor_show(int64_t t_us);
void sensor_end(void);

/* Shows the waves for so many steps of STEP_US, or one light for ten times as long. */
void run_texture(int32_t n_steps);
void run_constant(float light, int32_t n_steps);

/* The pixel of an event, row by row. */
size_t pixel_of(size_t i);

#endif
