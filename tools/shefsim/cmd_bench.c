/* shefsim bench: how fast the sensors and a whole rendering are. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/time.h"
#include "sheftool/machine.h"
#include "sheftool/stopwatch.h"
#include "shefsim/commands.h"
#include "shefsim/frame_sensor.h"
#include "shefsim/kernels/event_scan.h"
#include "shefsim/rig.h"
#include "shefsim/staging.h"

#define WIDTH_PX        640
#define HEIGHT_PX       480
#define FRAME_WIDTH_PX  2048
#define FRAME_HEIGHT_PX 1536
#define STEP_NS         4000000

struct settings {
    const char *scene;
    const char *light;
    const char *folder;
    double speed_m_s;
    double seconds;
    int64_t n_rounds;
    int64_t n_threads;
    bool json;
};

static const struct shef_option options[] = {
    SHEF_OPT_TEXT("scene", struct settings, scene, "NAME", "complex_boxes", "what is rendered"),
    SHEF_OPT_TEXT("light", struct settings, light, "NAME", "day", "in which light"),
    SHEF_OPT_REAL("speed", struct settings, speed_m_s, "0.35", 0.001, 1, "m/s",
                  "of the camera, on a circle"),
    SHEF_OPT_REAL("seconds", struct settings, seconds, "1", 0.05, 60, "s",
                  "how much is rendered, frames, truth and writing included"),
    SHEF_OPT_INT("rounds", struct settings, n_rounds, "20", 1, 1000, NULL,
                 "how often the sensors alone are run; the shortest time counts"),
    SHEF_OPT_INT("threads", struct settings, n_threads, "1", 1, 64, NULL, "of the rendering"),
    SHEF_OPT_TEXT("folder", struct settings, folder, "DIR", "/tmp",
                  "where the rendering is written and removed again"),
    SHEF_OPT_FLAG("json", struct settings, json, "print JSON instead of a table"),
    SHEF_OPT_END,
};

static const char *const isas[] = { "c", "avx2", "avx512", "neon" };

/* Whether this processor has the set, and something of its own is compiled for it. */
static bool is_there(const char *isa, const char *picked)
{
    const uint32_t wanted = shef_cpu_features_of(isa);

    return (shef_cpu_features() & wanted) == wanted && strcmp(isa, picked) == 0;
}

/* A pattern that moves by a pixel or so a step. */
static void paint(struct shef_image_f32 image, int32_t step)
{
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++) {
            const uint32_t cell = (uint32_t)((x + step) / 7 * 31 + (y + step / 2) / 5 * 17);

            shef_row_f32(image, y)[x] = 0.05f + (float)(cell * 2654435761u >> 24) / 300.0f;
        }
}

static void smaller(double *best, double value)
{
    if (*best == 0 || value < *best)
        *best = value;
}

/* The scan of an image for pixels that fire, none of which does. */
static json_t *bench_scan(const struct settings *settings, struct shef_image_f32 image)
{
    const size_t n = (size_t)WIDTH_PX * HEIGHT_PX;
    int32_t *memory = shef_memory_create(3 * n, sizeof *memory);
    uint8_t *hit = shef_memory_create(WIDTH_PX, 1);
    json_t *out = json_object();

    for (size_t i = 0; memory && hit && i < n; i++) {
        memory[n + i] = INT32_MIN;
        memory[2 * n + i] = INT32_MAX;
    }
    for (size_t k = 0; memory && hit && k < sizeof isas / sizeof isas[0]; k++) {
        const struct sim_event_scan_impl *impl = sim_event_scan_pick(shef_cpu_features_of(isas[k]));
        double best_ms = 0;

        if (!is_there(isas[k], impl->isa))
            continue;
        for (int64_t round = 0; round < settings->n_rounds; round++) {
            const int64_t start_ns = shef_monotonic_ns();

            for (int32_t y = 0; y < HEIGHT_PX; y++) {
                const size_t at = (size_t)y * WIDTH_PX;

                impl->level(shef_row_f32(image, y), 0.01f, 0, WIDTH_PX, memory + at);
                impl->scan(memory + at, memory + n + at, memory + 2 * n + at, WIDTH_PX, hit);
            }
            smaller(&best_ms, (double)(shef_monotonic_ns() - start_ns) * 1e-6);
        }
        json_object_set_new(out, isas[k], json_real(best_ms));
    }
    free(memory);
    free(hit);
    return out;
}

