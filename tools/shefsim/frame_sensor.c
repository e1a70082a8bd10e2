#include "shefsim/frame_sensor.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/memory.h"
#include "shefsim/kernels/frame_expose.h"
#include "shefsim/random.h"

#define ROWS_A_TASK 32

/* What a colour sensor's filters let through of grey light, against its green. */
static const float filter[3] = { 0.75f, 1.0f, 0.65f };

struct sim_frame_sensor {
    struct sim_frame_sensor_params params;
    uint64_t seed;
    struct shef_workers *workers;
    const struct sim_frame_expose_impl *impl;
    float *factors; /* one row for each worker; NULL for a grey sensor */
};

/* One frame, as its tasks see it. */
struct exposure {
    struct sim_frame_sensor *sensor;
    struct sim_expose_row row;
    uint64_t key;
    struct shef_image_f32 radiance;
    const float (*tints)[3];
    struct shef_image_i16 object;
    struct shef_image_u8 out;
};

struct sim_frame_sensor_params sim_frame_sensor_default(int32_t width_px, int32_t height_px)
{
    return (struct sim_frame_sensor_params){
        .width_px = width_px,
        .height_px = height_px,
        .exposure_ns = 5000000,
        .electrons_per_ms = 1600,
        .full_well = 10500,
        .read_noise = 7,
        .black = 4,
    };
}

static double gain_of(uint32_t gain_mdb)
{
    return sim_exp(gain_mdb * 1e-3 * 0.11512925464970229); /* ln(10) / 20 */
}

/* The grey level of white light at a gain of 0 dB. */
static double white_grey(const struct sim_frame_sensor_params *params)
{
    return 255 / params->full_well * params->electrons_per_ms * (double)params->exposure_ns * 1e-6;
}

uint32_t sim_frame_sensor_gain_mdb(const struct sim_frame_sensor_params *params,
                                   struct shef_image_f32 radiance)
{
    enum { N_BINS = 4096 };
    static const double wanted_grey = 0.9 * 255;
    static const float brightest = 4;
    int64_t bins[N_BINS] = { 0 };
    int64_t n_above = 0;
    int32_t bin = N_BINS;
    uint32_t gain_mdb = 0;

    for (int32_t y = 0; y < radiance.height_px; y++) {
        const float *row = shef_row_f32(radiance, y);

        for (int32_t x = 0; x < radiance.width_px; x++) {
            const float light = row[x] > 0 ? row[x] : 0;

            bins[light < brightest ? (int32_t)(light * (N_BINS / brightest)) : N_BINS - 1]++;
        }
    }
    while (n_above * 100 < (int64_t)radiance.width_px * radiance.height_px)
        n_above += bins[--bin];

    const double grey = (bin + 0.5) * brightest / N_BINS * white_grey(params);

    while (gain_mdb < 24000 && gain_of(gain_mdb + 100) * grey + params->black <= wanted_grey)
        gain_mdb += 100;
    return gain_mdb;
}

int32_t sim_frame_sensor_n_instants(double motion_px)
{
    const int32_t n =
        motion_px < SIM_FRAME_MAX_INSTANTS ? (int32_t)ceil(2 * motion_px) : SIM_FRAME_MAX_INSTANTS;

    return n < SIM_FRAME_MIN_INSTANTS   ? SIM_FRAME_MIN_INSTANTS
           : n > SIM_FRAME_MAX_INSTANTS ? SIM_FRAME_MAX_INSTANTS
                                        : n;
}

int64_t sim_frame_sensor_instant_ns(const struct sim_frame_sensor_params *params, int32_t i,
                                    int32_t n)
{
    return params->exposure_ns * (2 * i + 1) / (2 * n);
}

