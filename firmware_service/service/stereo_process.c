/* From a frame and its snapshot to a result on its way to the publisher. */
#include <math.h>
#include <string.h>

#include "core/clock.h"
#include "publish/encoder.h"
#include "service/push.h"
#include "service/stereo_internal.h"

shef_host_time shef_stereo_host(const struct shef_stereo_stage *stage, shef_event_time event,
                                uint32_t pass)
{
    const struct shef_source *source = stage->params.source;
    const int64_t passed_ns = pass * source->pass_ns;
    const shef_host_time first_pass =
        shef_source_host(source, shef_event_time_add(event, -passed_ns));

    return shef_host_time_add(first_pass, passed_ns + stage->params.pace->host_shift_ns);
}

static bool find_pose(const struct shef_stereo_stage *stage, shef_host_time at,
                      struct shef_tracked_pose *out_pose)
{
    /* The samples are only read. */
    const struct shef_pose_track track = {
        .poses = (struct shef_tracked_pose *)(uintptr_t)stage->poses,
        .n = stage->n_poses,
    };

    return stage->n_poses > 0 && shef_pose_track_at(&track, at, out_pose);
}

/* How far a pose may be off: the hand-eye calibration, and the motion within the time's error. */
static void set_covariance(const struct shef_calibration *calibration,
                           const struct shef_tracked_pose *pose, int64_t t_err_ns,
                           double out_covariance[36])
{
    const double t_err_s = (double)(t_err_ns + calibration->robot_delay.sigma_ns) * 1e-9;

    for (int i = 0; i < 6; i++) {
        const double fixed = i < 3 ? calibration->t_hand_frame_sigma.position_m
                                   : calibration->t_hand_frame_sigma.rotation_rad;
        const double moved = pose->speed[i] * t_err_s;

        out_covariance[7 * i] = fixed * fixed + moved * moved;
    }
}

static void set_pose(const struct shef_stereo_stage *stage, bool is_known,
                     const struct shef_tracked_pose *tracked, struct shef_result *result)
{
    const struct shef_calibration *calibration = &stage->params.source->calibration;
    struct shef_rigid t_camera_rectified = shef_rigid_identity();
    struct shef_rigid t_world_camera;

    if (!is_known) {
        result->pose.validity =
            stage->params.source->poses.n > 0 ? SHEF_POSE_NO_SAMPLE : SHEF_POSE_NO_SOURCE;
        return;
    }
    memcpy(t_camera_rectified.r, stage->geometry.r_camera_rectified, sizeof t_camera_rectified.r);
    t_world_camera = shef_rigid_compose(&tracked->t_world_hand, &calibration->t_hand_frame);
    result->pose.t_world_rectified = shef_rigid_compose(&t_world_camera, &t_camera_rectified);
    result->pose.validity = SHEF_POSE_VALID;
    set_covariance(calibration, tracked, result->t_err_ns, result->pose.covariance);
}

static uint32_t result_flags(const struct shef_depth_report *report,
                             const struct shef_snapshot *snapshot,
                             const struct shef_pairing_result *pairing, enum shef_depth_mode wanted)
{
    return (pairing->flags & SHEF_PAIRING_AMBIGUOUS ? SHEF_RESULT_TIME_AMBIGUOUS : 0) |
           (snapshot->flags & SHEF_SNAPSHOT_PREDICTED ? SHEF_RESULT_TIME_PREDICTED : 0) |
           (report->flags & SHEF_DEPTH_NO_MOTION ? SHEF_RESULT_NO_MOTION : 0) |
           (report->flags & SHEF_DEPTH_NO_PAST ? SHEF_RESULT_NO_PAST : 0) |
           (report->flags & SHEF_DEPTH_IS_SATURATED ? SHEF_RESULT_SATURATED : 0) |
           (report->flags & SHEF_DEPTH_NO_CONFIDENCE ? SHEF_RESULT_NO_CONFIDENCE : 0) |
           (report->flags & SHEF_DEPTH_SETTLING ? SHEF_RESULT_SETTLING : 0) |
           (report->mode != wanted ? SHEF_RESULT_MODE_CHANGED : 0);
}