/* Whole steps of the typical sensor with many events. */
static enum shef_err bench_sensor(const struct settings *settings, struct shef_image_f32 image,
                                  json_t **out, struct shef_error *err)
{
    struct sim_event_sensor_params params;
    struct sim_event_sensor *sensor;
    struct sim_events events;
    double best_ns = 0;
    uint64_t n_events = 0;
    enum shef_err code;

    if (!sim_event_sensor_preset("typical", &params))
        return shef_fail(err, SHEF_ERR_INVALID, "bench: the preset is gone");
    code = sim_event_sensor_create(&sensor, &params, WIDTH_PX, HEIGHT_PX, 1, shef_cpu_features(),
                                   NULL, err);
    if (code != SHEF_OK)
        return code;
    for (int32_t i = 0; code == SHEF_OK && i <= settings->n_rounds; i++) {
        paint(image, i);

        const int64_t start_ns = shef_monotonic_ns();

        code = sim_event_sensor_step(sensor, i * (int64_t)STEP_NS, image, &events, err);
        if (code != SHEF_OK || i == 0 || events.n == 0)
            continue;
        smaller(&best_ns, (double)(shef_monotonic_ns() - start_ns) / (double)events.n);
        n_events += events.n;
    }
    sim_event_sensor_destroy(sensor);
    *out = json_pack("{s:f, s:f}", "ns_per_event", best_ns, "events_per_step",
                     (double)n_events / (double)settings->n_rounds);
    return code;
}

/* Frames of 2048 x 1536 from light to grey levels. */
static enum shef_err bench_frame(const struct settings *settings, json_t **out,
                                 struct shef_error *err)
{
    const struct sim_frame_sensor_params params =
        sim_frame_sensor_default(FRAME_WIDTH_PX, FRAME_HEIGHT_PX);
    const struct shef_image_i16 no_objects = { .data = NULL };
    struct shef_image_f32 light;
    struct shef_image_u8 frame;
    struct sim_frame_sensor *sensor = NULL;
    double best_ms = 0;
    enum shef_err code = shef_image_create_f32(&light, FRAME_WIDTH_PX, FRAME_HEIGHT_PX, err);

    if (code != SHEF_OK)
        return code;
    code = shef_image_create_u8(&frame, FRAME_WIDTH_PX, FRAME_HEIGHT_PX, err);
    if (code == SHEF_OK) {
        paint(light, 0);
        code = sim_frame_sensor_create(&sensor, &params, 1, shef_cpu_features(), NULL, err);
        for (int64_t i = 0; code == SHEF_OK && i < settings->n_rounds; i++) {
            const int64_t start_ns = shef_monotonic_ns();

            sim_frame_sensor_expose(sensor, (uint64_t)i, light, NULL, no_objects, frame);
            smaller(&best_ms, (double)(shef_monotonic_ns() - start_ns) * 1e-6);
        }
        sim_frame_sensor_destroy(sensor);
        shef_image_destroy_u8(&frame);
    }
    shef_image_destroy_f32(&light);
    *out = json_real(best_ms);
    return code;
}

static json_t *rendering_json(const struct settings *settings, const struct sim_rig_report *report,
                              double create_s)
{
    return json_pack(
        "{s:s, s:f, s:f, s:I, s:f, s:f, s:f, s:f, s:f, s:f, s:{s:f, s:f, s:f, s:f, s:f, s:f, s:f, "
        "s:f}}",
        "scene", settings->scene, "speed_m_s", settings->speed_m_s, "seconds", report->seconds,
        "threads", (json_int_t)settings->n_threads, "mev_per_s",
        (double)report->events.n_events / report->seconds * 1e-6, "create_s", create_s, "wall_s",
        report->total_s, "cpu_s", report->cpu_s, "real_time_factor",
        report->seconds / report->total_s, "real_time_factor_cpu", report->seconds / report->cpu_s,
        "parts_s", "events_render", report->events_render_s, "events_sensor",
        report->events_sensor_s, "events_write", report->events_write_s, "frames_render",
        report->frames_render_s, "frames_sensor", report->frames_sensor_s, "frames_write",
        report->frames_write_s, "truth", report->truth_s, "closing", report->closing_s);
}

/* Everything, to the disk. */
static enum shef_err bench_rendering(const struct settings *settings, json_t **out,
                                     struct shef_error *err)
{
    struct sim_rig_settings rig_settings = {
        .scene = settings->scene,
        .light = settings->light,
        .path = "circle",
        .speed_m_s = settings->speed_m_s,
        .path_size_m = 0.15,
        .seconds = settings->seconds,
        .seed = 1,
        .fps = 54,
        .blink_hz = 5,
        .frame_tick_ns = 1,
    };
    char folder[PATH_MAX];
    struct sim_rig_render_config config = { .out = folder, .truth_every = 1 };
    struct sim_staging done = { .path = "" };
    struct sim_rig_report report;
    struct sim_rig *rig = NULL;
    struct shef_workers *workers = shef_workers_create((int32_t)settings->n_threads, err);
    const int64_t start_ns = shef_monotonic_ns();
    int64_t made_ns;
    enum shef_err code;

