/* shefsim events: the event model on anybody's images, so that it can be checked against others. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/time.h"
#include "sheftool/events_sink.h"
#include "sheftool/progress.h"
#include "shefsim/commands.h"
#include "shefsim/npy.h"
#include "shefsim/sensor_options.h"

enum input { INPUT_LINEAR, INPUT_LOG };
enum unit { UNIT_NS, UNIT_US, UNIT_S };

struct settings {
    const char *images;
    const char *times;
    const char *out;
    struct sim_sensor_options sensor;
    int32_t input;
    int32_t unit;
    double white;
    int64_t seed;
    int64_t n_threads;
};

static const struct shef_option options[] = {
    SHEF_OPT_WORD("IMAGES", struct settings, images, true,
                  "a .npy file of n images: an array of n x height x width numbers"),
    SHEF_OPT_NEEDED("times", struct settings, times, "FILE", "a .npy file of their n times"),
    SHEF_OPT_NEEDED("out", struct settings, out, "FILE",
                    "the events: .raw (EVT3), .dat, .csv or .npy"),
    SHEF_OPT_CHOICE("input", struct settings, input, "linear|log", "linear",
                    "what the numbers are: light, or its natural logarithm"),
    SHEF_OPT_REAL("white", struct settings, white, "1", 1e-6, 1e9, NULL,
                  "with linear input: the number that is white"),
    SHEF_OPT_CHOICE("time-unit", struct settings, unit, "ns|us|s", "ns", "unit of the times"),
    SIM_SENSOR_OPTIONS(struct settings),
    SHEF_OPT_INT("seed", struct settings, seed, "1", 0, 9e15, NULL, "seed of all noise"),
    SHEF_OPT_INT("threads", struct settings, n_threads, "1", 1, 64, NULL,
                 "threads; the events do not depend on them"),
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    return sim_sensor_options_check(&settings->sensor, err);
}

/* All that a run needs; zeroed where it is not made yet. */
struct run {
    const struct settings *settings;
    struct sim_npy images;
    struct sim_npy times;
    struct shef_image_f32 image;
    struct shef_workers *workers;
    struct sim_event_sensor *sensor;
    struct shef_sink *sink;
    int64_t last_ns;
};

static enum shef_err open_inputs(struct run *run, struct shef_error *err)
{
    const struct settings *settings = run->settings;
    enum shef_err code = sim_npy_open(&run->images, settings->images, err);

    if (code == SHEF_OK)
        code = sim_npy_open(&run->times, settings->times, err);
    if (code != SHEF_OK)
        return code;

    const int64_t *shape = run->images.shape;

    if (run->images.n_dimensions != 3 || shape[1] > 2048 || shape[2] > 2048)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "images '%s': an array of n x height x width is needed, height and width "
                         "at most 2048",
                         settings->images);
    if (run->times.n_dimensions != 1 || run->times.shape[0] != shape[0])
        return shef_fail(err, SHEF_ERR_INVALID,
                         "times '%s': one time for each of the %" PRId64
                         " images in '%s' is needed",
                         settings->times, shape[0], settings->images);
    return SHEF_OK;
}

static enum shef_err open_all(struct run *run, struct shef_error *err)
{
    const struct settings *settings = run->settings;
    const struct sim_event_sensor_params params = sim_sensor_options_params(&settings->sensor);
    enum shef_sink_kind kind;
    enum shef_err code = shef_sink_kind_of(settings->out, &kind, err);

    if (code == SHEF_OK)
        code = open_inputs(run, err);
    if (code != SHEF_OK)
        return code;

    const int32_t height = (int32_t)run->images.shape[1];
    const int32_t width = (int32_t)run->images.shape[2];
    const struct shef_event_writer_config config = {
        .is_raw = kind == SHEF_SINK_RAW,
        .width_px = (uint32_t)width,
        .height_px = (uint32_t)height,
        .format = SHEF_EVT3,
        .ticks = SHEF_EVT_TICKS_SENSOR,
        .generation = SHEF_RAW_NEW,
        .date = "2026-01-01 00:00:00",
    };

    run->workers = shef_workers_create((int32_t)settings->n_threads, err);
    code = run->workers ? SHEF_OK : err->code;
    if (code == SHEF_OK)
        code = shef_image_create_f32(&run->image, width, height, err);
    if (code == SHEF_OK)
        code =
            sim_event_sensor_create(&run->sensor, &params, width, height, (uint64_t)settings->seed,
                                    shef_cpu_features(), run->workers, err);
    return code == SHEF_OK ? shef_sink_open(settings->out, kind, &config, &run->sink, err) : code;
}

