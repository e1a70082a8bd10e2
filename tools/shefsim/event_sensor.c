#include "shefsim/event_sensor.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/time.h"
#include "shefsim/event_sensor_parts.h"
#include "shefsim/random.h"

#define ROWS_A_BAND 30

/* The leak's ramp starts again before it could overflow. */
#define MAX_RAMP (1 << 26)

/* More than latency, jitter and a full read-out can hold an event back. */
#define FLUSH_NS (10 * SHEF_NS_PER_S)

static enum shef_err no_memory(struct shef_error *err)
{
    return shef_fail(err, SHEF_ERR_NO_MEMORY, "simulate the event sensor: out of memory");
}

static bool allocate(struct sim_event_sensor *sensor)
{
    const struct sim_event_sensor_params *params = &sensor->params;
    const size_t n = (size_t)sensor->width_px * (size_t)sensor->height_px;
    const bool can_be_silent = params->dead_time_ns > 0 || params->jitter_ns > 0;
    int32_t **const planes[] = { &sensor->threshold_on, &sensor->threshold_off, &sensor->level,
                                 &sensor->next_level,   &sensor->reference,     &sensor->low,
                                 &sensor->high };

    for (size_t i = 0; i < sizeof planes / sizeof planes[0]; i++) {
        *planes[i] = shef_memory_create(n, sizeof **planes[i]);
        if (!*planes[i])
            return false;
    }
    if (can_be_silent) {
        sensor->free_ns = shef_memory_create(n, sizeof *sensor->free_ns);
        for (size_t i = 0; sensor->free_ns && i < n; i++)
            sensor->free_ns[i] = INT64_MIN;
    }
    sensor->n_hot = (size_t)(params->hot_share * (double)n + 0.5);
    sensor->hot = shef_memory_create(sensor->n_hot + 1, sizeof *sensor->hot);
    sensor->n_bands = (sensor->height_px + ROWS_A_BAND - 1) / ROWS_A_BAND;
    sensor->bands = shef_memory_create((size_t)sensor->n_bands, sizeof *sensor->bands);
    return (!can_be_silent || sensor->free_ns) && sensor->hot && sensor->bands;
}

enum shef_err sim_event_sensor_create(struct sim_event_sensor **out_sensor,
                                      const struct sim_event_sensor_params *params,
                                      int32_t width_px, int32_t height_px, uint64_t seed,
                                      uint32_t cpu_features, struct shef_workers *workers,
                                      struct shef_error *err)
{
    enum shef_err code = sim_event_sensor_check(params, err);
    struct sim_event_sensor *sensor;

    assert(width_px >= 1 && width_px <= SIM_EVENT_SENSOR_MAX_SIDE_PX);
    assert(height_px >= 1 && height_px <= SIM_EVENT_SENSOR_MAX_SIDE_PX);
    if (code != SHEF_OK)
        return code;
    sensor = calloc(1, sizeof *sensor);
    if (!sensor)
        return no_memory(err);
    sensor->params = *params;
    sensor->width_px = width_px;
    sensor->height_px = height_px;
    sensor->seed = seed;
    sensor->workers = workers;
    sensor->scan = sim_event_scan_pick(cpu_features);
    code = allocate(sensor) ? SHEF_OK : no_memory(err);
    if (code == SHEF_OK)
        code = sim_event_readout_init(&sensor->readout, &params->readout, height_px, err);
    if (code != SHEF_OK) {
        sim_event_sensor_destroy(sensor);
        return code;
    }
    for (int32_t i = 0; i < sensor->n_bands; i++) {
        const int32_t end = (i + 1) * ROWS_A_BAND;

        sensor->bands[i].y_begin = i * ROWS_A_BAND;
        sensor->bands[i].y_end = end < height_px ? end : height_px;
    }
    sim_event_pixels_draw(sensor);
    *out_sensor = sensor;
    return SHEF_OK;
}