static void copy_picture(const struct shef_depth_chain *chain, struct shef_result *result)
{
    const struct shef_image_u8 from = shef_depth_chain_picture(chain);

    for (int32_t y = 0; y < from.height_px; y++)
        memcpy(shef_row_u8(result->picture, y), shef_row_u8(from, y), (size_t)from.width_px);
    result->has_picture = true;
}

static void fill_header(const struct shef_stereo_stage *stage, const struct shef_frame_item *frame,
                        const struct shef_snapshot_item *snapshot,
                        const struct shef_pairing_result *pairing, struct shef_result *result)
{
    const struct shef_depth_geometry *geometry = &stage->geometry;

    result->seq = frame->frame.number;
    result->mid = snapshot->snapshot->mid;
    result->mid_host = shef_stereo_host(stage, result->mid, snapshot->pass);
    result->utc_minus_mono_ns = stage->params.utc_minus_mono_ns;
    result->t_err_ns = pairing->t_err_ns;
    result->complete = frame->complete;
    result->session_id = stage->params.session_id;
    memcpy(result->calib_id, stage->calib_id, sizeof result->calib_id);
    result->f_px = geometry->f_px;
    result->cx_px = geometry->cx_px;
    result->cy_px = geometry->cy_px;
    result->baseline_m = geometry->baseline_m;
}

/* The settings that count for one frame, each read once: they may change at any time. */
struct settings {
    enum shef_depth_mode mode;
    uint32_t outputs;
    int32_t grid_step;
};

static struct settings read_settings(const struct shef_live *live)
{
    return (struct settings){
        .mode = (enum shef_depth_mode)shef_live_get(&live->mode),
        .outputs = atomic_load_explicit(&live->outputs, memory_order_relaxed),
        .grid_step = shef_live_get(&live->grid_step),
    };
}

/* Returns whether a dense image is wanted. */
static bool set_up_chain(struct shef_stereo_stage *stage, const struct settings *settings,
                         uint32_t shed_bits)
{
    const enum shef_err code = shef_depth_chain_set_mode(stage->chain, settings->mode);

    (void)code; /* every mode was listed */
    shef_depth_chain_set_shed(
        stage->chain, (shed_bits & SHEF_RESULT_SHED_DENSE ? SHEF_DEPTH_SHED_DENSE : 0) |
                          (shed_bits & SHEF_RESULT_SHED_RANGE ? SHEF_DEPTH_SHED_HALF_RANGE : 0));
    return (settings->outputs & SHEF_OUTPUT(SHEF_CHANNEL_DENSE)) &&
           !(shed_bits & SHEF_RESULT_SHED_DENSE);
}

/* Of what was to be left out, what the frame would have had. */
static uint32_t shed_in_effect(const struct settings *settings,
                               const struct shef_depth_report *report, uint32_t shed_bits)
{
    const bool has_dense = (settings->outputs & SHEF_OUTPUT(SHEF_CHANNEL_DENSE)) &&
                           !(report->flags & SHEF_DEPTH_NO_CONFIDENCE);
    const bool has_cloud = settings->outputs & SHEF_OUTPUT(SHEF_CHANNEL_CLOUD);

    return shed_bits &
           ((has_dense ? SHEF_RESULT_SHED_DENSE : 0) | (has_cloud ? SHEF_RESULT_SHED_CLOUD : 0) |
            (settings->grid_step == 1 ? SHEF_RESULT_SHED_FULL_GRID : 0) |
            (report->shed & SHEF_DEPTH_SHED_HALF_RANGE ? SHEF_RESULT_SHED_RANGE : 0));
}