static enum shef_err write_events(struct run *run, const struct sim_events *events,
                                  struct shef_error *err)
{
    const struct shef_event_batch batch = {
        /* The sink only reads. */
        .events = (struct shef_event *)(uintptr_t)events->events,
        .n_events = (uint32_t)events->n,
        .capacity = (uint32_t)events->n,
        .base_us = events->base_us,
        .reached_us = events->complete_us,
    };

    return events->n > 0 ? shef_sink_write(run->sink, &batch, err) : SHEF_OK;
}

static enum shef_err read_time(struct run *run, int64_t i, int64_t *out_ns, struct shef_error *err)
{
    static const double ns_per_unit[] = { [UNIT_NS] = 1, [UNIT_US] = 1e3, [UNIT_S] = 1e9 };
    double time;
    const enum shef_err code = sim_npy_read(&run->times, 1, &time, err);
    const double ns = time * ns_per_unit[run->settings->unit];

    if (code != SHEF_OK)
        return code;
    if (!(ns >= 0 && ns < 9e15))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "times '%s': time %" PRId64 " is %g, but must be 0 "
                         "or more, and below 100 days",
                         run->settings->times, i, time);
    *out_ns = (int64_t)llround(ns);
    if (i > 0 && (*out_ns <= run->last_ns || *out_ns - run->last_ns > SHEF_NS_PER_S))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "times '%s': time %" PRId64 " must be later than the one before, by at "
                         "most 1 s; it is by %g s (--time-unit says the unit)",
                         run->settings->times, i, (double)(*out_ns - run->last_ns) * 1e-9);
    run->last_ns = *out_ns;
    return SHEF_OK;
}

static void scale(struct shef_image_f32 image, double white)
{
    const float factor = (float)(1 / white);

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            shef_row_f32(image, y)[x] *= factor;
}

static enum shef_err take_image(struct run *run, int64_t i, struct shef_error *err)
{
    const bool is_log = run->settings->input == INPUT_LOG;
    struct sim_events events;
    int64_t t_ns = 0;
    enum shef_err code = read_time(run, i, &t_ns, err);

    if (code == SHEF_OK)
        code = sim_npy_read_image(&run->images, run->image, err);
    if (code != SHEF_OK)
        return code;
    if (!is_log && run->settings->white != 1)
        scale(run->image, run->settings->white);
    code = is_log ? sim_event_sensor_step_log(run->sensor, t_ns, run->image, &events, err)
                  : sim_event_sensor_step(run->sensor, t_ns, run->image, &events, err);
    return code == SHEF_OK ? write_events(run, &events, err) : code;
}

static enum shef_err take_all(struct run *run, struct shef_error *err)
{
    struct shef_progress progress;
    struct sim_events events;
    enum shef_err code = SHEF_OK;

    shef_progress_begin(&progress, "making events", run->images.shape[0]);
    for (int64_t i = 0; code == SHEF_OK && i < run->images.shape[0]; i++) {
        code = shef_interrupted() ? shef_fail_interrupted(err) : take_image(run, i, err);
        shef_progress_step(&progress, i + 1);
    }
    shef_progress_end(&progress);
    if (code == SHEF_OK)
        code = sim_event_sensor_flush(run->sensor, &events, err);
    return code == SHEF_OK ? write_events(run, &events, err) : code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    struct run run = { .settings = opaque };
    enum shef_err code = open_all(&run, err);

    if (code == SHEF_OK)
        code = take_all(&run, err);
    if (code == SHEF_OK) {
        struct shef_sink *const sink = run.sink;

        run.sink = NULL;
        code = shef_sink_close(sink, err);
    }
    if (code == SHEF_OK) {
        const struct sim_event_sensor_stats stats = sim_event_sensor_stats(run.sensor);

        printf("%s: %" PRIu64 " events (%" PRIu64 " background, %" PRIu64 " of hot pixels; %" PRIu64
               " lost in the read-out) from %" PRId64 " images\n",
               run.settings->out, stats.n_events, stats.n_background, stats.n_hot, stats.n_lost,
               run.images.shape[0]);
    }
    shef_sink_abandon(run.sink);
    sim_event_sensor_destroy(run.sensor);
    shef_workers_destroy(run.workers);
    shef_image_destroy_f32(&run.image);
    sim_npy_discard(&run.images);
    sim_npy_discard(&run.times);
    return code;
}

const struct shef_command sim_command_events = {
    .name = "events",
    .summary = "turn images into events",
    .description =
        "Runs the event sensor's model on a stack of images, linear in time between them. With\n"
        "--noise clean a pixel's count follows floor(change of ln(light) / threshold) as in ESIM\n"
        "and v2e, so those can check it on the same images; `shefsim render --export-images`\n"
        "writes such stacks. Same input and seed, same events.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