void sim_event_sensor_destroy(struct sim_event_sensor *sensor)
{
    if (!sensor)
        return;
    free(sensor->threshold_on);
    free(sensor->threshold_off);
    free(sensor->level);
    free(sensor->next_level);
    free(sensor->reference);
    free(sensor->low);
    free(sensor->high);
    free(sensor->free_ns);
    free(sensor->hot);
    for (int32_t i = 0; sensor->bands && i < sensor->n_bands; i++)
        free(sensor->bands[i].list.events);
    free(sensor->bands);
    free(sensor->loose.events);
    free(sensor->sorted.events);
    free(sensor->served.events);
    free(sensor->buckets);
    sim_event_readout_deinit(&sensor->readout);
    free(sensor);
}

/* Nothing that comes after t_ns can carry an earlier time than this. */
static int64_t complete_us(const struct sim_event_sensor *sensor, int64_t t_ns)
{
    const int64_t earliest_ns = sensor->params.latency_ns -
                                (int64_t)ceil(SIM_JITTER_MAX * (double)sensor->params.jitter_ns);
    const int64_t ns = t_ns + (earliest_ns < 0 ? earliest_ns : 0);

    return ns / SHEF_NS_PER_US - (ns < 0);
}

/* How far the leak has lifted all levels against their references. */
static int32_t ramp_at(const struct sim_event_sensor *sensor, int64_t t_ns)
{
    const double s = (double)(t_ns - sensor->ramp_zero_ns) * 1e-9;

    return (int32_t)(sensor->params.leak_hz * sensor->params.threshold_on * SIM_LEVEL_ONE * s);
}

static void restart_ramp(struct sim_event_sensor *sensor)
{
    const int32_t ramp = ramp_at(sensor, sensor->now_ns);
    const size_t n = (size_t)sensor->width_px * (size_t)sensor->height_px;

    if (ramp < MAX_RAMP)
        return;
    for (size_t i = 0; i < n; i++) {
        sensor->level[i] -= ramp;
        sensor->reference[i] -= ramp;
        sensor->low[i] -= ramp;
        sensor->high[i] -= ramp;
    }
    sensor->ramp_zero_ns = sensor->now_ns;
}

struct band_job {
    struct sim_event_sensor *sensor;
    const struct sim_event_step *step;
};

static void run_band(void *context, int32_t task, int32_t worker)
{
    const struct band_job *job = context;

    (void)worker;
    sim_event_pixels_run(job->sensor, job->step, &job->sensor->bands[task]);
}

static bool run_pixels(struct sim_event_sensor *sensor, const struct sim_event_step *step)
{
    struct band_job job = { sensor, step };
    bool is_ok = true;

    shef_workers_run(sensor->workers, run_band, &job, sensor->n_bands);
    for (int32_t i = 0; i < sensor->n_bands; i++) {
        is_ok = is_ok && !sensor->bands[i].has_failed;
        sensor->stats.n_signal += sensor->bands[i].list.n;
    }
    return is_ok;
}

/* Sorted events on their way out. */
static enum shef_err hand_over(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                               size_t n_complete, struct sim_events *out_events,
                               struct shef_error *err)
{
    struct sim_readout_out out = { .base_us = step->base_us };

    *out_events = (struct sim_events){
        .events = sensor->sorted.events,
        .n = n_complete,
        .base_us = step->base_us,
        .complete_us = step->complete_us,
    };
    sensor->base_us = step->complete_us;
    if (sensor->params.readout.is_limited) {
        if (!sim_event_list_reserve(&sensor->served, n_complete + sensor->readout.n_waiting))
            return no_memory(err);
        out.events = sensor->served.events;
        sim_event_readout_run(&sensor->readout, sensor->sorted.events, n_complete, step->base_us,
                              step->complete_us, &out);
        out_events->events = out.events;
        out_events->n = out.n;
        sensor->stats.n_lost = sensor->readout.n_lost;
        sensor->stats.n_bursts = sensor->readout.n_bursts;
    }
    sensor->stats.n_events += out_events->n;
    return SHEF_OK;
}

static void start(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                  struct sim_events *out_events)
{
    sensor->start_ns = step->to_ns;
    sensor->ramp_zero_ns = step->to_ns;
    sensor->base_us = complete_us(sensor, step->to_ns);
    sim_event_pixels_start(sensor, step);
    *out_events = (struct sim_events){ .base_us = sensor->base_us, .complete_us = sensor->base_us };
}