    if (!workers)
        return err->code;
    if (!sim_event_sensor_preset("typical", &rig_settings.sensor) ||
        snprintf(folder, sizeof folder, "%s/shefsim-bench-%ld", settings->folder, (long)getpid()) >=
            (int)sizeof folder)
        code = shef_fail(err, SHEF_ERR_INVALID, "bench: the folder's name is too long");
    else
        code = sim_rig_create(&rig, &rig_settings, shef_cpu_features(), workers, err);
    made_ns = shef_monotonic_ns();
    if (code == SHEF_OK)
        code = sim_rig_render(rig, &config, &report, err);
    if (code == SHEF_OK) {
        snprintf(done.path, sizeof done.path, "%s", folder);
        sim_staging_discard(&done);
        *out = rendering_json(settings, &report, (double)(made_ns - start_ns) * 1e-9);
    }
    sim_rig_destroy(rig);
    shef_workers_destroy(workers);
    return code;
}

static double number(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

static void print_table(const json_t *root)
{
    const json_t *machine = json_object_get(root, "machine");
    const json_t *sensor = json_object_get(root, "event_sensor");
    const json_t *r = json_object_get(root, "rendering");
    const json_t *parts = json_object_get(r, "parts_s");
    const char *key;
    json_t *value;

    printf("%s, %s\n\n", json_string_value(json_object_get(machine, "cpu")),
           json_string_value(json_object_get(machine, "compiler")));
    printf("event sensor, scan of 640 x 480 px  ");
    json_object_foreach(json_object_get(root, "event_scan_ms"), key, value)
        printf("  %s %.3f ms", key, json_number_value(value));
    printf("\nevent sensor, typical, all of it      %.1f ns an event (%.0f events a step)\n",
           number(sensor, "ns_per_event"), number(sensor, "events_per_step"));
    printf("frame sensor, 2048 x 1536 px          %.2f ms\n", number(root, "frame_sensor_ms"));
    printf("rendering %s at %g m/s, %.1f Mev/s, %g thread%s:\n",
           json_string_value(json_object_get(r, "scene")), number(r, "speed_m_s"),
           number(r, "mev_per_s"), number(r, "threads"), number(r, "threads") == 1 ? "" : "s");
    printf("  %.2f times real time by the clock, %.2f by CPU time (%.2f s, %.2f s CPU, for %g s)\n",
           number(r, "real_time_factor"), number(r, "real_time_factor_cpu"), number(r, "wall_s"),
           number(r, "cpu_s"), number(r, "seconds"));
    json_object_foreach((json_t *)(uintptr_t)parts, key, value)
        printf("  %-16s %6.2f s\n", key, json_number_value(value));
    printf("  before it: scene, textures, rays %.2f s\n", number(r, "create_s"));
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_image_f32 image;
    json_t *root = json_object();
    json_t *sensor = NULL;
    json_t *frame = NULL;
    json_t *rendering = NULL;
    enum shef_err code = shef_image_create_f32(&image, WIDTH_PX, HEIGHT_PX, err);

    if (code == SHEF_OK) {
        paint(image, 0);
        json_object_set_new(root, "machine", shef_machine_json(shef_cpu_features()));
        json_object_set_new(root, "event_scan_ms", bench_scan(settings, image));
        code = bench_sensor(settings, image, &sensor, err);
        shef_image_destroy_f32(&image);
    }
    if (code == SHEF_OK)
        code = bench_frame(settings, &frame, err);
    if (code == SHEF_OK)
        code = bench_rendering(settings, &rendering, err);
    json_object_set_new(root, "event_sensor", sensor ? sensor : json_null());
    json_object_set_new(root, "frame_sensor_ms", frame ? frame : json_null());
    json_object_set_new(root, "rendering", rendering ? rendering : json_null());
    if (code == SHEF_OK && settings->json) {
        json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(6));
        putchar('\n');
    } else if (code == SHEF_OK) {
        print_table(root);
    }
    json_decref(root);
    return code;
}

const struct shef_command sim_command_bench = {
    .name = "bench",
    .summary = "speed of the sensors and of a whole rendering",
    .description =
        "Times the event sensor's scan for every instruction set of this processor, a whole step\n"
        "of the event sensor, the frame sensor; and a rendering with everything that belongs to\n"
        "it: images, events, frames, truth, encoding, writing, checksums. On a machine that is\n"
        "busy with other things the figure by CPU time is the one to compare.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
