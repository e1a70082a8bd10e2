#include "event_runs.h"

#include <math.h>
#include <stdlib.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "support/support.h"

struct shef_image_f32 image;
struct sim_event_sensor *sensor;
struct sim_event_sensor_params params;

struct seen_events seen;

void setUp(void)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_image_create_f32(&image, WIDTH, HEIGHT, &err));
    TEST_ASSERT_TRUE(sim_event_sensor_preset("clean", &params));
    sensor = NULL;
    seen = (struct seen_events){ .complete_us = INT64_MIN };
}

void sensor_forget(void)
{
    sim_event_sensor_destroy(sensor);
    free(seen.events);
    free(seen.t_us);
    sensor = NULL;
    seen = (struct seen_events){ .complete_us = INT64_MIN };
}

void tearDown(void)
{
    sensor_forget();
    shef_image_destroy_f32(&image);
}

/* Logarithm of the light at a pixel: waves of several lengths that move, each pixel a little
 * different, from deep black to white. */
double light_log(int32_t x, int32_t y, double s)
{
    return -2 + 1.5 * sin(0.3 * x + 0.11 * y - 40 * s) + 0.8 * sin(0.9 * y + 0.2 * x + 65 * s) -
           0.2 * sin(0.01 * x * y + 200 * s);
}

void image_paint(double s)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(image, y)[x] = (float)exp(light_log(x, y, s));
}

void image_paint_constant(float light)
{
    for (int32_t y = 0; y < HEIGHT; y++)
        for (int32_t x = 0; x < WIDTH; x++)
            shef_row_f32(image, y)[x] = light;
}

void sensor_make_with(uint64_t seed, uint32_t features, struct shef_workers *workers)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT_MESSAGE(
        SHEF_OK,
        sim_event_sensor_create(&sensor, &params, WIDTH, HEIGHT, seed, features, workers, &err),
        err.text);
}

void sensor_make(uint64_t seed)
{
    sensor_make_with(seed, shef_cpu_features(), NULL);
}

static void note(const struct sim_events *events)
{
    const size_t n = seen.n + events->n;

    if (n > seen.capacity) {
        seen.capacity = 2 * n;
        seen.events = reallocarray(seen.events, seen.capacity, sizeof *seen.events);
        seen.t_us = reallocarray(seen.t_us, seen.capacity, sizeof *seen.t_us);
        TEST_ASSERT_NOT_NULL(seen.events);
        TEST_ASSERT_NOT_NULL(seen.t_us);
    }
    for (size_t i = 0; i < events->n; i++) {
        const int64_t t_us = events->base_us + events->events[i].t_us;

        TEST_ASSERT_TRUE_MESSAGE(t_us >= seen.complete_us, "earlier than what was complete");
        TEST_ASSERT_TRUE(seen.n == 0 || t_us >= seen.t_us[seen.n - 1]);
        TEST_ASSERT_TRUE(events->events[i].x_px < WIDTH);
        TEST_ASSERT_TRUE(shef_event_y_px(events->events[i]) < HEIGHT);
        seen.events[seen.n] = events->events[i];
        seen.t_us[seen.n++] = t_us;
    }
    seen.complete_us = events->complete_us;
}

void sensor_show(int64_t t_us)
{
    struct sim_events events;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK,
                          sim_event_sensor_step(sensor, t_us * 1000, image, &events, &err));
    note(&events);
}

void sensor_end(void)
{
    struct sim_events events;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_event_sensor_flush(sensor, &events, &err));
    note(&events);
}

/* Shows the moving texture for a while. */
void run_texture(int32_t n_steps)
{
    for (int32_t i = 0; i <= n_steps; i++) {
        image_paint(i * STEP_US * 1e-6);
        sensor_show((int64_t)i * STEP_US);
    }
    sensor_end();
}

void run_constant(float light, int32_t n_steps)
{
    image_paint_constant(light);
    for (int32_t i = 0; i <= n_steps; i++)
        sensor_show((int64_t)i * 10 * STEP_US);
    sensor_end();
}

size_t pixel_of(size_t i)
{
    return (size_t)shef_event_y_px(seen.events[i]) * WIDTH + seen.events[i].x_px;
}
