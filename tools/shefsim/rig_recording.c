#include "shefsim/rig_recording.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/time.h"
#include "record/frame_recorder.h"
#include "record/recording_writer.h"
#include "record/trigger_recorder.h"
#include "record/truth_writer.h"
#include "shefsim/event_stream.h"
#include "shefsim/random.h"
#include "shefsim/rig_robot.h"
#include "shefsim/staging.h"

/* What the ways to the host take: at least, and at most on top of it. Event buffers come over USB
 * at once; frames when their read-out, which takes nearly a frame's time, has ended; poses after
 * the controller's cycle and the network; edges after an interrupt. */
#define EVENTS_DELAY_NS    300000
#define EVENTS_JITTER_NS   400000
#define FRAMES_DELAY_NS    17500000
#define FRAMES_JITTER_NS   1500000
#define POSES_JITTER_NS    900000
#define TRIGGERS_DELAY_NS  8000
#define TRIGGERS_JITTER_NS 30000

/* The GPIO line that the frame camera's exposure signal is wired to. */
#define EXPOSURE_LINE 17

struct sim_rig_recording {
    const struct sim_rig *rig;
    struct sim_staging staging;
    struct shef_recording_writer writer;
    bool has_writer;
    uint32_t n_poses;
    uint32_t n_edges;
    /* NULL: not begun, or ended. */
    struct sim_event_stream *events;
    struct shef_frame_recorder *frames;
    struct sim_rig_robot *robot;
    struct shef_trigger_recorder *triggers;
    struct shef_truth_writer *truth;
};

/* When something that happened at a true time reaches the host.
 *   number  of the thing in its part */
static shef_host_time arrival(const struct sim_rig *rig, enum shef_part part, uint64_t number,
                              int64_t t_ns, int64_t delay_ns, int64_t jitter_ns)
{
    const uint64_t key = sim_key(rig->settings.seed, SIM_STREAM_HOST_DELAY, part);
    const double late_ns = sim_unit(sim_random(key, number)) * (double)jitter_ns;

    return sim_clocks_host(&rig->clocks, t_ns + delay_ns + (int64_t)late_ns);
}

/* Makes session and time functions of the seed, so that a rendering can be repeated to the byte. */
static void identify(struct sim_rig_recording *recording)
{
    const struct sim_rig *rig = recording->rig;
    const uint64_t key = sim_key(rig->settings.seed, SIM_STREAM_SESSION, 0);
    struct shef_manifest *manifest = &recording->writer.manifest;

    for (size_t i = 0; i < SHEF_SESSION_BYTES; i++)
        manifest->session[i] = (uint8_t)sim_random(key, i);
    snprintf(manifest->created, sizeof manifest->created, "2026-01-01T00:00:00.000000Z");
    manifest->utc_minus_host_ns = rig->clocks.utc_minus_host_ns;
}

/* The calibration of whoever uses the recording: the true one, or one that is wrong on purpose. */
static enum shef_err write_calibration(const struct sim_rig_recording *recording,
                                       struct shef_error *err)
{
    struct shef_calibration calibration = recording->rig->calibration;
    char path[PATH_MAX + 32];
    const enum shef_err code =
        sim_rig_miscalibrate(&calibration, &recording->rig->settings.wrong, err);

    snprintf(path, sizeof path, "%s/calibration.yaml", recording->staging.path);
    return code == SHEF_OK ? shef_calibration_write(path, &calibration, err) : code;
}

static enum shef_err start_events(struct sim_rig_recording *recording, struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const struct sim_event_stream_config config = {
        .width_px = rig->calibration.event.width_px,
        .height_px = rig->calibration.event.height_px,
        .clocks = rig->clocks,
        .seed = rig->settings.seed,
        .delay_ns = EVENTS_DELAY_NS,
        .jitter_ns = EVENTS_JITTER_NS,
        .shift_us = rig->settings.event_shift_us,
    };

    return sim_event_stream_start(&recording->events, &config, &recording->writer, err);
}

static uint32_t pixel_format(const struct sim_rig *rig)
{
    return rig->settings.format == SIM_FRAME_MONO8 ? SHEF_PFNC_MONO8 : SHEF_PFNC_BAYER_RG8;
}

static enum shef_err start_frames(struct sim_rig_recording *recording, struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const struct shef_frame_part format = { (uint32_t)rig->calibration.frame.width_px,
                                            (uint32_t)rig->calibration.frame.height_px,
                                            pixel_format(rig) };
    struct shef_frame_recorder_config config = shef_frame_recorder_default_config(&format);

    config.vendor = "shefsim";
    config.model = "simulated frame camera";
    config.serial = "00000001";
    config.limits.sync_ns = 0;
    return shef_frame_recorder_start(&recording->writer, &config, &recording->frames, err);
}

