/* shefsim render: a recording of the rig in front of a scene. */
#include <inttypes.h>
#include <stdio.h>

#include "core/time.h"
#include "sheftool/isa_option.h"
#include "sheftool/progress.h"
#include "shefsim/commands.h"
#include "shefsim/rig.h"
#include "shefsim/sensor_options.h"

struct settings {
    const char *scene;
    const char *path;
    const char *light;
    const char *out;
    const char *export_images;
    struct sim_sensor_options sensor;
    double speed_m_s;
    double path_size_m;
    double tilt_deg;
    double phase;
    double seconds;
    double fps;
    double exposure_ms;
    double blink_hz;
    double misalign_px;
    double misalign_deg;
    double misalign_yaw_deg;
    double timing_error_ms;
    int64_t seed;
    int64_t n_threads;
    int64_t truth_every;
    int64_t frame_tick_us;
    int32_t frame_format;
    int32_t export_as;
    int32_t isa;
    bool without_frames;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("scene", struct settings, scene, "NAME",
                    "simple_boxes, complex_boxes, picnic, low_contrast, checkerboard, or a scene "
                    "file (.yaml)"),
    SHEF_OPT_TEXT("out", struct settings, out, "DIR", NULL,
                  "the recording to be: a new folder, or an empty one"),
    SHEF_OPT_TEXT("path", struct settings, path, "NAME", "circle",
                  "square, circle, lissajous-a, -b, -c, line-left, -right, -up, -down"),
    SHEF_OPT_REAL("speed", struct settings, speed_m_s, "0.1", 0.001, 1, "m/s",
                  "of the camera along the path"),
    SHEF_OPT_TEXT("light", struct settings, light, "NAME", "day",
                  "night (one lamp), day (two), or one that the scene file names"),
    SHEF_OPT_REAL("seconds", struct settings, seconds, "1", 0.02, 600, "s", "how long"),
    SHEF_OPT_INT("seed", struct settings, seed, "1", 0, 9e15, NULL,
                 "of textures, noise and clocks; the same seed, the same bytes"),
    SHEF_OPT_REAL("path-size", struct settings, path_size_m, "0.15", 0.03, 1, "m",
                  "width of the path"),
    SHEF_OPT_REAL("tilt", struct settings, tilt_deg, "0", -80, 80, "deg",
                  "of the path's plane about the x axis: its top farther away"),
    SHEF_OPT_REAL("phase", struct settings, phase, "0", 0, 1, NULL, "where on the path to start"),
    SIM_SENSOR_OPTIONS(struct settings),
    SHEF_OPT_CHOICE("frame-format", struct settings, frame_format, SIM_FRAME_FORMATS, "mono8",
                    "pixels of the frame camera"),
    SHEF_OPT_REAL("fps", struct settings, fps, "54", 1, 200, "Hz", "frames per second"),
    SHEF_OPT_REAL("exposure-ms", struct settings, exposure_ms, "0", 0, 100, "ms",
                  "of a frame; 0: 5 by day, 10 in other light"),
    SHEF_OPT_FLAG("no-frames", struct settings, without_frames, "events and poses only"),
    SHEF_OPT_INT("truth-every", struct settings, truth_every, "1", 1, 100000, NULL,
                 "maps of truth for every N-th frame only; they are what is slow to write"),
    SHEF_OPT_REAL("blink", struct settings, blink_hz, "5", 0, 100, "Hz",
                  "how often surfaces that blink do so"),
    SHEF_OPT_REAL("misalign-px", struct settings, misalign_px, "0", -50, 50, "px",
                  "writes a calibration.yaml that has the event camera's rows wrong by this"),
    SHEF_OPT_REAL("misalign-deg", struct settings, misalign_deg, "0", -10, 10, "deg",
                  "the same for its rotation about the optical axis"),
    SHEF_OPT_REAL("misalign-yaw-deg", struct settings, misalign_yaw_deg, "0", -10, 10, "deg",
                  "the same for its rotation about the vertical axis"),
    SHEF_OPT_REAL("timing-error-ms", struct settings, timing_error_ms, "0", -100, 100, "ms",
                  "events are stamped this much too late, triggers are not"),
    SHEF_OPT_INT("frame-tick-us", struct settings, frame_tick_us, "0", 0, 10000, "us",
                 "the frame camera's clock shows whole ticks of this (125 of some FLIR cameras); "
                 "0: ns"),
    SHEF_OPT_TEXT("export-images", struct settings, export_images, "DIR", NULL,
                  "also writes the images that the event sensor sees: images.npy, times.npy"),
    SHEF_OPT_CHOICE("export-as", struct settings, export_as, "linear|log", "linear",
                    "light (1 is white), or ln(light + 0.01) as the sensor keeps it"),
    SHEF_OPT_INT("threads", struct settings, n_threads, "1", 1, 64, NULL,
                 "threads; the recording does not depend on them"),
    SHEF_OPT_ISA(struct settings, isa, "instruction set; the recording does not depend on it"),
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    uint32_t features;

