#include <time.h>

#include "core/clock.h"
#include "core/time.h"
#include "shefsim/rig_images.h"
#include "shefsim/rig_parts.h"
#include "shefsim/rig_recording.h"

/* Robot controllers of the UR5's generation report every 8 ms. */
#define POSE_NS 8000000

/* What is being rendered. */
struct rendering {
    struct sim_rig *rig;
    const struct sim_rig_render_config *config;
    struct sim_rig_report *report;
    struct sim_rig_recording *recording; /* NULL: none */
    struct sim_rig_images *images;       /* NULL: none */
    int32_t n_frames;                    /* whose exposure ends in time */
    int32_t n_announced;
    int32_t n_exposed;
    int32_t n_poses;
};

/* Adds what has passed since the last call to one of the report's times. */
struct lap {
    int64_t last_ns;
};

static void lap(struct lap *lap, double *seconds)
{
    const int64_t now_ns = shef_clock_now(shef_clock_monotonic()).ns;

    if (seconds)
        *seconds += (double)(now_ns - lap->last_ns) * 1e-9;
    lap->last_ns = now_ns;
}

/* CPU time that the process has used. */
static double cpu_s(void)
{
    struct timespec used;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return (double)used.tv_sec + (double)used.tv_nsec * 1e-9;
}

static enum shef_err announce_until(struct rendering *r, int64_t t_ns, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    while (code == SHEF_OK && r->n_announced < r->n_frames) {
        const struct sim_rig_frame frame = sim_rig_frame_at(r->rig, (uint64_t)r->n_announced);

        if (frame.start_ns > t_ns)
            break;
        if (r->recording)
            code = sim_rig_recording_announce(r->recording, &frame, err);
        r->n_announced++;
    }
    return code;
}

static enum shef_err export_image(struct rendering *r, int64_t event_ns, struct shef_error *err)
{
    if (!r->images)
        return SHEF_OK;
    if (r->config->export_log)
        sim_event_sensor_log(r->rig->event_sensor, r->rig->event_light);
    return sim_rig_images_add(r->images, event_ns, r->rig->event_light, err);
}

/* One image of the event camera, and the events since the last one. */
static enum shef_err step_events(struct rendering *r, int64_t t_ns, struct lap *time,
                                 struct shef_error *err)
{
    struct sim_rig *rig = r->rig;
    const int64_t event_ns = sim_clock_at(&rig->clocks.event, t_ns);
    struct sim_events events;
    enum shef_err code;

    sim_rig_see_events(rig, t_ns);
    lap(time, &r->report->events_render_s);
    code = sim_event_sensor_step(rig->event_sensor, event_ns, rig->event_light, &events, err);
    lap(time, &r->report->events_sensor_s);
    if (code == SHEF_OK)
        code = export_image(r, event_ns, err);
    if (code == SHEF_OK && r->recording)
        code = sim_rig_recording_events(r->recording, &events, err);
    lap(time, &r->report->events_write_s);
    return code;
}

static enum shef_err step_frame(struct rendering *r, const struct sim_rig_frame *frame,
                                struct lap *time, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    sim_rig_see_frame(r->rig, frame);
    lap(time, &r->report->frames_render_s);
    sim_rig_expose(r->rig, frame);
    lap(time, &r->report->frames_sensor_s);
    if (r->recording)
        code = sim_rig_recording_frame(r->recording, frame, err);
    lap(time, &r->report->frames_write_s);
    if (code == SHEF_OK && r->recording)
        code = sim_rig_recording_truth_frame(r->recording, frame, err);
    if (code == SHEF_OK && frame->number % (uint64_t)r->config->truth_every == 0) {
        sim_rig_see_truth(r->rig, (frame->start_ns + frame->end_ns) / 2);
        if (r->recording)
            code = sim_rig_recording_truth_maps(r->recording, frame, err);
    }
    lap(time, &r->report->truth_s);
    return code;
}

static enum shef_err frames_until(struct rendering *r, int64_t t_ns, struct lap *time,
                                  struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    while (code == SHEF_OK && r->n_exposed < r->n_frames) {
        const struct sim_rig_frame frame = sim_rig_frame_at(r->rig, (uint64_t)r->n_exposed);

        if (frame.end_ns > t_ns)
            break;
        code = step_frame(r, &frame, time, err);
        r->n_exposed++;
    }
    return code;
}

static enum shef_err poses_until(struct rendering *r, int64_t t_ns, struct shef_error *err)
{
    const struct sim_clock *clock = &r->rig->clocks.robot;
    const int64_t first = clock->start_ns / POSE_NS + 1;
    enum shef_err code = SHEF_OK;

    while (code == SHEF_OK) {
        const int64_t n = first + r->n_poses;
        const int64_t pose_ns = sim_clock_when(clock, n * POSE_NS);

        if (pose_ns > t_ns)
            break;
        if (r->recording)
            code = sim_rig_recording_pose(r->recording, n * POSE_NS, pose_ns, err);
        r->n_poses++;
    }
    return code;
}