enum shef_err sim_frame_sensor_create(struct sim_frame_sensor **out_sensor,
                                      const struct sim_frame_sensor_params *params, uint64_t seed,
                                      uint32_t cpu_features, struct shef_workers *workers,
                                      struct shef_error *err)
{
    const size_t n_workers = workers ? (size_t)shef_workers_count(workers) : 1;
    struct sim_frame_sensor *sensor = calloc(1, sizeof *sensor);

    assert(params->width_px >= 1 && params->height_px >= 1 && params->exposure_ns > 0);
    if (sensor && params->format == SIM_FRAME_BAYER_RG8)
        sensor->factors =
            shef_memory_create(n_workers * (size_t)params->width_px, sizeof *sensor->factors);
    if (!sensor || (params->format == SIM_FRAME_BAYER_RG8 && !sensor->factors)) {
        free(sensor);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "simulate the frame sensor: out of memory");
    }
    sensor->params = *params;
    sensor->seed = seed;
    sensor->workers = workers;
    sensor->impl = sim_frame_expose_pick(cpu_features);
    *out_sensor = sensor;
    return SHEF_OK;
}

void sim_frame_sensor_destroy(struct sim_frame_sensor *sensor)
{
    if (!sensor)
        return;
    free(sensor->factors);
    free(sensor);
}

/* How much of the light each pixel of a row collects: filter times the object's own colour. */
static void tint_row(const struct exposure *exposure, int32_t y, float *out_factor)
{
    const int32_t width = exposure->sensor->params.width_px;
    const int16_t *object = exposure->tints ? shef_row_i16(exposure->object, y) : NULL;

    for (int32_t x = 0; x < width; x++) {
        const int32_t channel = (x & 1) + (y & 1); /* 0 red, 1 green, 2 blue */
        const bool is_tinted = object && object[x] >= 0;

        out_factor[x] = filter[channel] * (is_tinted ? exposure->tints[object[x]][channel] : 1);
    }
}

static void expose_rows(void *context, int32_t task, int32_t worker)
{
    const struct exposure *exposure = context;
    const struct sim_frame_sensor *sensor = exposure->sensor;
    const int32_t end = (task + 1) * ROWS_A_TASK;
    const int32_t y_end = end < sensor->params.height_px ? end : sensor->params.height_px;
    float *factors =
        sensor->factors ? sensor->factors + (size_t)worker * (size_t)sensor->params.width_px : NULL;

    for (int32_t y = task * ROWS_A_TASK; y < y_end; y++) {
        struct sim_expose_row row = exposure->row;

        row.radiance = shef_row_f32(exposure->radiance, y);
        row.factor = factors;
        row.noise_key = (uint32_t)(sim_random(exposure->key, (uint64_t)y) >> 32);
        if (factors)
            tint_row(exposure, y, factors);
        sensor->impl->expose(&row, shef_row_u8(exposure->out, y));
    }
}

void sim_frame_sensor_expose(struct sim_frame_sensor *sensor, uint64_t number,
                             struct shef_image_f32 radiance, const float (*tints)[3],
                             struct shef_image_i16 object, struct shef_image_u8 out)
{
    const struct sim_frame_sensor_params *params = &sensor->params;
    struct exposure exposure = {
        .sensor = sensor,
        .row = {
            .n_px = params->width_px,
            .electrons = (float)(params->electrons_per_ms * (double)params->exposure_ns * 1e-6),
            .read_variance = (float)(params->read_noise * params->read_noise),
            .grey_per_electron = (float)(255 / params->full_well * gain_of(params->gain_mdb)),
            .black = (float)params->black,
        },
        .key = sim_key(sensor->seed, SIM_STREAM_FRAME_NOISE, number),
        .radiance = radiance,
        .tints = tints,
        .object = object,
        .out = out,
    };

    assert(radiance.width_px == params->width_px && radiance.height_px == params->height_px);
    assert(out.width_px == params->width_px && out.height_px == params->height_px);
    shef_workers_run(sensor->workers, expose_rows, &exposure,
                     (params->height_px + ROWS_A_TASK - 1) / ROWS_A_TASK);
}