static enum shef_err run_step(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                              struct sim_events *out_events, struct shef_error *err)
{
    if (!sim_event_noise_run(sensor, step) || !run_pixels(sensor, step))
        return no_memory(err);

    const size_t n_complete = sim_event_order_run(sensor, step);

    return n_complete == SIZE_MAX ? no_memory(err)
                                  : hand_over(sensor, step, n_complete, out_events, err);
}

static enum shef_err take(struct sim_event_sensor *sensor, int64_t t_ns,
                          struct shef_image_f32 image, bool is_log, struct sim_events *out_events,
                          struct shef_error *err)
{
    const bool is_first = sensor->n_steps == 0;
    enum shef_err code = SHEF_OK;

    assert(image.width_px == sensor->width_px && image.height_px == sensor->height_px);
    assert(is_first || (t_ns > sensor->now_ns && t_ns - sensor->now_ns <= SHEF_NS_PER_S));
    if (!is_first)
        restart_ramp(sensor);

    const struct sim_event_step step = {
        .image = image,
        .is_log = is_log,
        .from_ns = sensor->now_ns,
        .to_ns = t_ns,
        .base_us = sensor->base_us,
        .complete_us = complete_us(sensor, t_ns),
        .ramp = is_first ? 0 : ramp_at(sensor, t_ns),
        .jitter_key = sim_key(sensor->seed, SIM_STREAM_JITTER, sensor->n_steps),
    };

    if (is_first)
        start(sensor, &step, out_events);
    else
        code = run_step(sensor, &step, out_events, err);

    int32_t *const old = sensor->level;

    sensor->level = sensor->next_level;
    sensor->next_level = old;
    sensor->now_ns = t_ns;
    sensor->n_steps++;
    return code;
}

enum shef_err sim_event_sensor_step(struct sim_event_sensor *sensor, int64_t t_ns,
                                    struct shef_image_f32 radiance, struct sim_events *out_events,
                                    struct shef_error *err)
{
    return take(sensor, t_ns, radiance, false, out_events, err);
}

enum shef_err sim_event_sensor_step_log(struct sim_event_sensor *sensor, int64_t t_ns,
                                        struct shef_image_f32 log, struct sim_events *out_events,
                                        struct shef_error *err)
{
    return take(sensor, t_ns, log, true, out_events, err);
}

enum shef_err sim_event_sensor_flush(struct sim_event_sensor *sensor, struct sim_events *out_events,
                                     struct shef_error *err)
{
    const struct sim_event_step step = {
        .base_us = sensor->base_us,
        .complete_us = sensor->base_us + FLUSH_NS / SHEF_NS_PER_US,
    };

    for (int32_t i = 0; i < sensor->n_bands; i++)
        sensor->bands[i].list.n = 0;

    const size_t n_complete = sim_event_order_run(sensor, &step);
    const enum shef_err code = n_complete == SIZE_MAX
                                   ? no_memory(err)
                                   : hand_over(sensor, &step, n_complete, out_events, err);

    /* The stream ends with its last event. */
    if (code == SHEF_OK)
        out_events->complete_us = step.base_us;
    if (code == SHEF_OK && out_events->n > 0)
        out_events->complete_us += out_events->events[out_events->n - 1].t_us + 1;
    return code;
}

void sim_event_sensor_log(const struct sim_event_sensor *sensor, struct shef_image_f32 out_log)
{
    const int32_t ramp = ramp_at(sensor, sensor->now_ns);

    for (int32_t y = 0; y < sensor->height_px; y++) {
        const int32_t *level = sensor->level + (size_t)y * (size_t)sensor->width_px;
        float *to = shef_row_f32(out_log, y);

        for (int32_t x = 0; x < sensor->width_px; x++)
            to[x] = (float)(level[x] - ramp) * (1.0f / SIM_LEVEL_ONE);
    }
}

struct sim_event_sensor_stats sim_event_sensor_stats(const struct sim_event_sensor *sensor)
{
    return sensor->stats;
}