    if (!settings->out && !settings->export_images)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "nothing to do: name a folder with --out, or one with --export-images");

    const enum shef_err code = shef_isa_option(settings->isa, &features, err);

    return code == SHEF_OK ? sim_sensor_options_check(&settings->sensor, err) : code;
}

static struct sim_rig_settings rig_settings(const struct settings *settings)
{
    return (struct sim_rig_settings){
        .scene = settings->scene,
        .light = settings->light,
        .path = settings->path,
        .speed_m_s = settings->speed_m_s,
        .path_size_m = settings->path_size_m,
        .tilt_deg = settings->tilt_deg,
        .phase = settings->phase,
        .seconds = settings->seconds,
        .seed = (uint64_t)settings->seed,
        .sensor = sim_sensor_options_params(&settings->sensor),
        .format = (enum sim_frame_format)settings->frame_format,
        .fps = settings->fps,
        .exposure_ms = settings->exposure_ms,
        .blink_hz = settings->blink_hz,
        .frame_tick_ns = settings->frame_tick_us > 0 ? settings->frame_tick_us * SHEF_NS_PER_US : 1,
        .wrong = { .vertical_px = settings->misalign_px,
                   .roll_deg = settings->misalign_deg,
                   .yaw_deg = settings->misalign_yaw_deg },
        .event_shift_us = (int64_t)(settings->timing_error_ms * 1000 +
                                    (settings->timing_error_ms < 0 ? -0.5 : 0.5)),
        .without_frames = settings->without_frames,
    };
}

static bool go_on(void *context, int64_t done_ns, int64_t total_ns)
{
    (void)total_ns;
    shef_progress_step(context, done_ns / SHEF_NS_PER_MS);
    return !shef_interrupted();
}

static void report_done(const struct settings *settings, const struct sim_rig_report *report)
{
    const struct sim_event_sensor_stats *events = &report->events;

    printf("%s: %g s of %s, %s at %g m/s\n",
           settings->out ? settings->out : settings->export_images, report->seconds,
           settings->scene, settings->path, settings->speed_m_s);
    printf("  events   %" PRIu64 ", %.2f Mev/s; %" PRIu64 " background, %" PRIu64
           " of hot pixels, %" PRIu64 " lost in the read-out\n",
           events->n_events, (double)events->n_events / report->seconds * 1e-6,
           events->n_background, events->n_hot, events->n_lost);
    printf("  images   every %.2f ms, the fastest motion %.0f px/s\n",
           (double)report->step_ns * 1e-6, report->largest_speed_px_s);
    printf("  frames   %d, exposed for %.1f ms (%d instants), gain %.1f dB\n", report->n_frames,
           (double)report->exposure_ns * 1e-6, report->n_instants, report->gain_mdb * 1e-3);
    printf("  poses    %d\n", report->n_poses);
    printf(
        "  took     %.1f s (CPU %.1f s), %.2f s of recording a second: events %.1f + %.1f + %.1f s "
        "(render, sensor, write), frames %.1f + %.1f + %.1f s, truth %.1f s, end %.1f s\n",
        report->total_s, report->cpu_s, report->seconds / report->total_s, report->events_render_s,
        report->events_sensor_s, report->events_write_s, report->frames_render_s,
        report->frames_sensor_s, report->frames_write_s, report->truth_s, report->closing_s);
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    const struct sim_rig_settings rig_of = rig_settings(settings);
    struct shef_progress progress;
    struct sim_rig_render_config config = {
        .out = settings->out,
        .export_images = settings->export_images,
        .export_log = settings->export_as == 1,
        .truth_every = (int32_t)settings->truth_every,
        .go_on = go_on,
        .context = &progress,
    };
    struct shef_workers *workers = shef_workers_create((int32_t)settings->n_threads, err);
    struct sim_rig *rig = NULL;
    struct sim_rig_report report;
    uint32_t features;
    enum shef_err code;

    if (!workers)
        return err->code;
    code = shef_isa_option(settings->isa, &features, err);
    if (code == SHEF_OK)
        code = sim_rig_create(&rig, &rig_of, features, workers, err);
    if (code == SHEF_OK) {
        shef_progress_begin(&progress, "rendering ms", (int64_t)(settings->seconds * 1000));
        code = sim_rig_render(rig, &config, &report, err);
        shef_progress_end(&progress);
        sim_rig_destroy(rig);
    }
    shef_workers_destroy(workers);
    if (code == SHEF_OK)
        report_done(settings, &report);
    return code;
}

const struct shef_command sim_command_render = {
    .name = "render",
    .summary = "render a recording of the rig, with the truth of everything",
    .description =
        "Moves the rig (frame camera 2048 x 1536 px, f 1301 px; event camera 640 x 480 px,\n"
        "f 555 px; 65.44 mm apart) along a path in front of a scene and writes what it would have\n"
        "recorded: events with triggers, frames with motion blur and noise, the arm's poses at\n"
        "125 Hz, clocks that drift and data that arrive late; and in truth/ poses, depth,\n"
        "disparity, occlusion, clocks and the true calibration. docs/recording.md describes the\n"
        "folder. It gets its name when it is complete.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