static enum shef_err flush_events(struct rendering *r, struct lap *time, struct shef_error *err)
{
    struct sim_events events;
    enum shef_err code = sim_event_sensor_flush(r->rig->event_sensor, &events, err);

    if (code == SHEF_OK && r->recording)
        code = sim_rig_recording_events(r->recording, &events, err);
    lap(time, &r->report->events_write_s);
    return code;
}

static enum shef_err pass_time(struct rendering *r, struct shef_error *err)
{
    const struct sim_rig *rig = r->rig;
    const struct sim_rig_render_config *config = r->config;
    struct lap time = { 0 };
    enum shef_err code = SHEF_OK;
    int64_t t_ns = 0;

    lap(&time, NULL);
    for (r->report->n_steps = 0; code == SHEF_OK; r->report->n_steps++) {
        if (config->go_on && !config->go_on(config->context, t_ns, rig->total_ns))
            return shef_fail(err, SHEF_ERR_GONE, "stopped by a signal; nothing was written");
        code = announce_until(r, t_ns, err);
        if (code == SHEF_OK)
            code = step_events(r, t_ns, &time, err);
        if (code == SHEF_OK)
            code = poses_until(r, t_ns, err);
        if (code == SHEF_OK)
            code = frames_until(r, t_ns, &time, err);
        if (t_ns == rig->total_ns)
            break;
        t_ns = t_ns + rig->step_ns < rig->total_ns ? t_ns + rig->step_ns : rig->total_ns;
    }
    return code == SHEF_OK ? flush_events(r, &time, err) : code;
}

static int32_t count_frames(const struct sim_rig *rig)
{
    uint64_t n = 0;

    if (rig->settings.without_frames)
        return 0;
    while (sim_rig_frame_at(rig, n).end_ns <= rig->frames_ns)
        n++;
    return (int32_t)n;
}

static enum shef_err begin(struct rendering *r, struct shef_error *err)
{
    const struct sim_rig *rig = r->rig;
    const int64_t n_images = (rig->total_ns + rig->step_ns - 1) / rig->step_ns + 1;
    enum shef_err code = SHEF_OK;

    if (r->config->out)
        code = sim_rig_recording_begin(&r->recording, rig, r->config->out, err);
    if (code == SHEF_OK && r->config->export_images)
        code = sim_rig_images_begin(&r->images, r->config->export_images, n_images,
                                    rig->event_light.width_px, rig->event_light.height_px, err);
    return code;
}

/* Whatever happened before, what was begun is committed or removed here. */
static enum shef_err end(struct rendering *r, enum shef_err code, struct shef_error *err)
{
    if (code != SHEF_OK)
        sim_rig_images_discard(r->images);
    else if (r->images)
        code = sim_rig_images_commit(r->images, err);
    if (code != SHEF_OK)
        sim_rig_recording_discard(r->recording);
    else if (r->recording)
        code = sim_rig_recording_commit(r->recording, err);
    /* Of the file that met it, which is gone, nobody wants to know. */
    if (code == SHEF_ERR_NO_SPACE)
        return shef_fail(err, code,
                         "write '%s': the disk is full, and nothing of it was kept; free some "
                         "space, or render less with --seconds or --truth-every",
                         r->config->out ? r->config->out : r->config->export_images);
    return code;
}

enum shef_err sim_rig_render(struct sim_rig *rig, const struct sim_rig_render_config *config,
                             struct sim_rig_report *out_report, struct shef_error *err)
{
    struct sim_rig_report report = {
        .seconds = (double)rig->total_ns * 1e-9,
        .step_ns = rig->step_ns,
        .n_frames = count_frames(rig),
        .n_instants = rig->n_instants,
        .largest_speed_px_s = rig->largest_speed_px_s,
        .exposure_ns = rig->frame_params.exposure_ns,
        .gain_mdb = rig->frame_params.gain_mdb,
    };
    struct rendering r = {
        .rig = rig, .config = config, .report = &report, .n_frames = report.n_frames
    };
    struct lap total = { 0 };
    struct lap closing = { 0 };
    const double cpu_before_s = cpu_s();
    enum shef_err code;

    lap(&total, NULL);
    code = begin(&r, err);
    if (code == SHEF_OK)
        code = pass_time(&r, err);
    lap(&closing, NULL);
    code = end(&r, code, err);
    lap(&closing, &report.closing_s);
    lap(&total, &report.total_s);
    report.cpu_s = cpu_s() - cpu_before_s;
    report.n_poses = r.n_poses;
    report.events = sim_event_sensor_stats(rig->event_sensor);
    if (code == SHEF_OK)
        *out_report = report;
    return code;
}
