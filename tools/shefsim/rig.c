#include "shefsim/rig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/time.h"
#include "shefsim/random.h"
#include "shefsim/ranges.h"
#include "shefsim/rig_parts.h"

/* Rays a pixel and side: the event camera's images are few and small, the frames' many and large;
 * there the instants of an exposure share the work. */
#define EVENT_SUPERSAMPLE 2
#define FRAME_SUPERSAMPLE 1

/* The first exposure begins here: by then the event sensor has seen some images. */
#define FIRST_FRAME_NS 10000000

/* Events go on for so long after the last frame: its snapshot needs what follows mid-exposure. */
#define AFTER_FRAMES_NS 40000000

/* Of a frame's time. */
#define LONGEST_EXPOSURE 0.98

/* Times at which the fastest motion is looked for. */
#define N_SPEEDS 8

/* Steps are whole multiples of this. */
#define STEP_UNIT_NS 10000

static enum shef_err check(const struct sim_rig_settings *settings, struct shef_error *err)
{
    const struct sim_range ranges[] = {
        { "the length in s", settings->seconds, 0.01, 600 },
        { "the rate of frames in Hz", settings->fps, 1, 200 },
        { "the exposure in ms", settings->exposure_ms, 0, 100 },
        { "the blinking in Hz", settings->blink_hz, 0, 100 },
    };

    return sim_ranges_check("rig", ranges, sizeof ranges / sizeof *ranges, err);
}

static enum shef_err open_world(struct sim_rig *rig, struct shef_error *err)
{
    const struct sim_rig_settings *settings = &rig->settings;
    const struct sim_scene_options scene = { settings->light, settings->seed, rig->workers };
    const struct sim_path_params path = {
        .name = settings->path,
        .size_m = settings->path_size_m,
        .speed_m_s = settings->speed_m_s,
        .tilt_deg = settings->tilt_deg,
        .phase = settings->phase,
    };
    const struct shef_rigid base = sim_path_base();
    enum shef_err code = sim_path_create(&rig->path, &path, err);

    rig->t_base_world = shef_rigid_invert(&base);
    if (code == SHEF_OK)
        code = sim_path_check(rig->path, NULL, err);
    if (code == SHEF_OK)
        code = sim_scene_open(&rig->scene, settings->scene, &scene, err);
    return code == SHEF_OK ? sim_path_check(rig->path, rig->scene, err) : code;
}

static enum shef_err mount(struct sim_rig *rig, struct shef_error *err)
{
    enum shef_err code =
        sim_rig_calibration(rig->settings.sensor.latency_ns, &rig->calibration, err);

    if (code == SHEF_OK)
        code = shef_rectification_pair(&rig->calibration, SIM_RIG_TRUTH_PROFILE, &rig->left,
                                       &rig->right, &rig->baseline_m, err);
    if (code != SHEF_OK)
        return code;
    rig->t_frame_event = shef_rigid_invert(&rig->calibration.t_event_frame);
    rig->t_frame_left = shef_rigid_identity();
    memcpy(rig->t_frame_left.r, rig->left.r_camera_rectified, sizeof rig->t_frame_left.r);
    rig->t_left_right = shef_rigid_identity();
    rig->t_left_right.t_m[0] = rig->baseline_m;
    return SHEF_OK;
}

static enum shef_err open_views(struct sim_rig *rig, uint32_t cpu_features, struct shef_error *err)
{
    const struct shef_calibrated_camera *event = &rig->calibration.event;
    const struct shef_calibrated_camera *frame = &rig->calibration.frame;
    const struct sim_view_params event_params = { event->width_px, event->height_px, event->model,
                                                  EVENT_SUPERSAMPLE };
    const struct sim_view_params frame_params = { frame->width_px, frame->height_px, frame->model,
                                                  FRAME_SUPERSAMPLE };
    const struct sim_view_params truth_params = {
        .width_px = rig->left.width_px,
        .height_px = rig->left.height_px,
        .camera = { rig->left.f_px, rig->left.f_px, rig->left.cx_px, rig->left.cy_px },
        .supersample = 1,
    };
    enum shef_err code = sim_view_create(&rig->event_view, rig->scene, &event_params, rig->workers,
                                         cpu_features, err);