static void run_chain(struct shef_stereo_stage *stage, const struct shef_frame_item *frame,
                      const struct shef_snapshot_item *snapshot,
                      const struct shef_pairing_result *pairing, const struct settings *settings,
                      uint32_t shed_bits, struct shef_result *result)
{
    const bool has_dense = set_up_chain(stage, settings, shed_bits);
    const struct shef_frame_info *info = &frame->frame.info;
    struct shef_depth_input input = {
        .number = (int64_t)info->number,
        .frame = { frame->frame.buffer->data, (int32_t)info->width_px, (int32_t)info->height_px,
                   (ptrdiff_t)info->row_bytes },
        .snapshot = snapshot->snapshot,
    };
    struct shef_depth_output output = {
        .disparity = result->disparity,
        .confidence = result->confidence,
        .depth_m = result->depth_m,
        .sigma_m = result->sigma_m,
    };
    struct shef_depth_report report;
    struct shef_tracked_pose pose;

    if (has_dense) {
        output.dense_disparity = result->dense_disparity;
        output.dense_confidence = result->dense_confidence;
    }
    input.has_velocity = find_pose(stage, result->mid_host, &pose);
    if (input.has_velocity)
        shef_depth_velocity(&stage->params.source->calibration, &stage->geometry,
                            &pose.t_world_hand, pose.speed, input.velocity_m_s);
    shef_depth_chain_process(stage->chain, &input, &output, &report);

    set_pose(stage, input.has_velocity, &pose, result);
    result->mode = (int32_t)report.mode;
    result->flags = result_flags(&report, snapshot->snapshot, pairing, settings->mode);
    result->shed_bits = shed_in_effect(settings, &report, shed_bits);
    result->max_disparity_px = (float)stage->geometry.max_disparity_px /
                               (report.shed & SHEF_DEPTH_SHED_HALF_RANGE ? 2 : 1);
    result->has_dense = has_dense && !(report.flags & SHEF_DEPTH_NO_CONFIDENCE);
    result->stage_ns[SHEF_RESULT_STAGE_PICTURES] = report.stage_ns[SHEF_DEPTH_PICTURES];
    result->stage_ns[SHEF_RESULT_STAGE_FLOW] = report.stage_ns[SHEF_DEPTH_FLOW];
    result->stage_ns[SHEF_RESULT_STAGE_MATCH] = report.stage_ns[SHEF_DEPTH_MATCH];
    result->stage_ns[SHEF_RESULT_STAGE_CONVERT] = report.stage_ns[SHEF_DEPTH_CONVERT];
    shef_count(&stage->params.counters->n_with_velocity, input.has_velocity);
}

/* For how long the frame has waited though all it needs was there; 0 without a clock. */
static int64_t waited_ns(const struct shef_stereo_stage *stage, const struct shef_frame_item *frame,
                         const struct shef_snapshot_item *snapshot)
{
    const struct shef_pace *pace = stage->params.pace;
    shef_host_time since = frame->complete;

    if (!shef_pace_is_live(pace))
        return 0;
    if (shef_host_time_before(since, snapshot->ready))
        since = snapshot->ready;
    /* What had to wait for the first pair is no backlog. */
    if (shef_host_time_before(since, stage->locked_at))
        return 0;
    return shef_host_time_since(shef_clock_now(pace->clock), since);
}

/* Decides what is left out. Returns false if that is the whole frame. */
static bool decide(struct shef_stereo_stage *stage, int64_t wait_ns, uint32_t *out_bits)
{
    struct shef_counters *counters = stage->params.counters;
    int32_t after_ms[SHEF_SHED_LEVELS];
    struct shef_shed_decision decision;

    *out_bits = 0;
    if (!shef_pace_is_live(stage->params.pace))
        return true;
    for (int i = 0; i < SHEF_SHED_LEVELS; i++)
        after_ms[i] = shef_live_get(&stage->params.live->shed_after_ms[i]);
    decision = shef_shed_next(&stage->shed, wait_ns, after_ms);
    shef_counter_set(&counters->shed_level, (uint64_t)stage->shed.n_levels);
    *out_bits = decision.bits;
    return !decision.drops_frame;
}

static void count_times(struct shef_stereo_stage *stage, const struct shef_result *result,
                        int64_t wait_ns, int64_t took_ns)
{
    struct shef_counters *counters = stage->params.counters;

    shef_latency_add(&counters->waiting, wait_ns);
    shef_latency_add(&counters->pictures, result->stage_ns[SHEF_RESULT_STAGE_PICTURES]);
    shef_latency_add(&counters->flow, result->stage_ns[SHEF_RESULT_STAGE_FLOW]);
    shef_latency_add(&counters->matching, result->stage_ns[SHEF_RESULT_STAGE_MATCH]);
    shef_latency_add(&counters->converting, result->stage_ns[SHEF_RESULT_STAGE_CONVERT]);
    shef_latency_add(&counters->stereo, took_ns);
}