static enum shef_err start_triggers(struct sim_rig_recording *recording, struct shef_error *err)
{
    const struct shef_edge_line lines[] = { { EXPOSURE_LINE, "frame exposure" } };
    struct shef_trigger_recorder_config config = {
        .chip = "gpiochip0",
        .lines = lines,
        .n_lines = 1,
        .limits = shef_segment_limits_default(),
    };

    config.limits.sync_ns = 0;
    return shef_trigger_recorder_start(&recording->writer, &config, &recording->triggers, err);
}

/* The clocks as truth/ has them. */
static enum shef_err write_clocks(struct sim_rig_recording *recording, struct shef_error *err)
{
    const struct sim_clocks *clocks = &recording->rig->clocks;
    const struct shef_truth_clock rows[] = {
        { "event", clocks->event.start_ns, clocks->event.drift_ppm },
        { "frame", clocks->frame.start_ns, clocks->frame.drift_ppm },
        { "robot", clocks->robot.start_ns, clocks->robot.drift_ppm },
        { "host", clocks->host.start_ns, clocks->host.drift_ppm },
    };
    enum shef_err code = SHEF_OK;

    for (size_t i = 0; code == SHEF_OK && i < sizeof rows / sizeof rows[0]; i++)
        code = shef_truth_writer_clock(recording->truth, &rows[i], err);
    return code;
}

static enum shef_err start_truth(struct sim_rig_recording *recording, struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const struct sim_rig_settings *settings = &rig->settings;
    char source[256];
    enum shef_err code;

    snprintf(source, sizeof source, "shefsim: %.60s by %.30s, path %.30s at %g m/s, seed %llu",
             sim_scene_name(rig->scene), settings->light, settings->path, settings->speed_m_s,
             (unsigned long long)settings->seed);
    code = shef_truth_writer_start(&recording->writer, &rig->calibration, SIM_RIG_TRUTH_PROFILE,
                                   source, &recording->truth, err);
    return code == SHEF_OK ? write_clocks(recording, err) : code;
}

static enum shef_err start_parts(struct sim_rig_recording *recording, struct shef_error *err)
{
    enum shef_err code = write_calibration(recording, err);

    if (code == SHEF_OK)
        code = start_events(recording, err);
    if (code == SHEF_OK && !recording->rig->settings.without_frames)
        code = start_frames(recording, err);
    if (code == SHEF_OK)
        code = sim_rig_robot_start(&recording->robot, &recording->writer, err);
    if (code == SHEF_OK)
        code = start_triggers(recording, err);
    return code == SHEF_OK ? start_truth(recording, err) : code;
}

enum shef_err sim_rig_recording_begin(struct sim_rig_recording **out_recording,
                                      const struct sim_rig *rig, const char *folder,
                                      struct shef_error *err)
{
    const struct shef_recording_writer_config config = { .software = "shefsim " SHEF_VERSION };
    struct sim_rig_recording *recording = calloc(1, sizeof *recording);
    enum shef_err code;

    if (!recording)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "render to '%s': out of memory", folder);
    recording->rig = rig;
    code = sim_staging_begin(&recording->staging, folder, err);
    if (code == SHEF_OK)
        code =
            shef_recording_writer_create(&recording->writer, recording->staging.path, &config, err);
    recording->has_writer = code == SHEF_OK;
    if (code == SHEF_OK) {
        identify(recording);
        code = start_parts(recording, err);
    }
    if (code == SHEF_OK)
        *out_recording = recording;
    else
        sim_rig_recording_discard(recording);
    return code;
}

/* One edge of the exposure signal, as the host's kernel sees it. */
static enum shef_err write_edge(struct sim_rig_recording *recording, int64_t t_ns, bool is_high,
                                struct shef_error *err)
{
    const struct shef_edge edge = {
        .time = arrival(recording->rig, SHEF_PART_TRIGGERS, recording->n_edges, t_ns,
                        TRIGGERS_DELAY_NS, TRIGGERS_JITTER_NS),
        .number = ++recording->n_edges,
        .line = EXPOSURE_LINE,
        .is_high = is_high,
    };

    return shef_trigger_recorder_write(recording->triggers, &edge, 1, edge.time, 0, err);
}

enum shef_err sim_rig_recording_announce(struct sim_rig_recording *recording,
                                         const struct sim_rig_frame *frame, struct shef_error *err)
{
    enum shef_err code = sim_event_stream_trigger(recording->events, frame->rise_us, true, err);

    if (code == SHEF_OK)
        code = sim_event_stream_trigger(recording->events, frame->fall_us, false, err);
    if (code == SHEF_OK)
        code = write_edge(recording, frame->start_ns, true, err);
    return code == SHEF_OK ? write_edge(recording, frame->end_ns, false, err) : code;
}

enum shef_err sim_rig_recording_events(struct sim_rig_recording *recording,
                                       const struct sim_events *events, struct shef_error *err)
{
    return sim_event_stream_add(recording->events, events, err);
}