    if (code == SHEF_OK)
        code = sim_view_create(&rig->truth_view, rig->scene, &truth_params, rig->workers,
                               cpu_features, err);
    if (code == SHEF_OK && !rig->settings.without_frames)
        code = sim_view_create(&rig->frame_view, rig->scene, &frame_params, rig->workers,
                               cpu_features, err);
    return code;
}

static enum shef_err make_maps(struct sim_rig_maps *maps, int32_t width_px, int32_t height_px,
                               struct shef_error *err)
{
    enum shef_err code = shef_image_create_f32(&maps->depth_m, width_px, height_px, err);

    if (code == SHEF_OK)
        code = shef_image_create_f32(&maps->disparity_px, width_px, height_px, err);
    return code == SHEF_OK ? shef_image_create_u8(&maps->mask, width_px, height_px, err) : code;
}

static enum shef_err make_images(struct sim_rig *rig, struct shef_error *err)
{
    const struct shef_calibrated_camera *event = &rig->calibration.event;
    const struct shef_calibrated_camera *frame = &rig->calibration.frame;
    const bool has_colour = rig->settings.format == SIM_FRAME_BAYER_RG8;
    const int32_t n_objects = sim_scene_n_objects(rig->scene);
    enum shef_err code =
        shef_image_create_f32(&rig->event_light, event->width_px, event->height_px, err);

    for (int32_t view = 0; code == SHEF_OK && view < SHEF_TRUTH_VIEWS; view++)
        code = make_maps(&rig->truth[view], rig->left.width_px, rig->left.height_px, err);
    for (int32_t view = 0; code == SHEF_OK && view < SHEF_TRUTH_VIEWS; view++)
        code = shef_image_create_u8(&rig->on_sensor[view], rig->left.width_px, rig->left.height_px,
                                    err);
    if (code != SHEF_OK || rig->settings.without_frames)
        return code;
    code = shef_image_create_f32(&rig->frame_light, frame->width_px, frame->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_u8(&rig->frame, frame->width_px, frame->height_px, err);
    if (code == SHEF_OK && has_colour)
        code = shef_image_create_f32(&rig->frame_depth, frame->width_px, frame->height_px, err);
    if (code == SHEF_OK && has_colour)
        code = shef_image_create_i16(&rig->frame_object, frame->width_px, frame->height_px, err);
    if (code != SHEF_OK || !has_colour)
        return code;
    rig->tints = calloc((size_t)n_objects + 1, sizeof *rig->tints);
    if (!rig->tints)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "rig: out of memory");
    for (int32_t i = 0; i < n_objects; i++)
        sim_scene_object_tint(rig->scene, i, rig->tints[i]);
    return SHEF_OK;
}

/* Steps and instants so short that the image moves by at most half a pixel. */
static void pace(struct sim_rig *rig)
{
    const double frame_scale = rig->calibration.frame.model.fx_px / rig->left.f_px;
    double fastest = 0;
    int64_t step_ns = SIM_RIG_MAX_STEP_NS;

    for (int32_t i = 0; i <= N_SPEEDS; i++)
        fastest = fmax(fastest, sim_rig_speed_px_s(rig, rig->total_ns * i / N_SPEEDS));
    if (fastest * (double)SIM_RIG_MAX_STEP_NS * 1e-9 > SIM_RIG_STEP_PX)
        step_ns = (int64_t)(SIM_RIG_STEP_PX * 1e9 / fastest);
    step_ns -= step_ns % STEP_UNIT_NS;
    rig->step_ns = step_ns > STEP_UNIT_NS ? step_ns : STEP_UNIT_NS;
    rig->largest_speed_px_s = fastest;
    rig->n_instants = sim_frame_sensor_n_instants(fastest * frame_scale *
                                                  (double)rig->frame_params.exposure_ns * 1e-9);
}