/* Leaves the newest result where the control thread finds it. */
static void show(struct shef_stereo_stage *stage, struct shef_result *result)
{
    struct shef_result *before;

    shef_result_share(result);
    /* Acquire and release: the result's content goes with the pointer, both ways. */
    before = atomic_exchange_explicit(stage->params.newest, result, memory_order_acq_rel);
    if (before)
        shef_result_give(before);
}

static void hand_on(struct shef_stereo_stage *stage, struct shef_result *result,
                    shef_host_time finished)
{
    struct shef_counters *counters = stage->params.counters;
    const struct shef_result_item item = { .result = result, .finished = finished };

    show(stage, result);
    if (shef_push_in_time(stage->results_out, &item, stage->params.pace, stage->wake)) {
        shef_count(&counters->n_finished, 1);
        return;
    }
    shef_count(&counters->n_lost[SHEF_LOSS_NO_RESULT], 1);
    shef_result_give(result);
}

/* A free result, and with it dense images if some are left. Where no clock counts both are waited
 * for. NULL: the publisher is behind. */
static struct shef_result *take_result(struct shef_stereo_stage *stage, bool needs_dense)
{
    struct shef_pace *pace = stage->params.pace;
    struct shef_result *result = shef_result_take(stage->results);

    while ((!result || (needs_dense && !result->dense_disparity.data)) &&
           !shef_pace_is_live(pace) && !shef_pace_is_stopping(pace)) {
        if (result)
            shef_result_give(result);
        shef_wake_wait(stage->wake, SHEF_PUSH_LOOK_AGAIN_MS);
        result = shef_result_take(stage->results);
    }
    return result;
}

/* Makes the frame take longer, for tests of what happens then. */
static void drag(const struct shef_stereo_stage *stage)
{
    const int32_t drag_us = shef_live_get(&stage->params.live->drag_us);
    const struct timespec pause = { drag_us / 1000000, drag_us % 1000000 * 1000L };

    if (drag_us > 0)
        nanosleep(&pause, NULL);
}

void shef_stereo_process(struct shef_stereo_stage *stage, const struct shef_frame_item *frame,
                         const struct shef_snapshot_item *snapshot,
                         const struct shef_pairing_result *pairing)
{
    const struct shef_clock *clock = stage->params.pace->clock;
    const shef_host_time start = shef_clock_now(clock);
    const int64_t wait_ns = waited_ns(stage, frame, snapshot);
    const struct settings settings = read_settings(stage->params.live);
    struct shef_result *result;
    uint32_t shed_bits;

    if (!decide(stage, wait_ns, &shed_bits)) {
        shef_count(&stage->params.counters->n_lost[SHEF_LOSS_SHED], 1);
        return;
    }
    result = take_result(stage, settings.outputs & SHEF_OUTPUT(SHEF_CHANNEL_DENSE));
    if (!result) {
        shef_count(&stage->params.counters->n_lost[SHEF_LOSS_NO_RESULT], 1);
        return;
    }
    /* A publisher that lags behind holds all dense images: they are the first to go. */
    if (!result->dense_disparity.data)
        shed_bits |= SHEF_RESULT_SHED_DENSE;
    fill_header(stage, frame, snapshot, pairing, result);
    run_chain(stage, frame, snapshot, pairing, &settings, shed_bits, result);
    copy_picture(stage->chain, result);
    drag(stage);
    result->stage_ns[SHEF_RESULT_STAGE_WAIT] = wait_ns;
    shef_count(&stage->params.counters->n_ambiguous,
               (pairing->flags & SHEF_PAIRING_AMBIGUOUS) != 0);

    const shef_host_time finished = shef_clock_now(clock);

    count_times(stage, result, wait_ns, shef_host_time_since(finished, start));
    hand_on(stage, result, finished);
}