enum shef_err sim_rig_recording_frame(struct sim_rig_recording *recording,
                                      const struct sim_rig_frame *frame, struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const struct shef_frame_info info = {
        .number = frame->number,
        .time = frame->time,
        .arrived = arrival(rig, SHEF_PART_FRAMES, frame->number, frame->end_ns, FRAMES_DELAY_NS,
                           FRAMES_JITTER_NS),
        .exposure_us = (uint32_t)(rig->frame_params.exposure_ns / SHEF_NS_PER_US),
        .gain_mdb = rig->frame_params.gain_mdb,
        .width_px = (uint32_t)rig->frame.width_px,
        .height_px = (uint32_t)rig->frame.height_px,
        .row_bytes = (uint32_t)rig->frame.stride_bytes,
        .pixel_format = pixel_format(rig),
    };

    return shef_frame_recorder_write(recording->frames, &info, rig->frame.data, 0, err);
}

/* True time in event time. */
static shef_event_time event_time(const struct sim_rig *rig, int64_t t_ns)
{
    return (shef_event_time){ sim_clock_at(&rig->clocks.event, t_ns) };
}

enum shef_err sim_rig_recording_truth_frame(struct sim_rig_recording *recording,
                                            const struct sim_rig_frame *frame,
                                            struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const int64_t middle_ns = (frame->start_ns + frame->end_ns) / 2;
    const struct shef_truth_frame row = {
        .number = frame->number,
        .rise = event_time(rig, frame->start_ns),
        .middle = event_time(rig, middle_ns),
        .exposure_ns = frame->end_ns - frame->start_ns,
        .t_world_hand = sim_rig_hand(rig, middle_ns),
    };

    return shef_truth_writer_frame(recording->truth, &row, err);
}

enum shef_err sim_rig_recording_truth_maps(struct sim_rig_recording *recording,
                                           const struct sim_rig_frame *frame,
                                           struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    for (int32_t view = 0; code == SHEF_OK && view < SHEF_TRUTH_VIEWS; view++) {
        const struct sim_rig_maps *maps = &recording->rig->truth[view];

        code = shef_truth_writer_maps(recording->truth, (enum shef_truth_view)view, frame->number,
                                      maps->depth_m, maps->disparity_px, maps->mask, err);
    }
    return code;
}

/* Ends what has begun; the first failure counts. */
static enum shef_err stop_parts(struct sim_rig_recording *recording, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (recording->events)
        code = sim_event_stream_stop(recording->events, err);
    recording->events = NULL;
#define STOP(part_, stop_)                                                                         \
    do {                                                                                           \
        if (recording->part_) {                                                                    \
            const enum shef_err stopped = stop_(recording->part_, code == SHEF_OK ? err : NULL);   \
                                                                                                   \
            code = code == SHEF_OK ? stopped : code;                                               \
        }                                                                                          \
        recording->part_ = NULL;                                                                   \
    } while (0)
    STOP(frames, shef_frame_recorder_stop);
    STOP(robot, sim_rig_robot_stop);
    STOP(triggers, shef_trigger_recorder_stop);
    STOP(truth, shef_truth_writer_stop);
#undef STOP
    return code;
}

enum shef_err sim_rig_recording_commit(struct sim_rig_recording *recording, struct shef_error *err)
{
    enum shef_err code = stop_parts(recording, err);

    if (code == SHEF_OK) {
        recording->has_writer = false;
        code = shef_recording_writer_close(&recording->writer, true, NULL, NULL, err);
    }
    if (code == SHEF_OK)
        code = sim_staging_commit(&recording->staging, err);
    sim_rig_recording_discard(recording);
    return code;
}

void sim_rig_recording_discard(struct sim_rig_recording *recording)
{
    struct shef_error ignored;

    if (!recording)
        return;
    /* Whatever goes wrong here: all of it is removed. */
    (void)!stop_parts(recording, &ignored);
    if (recording->has_writer)
        shef_recording_writer_abandon(&recording->writer);
    sim_staging_discard(&recording->staging);
    free(recording);
}

enum shef_err sim_rig_recording_pose(struct sim_rig_recording *recording, int64_t robot_ns,
                                     int64_t t_ns, struct shef_error *err)
{
    const struct sim_rig *rig = recording->rig;
    const struct shef_truth_pose row = { event_time(rig, t_ns), sim_rig_hand(rig, t_ns) };
    const shef_host_time arrived = arrival(rig, SHEF_PART_POSES, recording->n_poses++, t_ns,
                                           SIM_RIG_POSE_DELAY_NS, POSES_JITTER_NS);
    const enum shef_err code =
        sim_rig_robot_report(recording->robot, rig, robot_ns, t_ns, arrived, err);

    return code == SHEF_OK ? shef_truth_writer_pose(recording->truth, &row, err) : code;
}