static enum shef_err make_sensors(struct sim_rig *rig, uint32_t cpu_features,
                                  struct shef_error *err)
{
    const struct sim_rig_settings *settings = &rig->settings;
    const struct shef_calibrated_camera *event = &rig->calibration.event;
    const struct shef_calibrated_camera *frame = &rig->calibration.frame;
    const double by_light_ms = strcmp(settings->light, "day") == 0 ? 5 : 10;
    const double exposure_ms = settings->exposure_ms > 0 ? settings->exposure_ms : by_light_ms;
    struct sim_frame_sensor_params *params = &rig->frame_params;
    const enum shef_err code =
        sim_event_sensor_create(&rig->event_sensor, &settings->sensor, event->width_px,
                                event->height_px, settings->seed, cpu_features, rig->workers, err);

    if (code != SHEF_OK)
        return code;
    *params = sim_frame_sensor_default(frame->width_px, frame->height_px);
    params->format = settings->format;
    params->exposure_ns = (int64_t)(exposure_ms * 1e6 + 0.5);
    if ((double)params->exposure_ns * settings->fps > LONGEST_EXPOSURE * 1e9)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "an exposure of %g ms is too long for %g frames per second; it can be up "
                         "to %.4g ms",
                         exposure_ms, settings->fps, LONGEST_EXPOSURE * 1e3 / settings->fps);
    pace(rig);
    if (settings->without_frames)
        return SHEF_OK;

    const struct sim_rig_frame first = sim_rig_frame_at(rig, 0);

    sim_rig_see_frame(rig, &first);
    params->gain_mdb = sim_frame_sensor_gain_mdb(params, rig->frame_light);
    return sim_frame_sensor_create(&rig->frame_sensor, params, settings->seed, cpu_features,
                                   rig->workers, err);
}

enum shef_err sim_rig_create(struct sim_rig **out_rig, const struct sim_rig_settings *settings,
                             uint32_t cpu_features, struct shef_workers *workers,
                             struct shef_error *err)
{
    enum shef_err code = check(settings, err);
    struct sim_rig *rig;

    if (code != SHEF_OK)
        return code;
    rig = calloc(1, sizeof *rig);
    if (!rig)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "rig: out of memory");
    rig->settings = *settings;
    rig->workers = workers;
    rig->scan = sim_event_scan_pick(cpu_features);
    rig->frames_ns = (int64_t)(settings->seconds * 1e9 + 0.5);
    rig->total_ns = rig->frames_ns + (settings->without_frames ? 0 : AFTER_FRAMES_NS);
    rig->clocks = sim_clocks_draw(settings->seed, settings->frame_tick_ns);
    code = open_world(rig, err);
    if (code == SHEF_OK)
        code = mount(rig, err);
    if (code == SHEF_OK)
        code = open_views(rig, cpu_features, err);
    if (code == SHEF_OK)
        code = make_images(rig, err);
    if (code == SHEF_OK) {
        sim_rig_find_sensors(rig);
        code = make_sensors(rig, cpu_features, err);
    }
    if (code == SHEF_OK)
        *out_rig = rig;
    else
        sim_rig_destroy(rig);
    return code;
}

void sim_rig_destroy(struct sim_rig *rig)
{
    if (!rig)
        return;
    sim_frame_sensor_destroy(rig->frame_sensor);
    sim_event_sensor_destroy(rig->event_sensor);
    free(rig->tints);
    shef_image_destroy_f32(&rig->event_light);
    shef_image_destroy_f32(&rig->frame_light);
    shef_image_destroy_f32(&rig->frame_depth);
    shef_image_destroy_i16(&rig->frame_object);
    shef_image_destroy_u8(&rig->frame);
    for (int32_t view = 0; view < SHEF_TRUTH_VIEWS; view++) {
        shef_image_destroy_f32(&rig->truth[view].depth_m);
        shef_image_destroy_f32(&rig->truth[view].disparity_px);
        shef_image_destroy_u8(&rig->truth[view].mask);
        shef_image_destroy_u8(&rig->on_sensor[view]);
    }
    sim_view_destroy(rig->event_view);
    sim_view_destroy(rig->frame_view);
    sim_view_destroy(rig->truth_view);
    sim_scene_destroy(rig->scene);
    sim_path_destroy(rig->path);
    free(rig);
}

struct shef_rigid sim_rig_pose(const struct sim_rig *rig, int64_t t_ns)
{
    return sim_path_pose(rig->path, t_ns);
}

struct shef_rigid sim_rig_hand(const struct sim_rig *rig, int64_t t_ns)
{
    const struct shef_rigid t_world_frame = sim_rig_pose(rig, t_ns);
    const struct shef_rigid t_base_frame = shef_rigid_compose(&rig->t_base_world, &t_world_frame);
    const struct shef_rigid t_frame_hand = shef_rigid_invert(&rig->calibration.t_hand_frame);

    return shef_rigid_compose(&t_base_frame, &t_frame_hand);
}

struct sim_rig_frame sim_rig_frame_at(const struct sim_rig *rig, uint64_t number)
{
    /* The frame camera's own clock sets the pace. */
    const int64_t first_ns = rig->clocks.frame.start_ns + FIRST_FRAME_NS;
    const int64_t after_ns = (int64_t)((double)number * 1e9 / rig->settings.fps);
    const int64_t start_ns = sim_clock_when(&rig->clocks.frame, first_ns + after_ns);
    const int64_t end_ns = start_ns + rig->frame_params.exposure_ns;

    return (struct sim_rig_frame){
        .number = number,
        .start_ns = start_ns,
        .end_ns = end_ns,
        .rise_us = sim_clock_at(&rig->clocks.event, start_ns) / SHEF_NS_PER_US,
        .fall_us = sim_clock_at(&rig->clocks.event, end_ns) / SHEF_NS_PER_US,
        .time = { sim_clock_at(&rig->clocks.frame, start_ns) },
    };
}

/* Which phase blinking surfaces show. */
static bool is_lit(const struct sim_rig *rig, int64_t t_ns)
{
    return (int64_t)((double)t_ns * 1e-9 * 2 * rig->settings.blink_hz) % 2 == 0;
}

void sim_rig_see_events(struct sim_rig *rig, int64_t t_ns)
{
    const struct shef_rigid frame = sim_rig_pose(rig, t_ns);
    const struct shef_rigid event = shef_rigid_compose(&frame, &rig->t_frame_event);

    sim_view_set_blink(rig->event_view, is_lit(rig, t_ns));
    sim_view_render(rig->event_view, &event, rig->event_light);

    /* Light that comes back to exactly where it was would lie exactly on a threshold, where no two
     * event models agree: real light never does. */
    const uint64_t key = sim_key(rig->settings.seed, SIM_STREAM_GRAIN, (uint64_t)t_ns);

    for (int32_t y = 0; y < rig->event_light.height_px; y++)
        rig->scan->grain(shef_row_f32(rig->event_light, y),
                         (uint32_t)(sim_random(key, (uint64_t)y) >> 32), rig->event_light.width_px);
}

void sim_rig_see_frame(struct sim_rig *rig, const struct sim_rig_frame *frame)
{
    const int64_t mid_ns = (frame->start_ns + frame->end_ns) / 2;
    const struct shef_rigid mid = sim_rig_pose(rig, mid_ns);
    struct shef_rigid poses[SIM_FRAME_MAX_INSTANTS];

    for (int32_t i = 0; i < rig->n_instants; i++)
        poses[i] = sim_rig_pose(rig, frame->start_ns + sim_frame_sensor_instant_ns(
                                                           &rig->frame_params, i, rig->n_instants));
    sim_view_set_blink(rig->frame_view, is_lit(rig, mid_ns));
    sim_view_render_exposure(rig->frame_view, poses, rig->n_instants, rig->frame_light);
    if (rig->tints)
        sim_view_depth(rig->frame_view, &mid, rig->frame_depth, rig->frame_object);
}

void sim_rig_expose(struct sim_rig *rig, const struct sim_rig_frame *frame)
{
    sim_frame_sensor_expose(rig->frame_sensor, frame->number, rig->frame_light,
                            (const float(*)[3])rig->tints, rig->frame_object, rig->frame);
}
