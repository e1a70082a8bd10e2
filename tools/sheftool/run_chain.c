#include "sheftool/run_chain.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/memory.h"
#include "pipeline/warp.h"
#include "sheftool/command.h"
#include "sheftool/events_moments.h"
#include "record/recorded_clock.h"
#include "sheftool/run_internal.h"

/* Frames are offered to the pairing this far ahead of the snapshots. */
#define FRAMES_AHEAD 8

static SHEF_PRINTF(2, 3) void add_note(struct shef_run *run, const char *fmt, ...)
{
    va_list args;

    if (run->n_notes == SHEF_RUN_MAX_NOTES)
        return;
    va_start(args, fmt);
    vsnprintf(run->notes[run->n_notes++], sizeof run->notes[0], fmt, args);
    va_end(args);
}

static enum shef_err read_calibration(struct shef_run *run, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];

    if (run->settings.calibration)
        return shef_calibration_read(run->settings.calibration, &run->calibration, err);
    snprintf(path, sizeof path, "%s/calibration.yaml", run->settings.recording);
    if (access(path, F_OK) != 0)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s' has no calibration.yaml, without which there is no depth; name one "
                         "with --calibration",
                         run->settings.recording);
    return shef_calibration_read(path, &run->calibration, err);
}

static enum shef_err check_sizes(const struct shef_run *run, struct shef_error *err)
{
    const struct shef_calibration *calibration = &run->calibration;
    const struct shef_frame_part *frames = shef_recorded_frames_format(run->frames);

    if ((int32_t)frames->width_px != calibration->frame.width_px ||
        (int32_t)frames->height_px != calibration->frame.height_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' has frames of %u x %u px, but the calibration is for %d x %d px; "
                         "it belongs to another camera or setting",
                         run->settings.recording, frames->width_px, frames->height_px,
                         calibration->frame.width_px, calibration->frame.height_px);
    if ((int32_t)run->width_px != calibration->event.width_px ||
        (int32_t)run->height_px != calibration->event.height_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' has events of %u x %u px, but the calibration is for %d x %d px; "
                         "it belongs to another camera",
                         run->settings.recording, run->width_px, run->height_px,
                         calibration->event.width_px, calibration->event.height_px);
    return SHEF_OK;
}

static enum shef_err pixels_of(const struct shef_run *run, enum shef_frame_pixels *out_pixels,
                               struct shef_error *err)
{
    const uint32_t format = shef_recorded_frames_format(run->frames)->pixel_format;

    if (!shef_frame_pixels_of(format, out_pixels))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "'%s' has frames of pixel format 0x%08x; Mono8 and Bayer of 8 bits can be "
                         "processed",
                         run->settings.recording, format);
    return SHEF_OK;
}

static enum shef_err create_chains(struct shef_run *run, struct shef_error *err)
{
    const struct shef_run_settings *settings = &run->settings;
    struct shef_depth_params params = settings->depth;
    enum shef_err code = pixels_of(run, &params.pixels, err);

    params.profile = shef_run_profile(run);
    if (settings->n_threads > 1 && code == SHEF_OK) {
        run->workers = shef_workers_create(settings->n_threads, err);
        code = run->workers ? SHEF_OK : err->code;
    }
    for (int32_t i = 0; i < settings->n_modes && code == SHEF_OK; i++) {
        params.mode = settings->modes[i];
        params.modes = 1u << params.mode;
        code = shef_depth_chain_create(&run->chains[i], &run->calibration, &params, run->workers,
                                       settings->cpu_features, err);
    }
    if (code == SHEF_OK) {
        run->geometry = shef_depth_chain_geometry(run->chains[0]);
        code = shef_depth_output_create(&run->output, &run->geometry, true, err);
    }
    return code;
}

static enum shef_err open_robot(struct shef_run *run, struct shef_error *err)
{
    const struct shef_run_settings *settings = &run->settings;

    if (settings->ignores_robot)
        return SHEF_OK;

    const enum shef_err code = shef_pose_track_read(
        settings->recording, run->calibration.robot_delay.ns, &run->poses, err);

    if (code == SHEF_ERR_NOT_FOUND && !settings->needs_robot) {
        add_note(run, "no poses were recorded: the direction of motion is found from the pictures");
        return SHEF_OK;
    }
    if (code == SHEF_OK && !run->clock.is_known && settings->needs_robot)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s': the events' index does not say when they arrived, so poses cannot "
                         "be joined; run without --robot",
                         settings->recording);
    if (code == SHEF_OK && !run->clock.is_known) {
        add_note(run, "the events' index does not say when they arrived: poses cannot be joined");
        shef_pose_track_free(&run->poses);
    }
    return code;
}

enum shef_err shef_run_open(struct shef_run **out_run, const struct shef_run_settings *settings,
                            struct shef_error *err)
{
    struct shef_run *run = calloc(1, sizeof *run);

    if (!run)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    run->settings = *settings;

    enum shef_err code =
        shef_events_source_open(settings->recording, settings->cpu_features, &run->events, err);

    if (code == SHEF_OK)
        code = shef_events_source_size(run->events, settings->recording, &run->width_px,
                                       &run->height_px, err);
    if (code == SHEF_OK)
        code = shef_recorded_frames_open(settings->recording, &run->frames, err);
    if (code == SHEF_OK)
        code = read_calibration(run, err);
    if (code == SHEF_OK)
        code = check_sizes(run, err);
    if (code == SHEF_OK)
        code = shef_recorded_clock_read(settings->recording, &run->clock, err);
    if (code == SHEF_OK)
        code = open_robot(run, err);
    if (code == SHEF_OK)
        code = create_chains(run, err);
    if (code != SHEF_OK) {
        shef_run_close(run);
        return code;
    }
    *out_run = run;
    return SHEF_OK;
}

void shef_run_close(struct shef_run *run)
{
    if (!run)
        return;
    for (int32_t i = 0; i < SHEF_DEPTH_N_MODES; i++)
        shef_depth_chain_destroy(run->chains[i]);
    shef_depth_output_destroy(&run->output);
    shef_workers_destroy(run->workers);
    shef_pose_track_free(&run->poses);
    for (int32_t i = 0; i < N_HELD; i++)
        free(run->held[i].memory);
    shef_recorded_frames_close(run->frames);
    shef_events_source_close(run->events);
    free(run);
}

const struct shef_calibration *shef_run_calibration(const struct shef_run *run)
{
    return &run->calibration;
}

const char *shef_run_profile(const struct shef_run *run)
{
    return run->settings.profile ? run->settings.profile : run->calibration.profile;
}

uint32_t shef_run_n_frames(const struct shef_run *run)
{
    return shef_recorded_frames_count(run->frames);
}

struct shef_depth_geometry shef_run_geometry(const struct shef_run *run)
{
    return run->geometry;
}

bool shef_run_has_robot(const struct shef_run *run)
{
    return run->poses.n > 0;
}

size_t shef_run_memory_bytes(const struct shef_run *run)
{
    return shef_depth_chain_memory_bytes(run->chains[0]);
}

struct shef_run_counts shef_run_counts(const struct shef_run *run)
{
    return run->counts;
}

const char *shef_run_note(const struct shef_run *run, int i)
{
    return i >= 0 && i < run->n_notes ? run->notes[i] : NULL;
}

/* Copies a snapshot into the place of the oldest held one. */
static enum shef_err hold(struct shef_run *run, const struct shef_snapshot *snapshot,
                          struct shef_error *err)
{
    struct held_snapshot *held = &run->held[run->n_held % N_HELD];
    const struct shef_image_i16 values = snapshot->values;
    const size_t n = (size_t)(values.stride_bytes * values.height_px);
    const size_t n_padded = shef_memory_round_up(n + SHEF_WARP_PAD_BYTES);

    if (!held->memory) {
        held->memory = shef_memory_create(2, n_padded);
        if (!held->memory)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "run: no memory for snapshots");
    }
    held->snapshot = *snapshot;
    held->snapshot.values.data = (int16_t *)held->memory;
    held->snapshot.sums.data = (int16_t *)(held->memory + n_padded);
    memcpy(held->snapshot.values.data, snapshot->values.data, n);
    memcpy(held->snapshot.sums.data, snapshot->sums.data, n);
    held->is_set = true;
    run->n_held++;
    return SHEF_OK;
}

static const struct shef_snapshot *find_held(const struct shef_run *run, uint64_t number)
{
    for (int32_t i = 0; i < N_HELD; i++)
        if (run->held[i].is_set && run->held[i].snapshot.number == number)
            return &run->held[i].snapshot;
    return NULL;
}

static void set_velocity(struct shef_run *run, const struct shef_snapshot *snapshot,
                         struct shef_depth_input *input)
{
    struct shef_tracked_pose pose;

    if (run->poses.n == 0 ||
        !shef_pose_track_at(&run->poses, shef_recorded_clock_host(&run->clock, snapshot->mid),
                            &pose))
        return;
    shef_depth_velocity(&run->calibration, &run->geometry, &pose.t_world_hand, pose.speed,
                        input->velocity_m_s);
    input->has_velocity = true;
    run->counts.n_with_velocity++;
}

/* One frame whose snapshot is known, through all modes. */
static enum shef_err process(struct shef_run *run, const struct shef_pairing_result *pairing,
                             const struct shef_snapshot *snapshot, struct shef_error *err)
{
    struct shef_recorded_frame frame;
    enum shef_err code =
        shef_recorded_frames_read(run->frames, (uint32_t)pairing->tag, &frame, err);

    if (code == SHEF_ERR_FORMAT) {
        run->counts.n_damaged++;
        return SHEF_OK;
    }
    if (code != SHEF_OK)
        return code;

    /* Rows of the picture are borrowed; nothing writes to them. */
    union {
        const uint8_t *read;
        uint8_t *any;
    } pixels = { .read = frame.pixels };
    struct shef_depth_input input = {
        .number = (int64_t)frame.info.number,
        .frame = { pixels.any, (int32_t)frame.info.width_px, (int32_t)frame.info.height_px,
                   (ptrdiff_t)frame.info.row_bytes },
        .snapshot = snapshot,
    };

    if (!shef_frame_is_usable(&frame.info, shef_recorded_frames_format(run->frames))) {
        run->counts.n_damaged++;
        return SHEF_OK;
    }
    set_velocity(run, snapshot, &input);
    run->counts.n_processed++;
    run->counts.n_ambiguous += (pairing->flags & SHEF_PAIRING_AMBIGUOUS) != 0;
    for (int32_t i = 0; i < run->settings.n_modes && code == SHEF_OK; i++) {
        struct shef_depth_report report;

        shef_depth_chain_process(run->chains[i], &input, &run->output, &report);
        code = run->use(run->context,
                        &(struct shef_run_frame){
                            .frame = &frame,
                            .pairing = pairing,
                            .snapshot = snapshot,
                            .mode = i,
                            .chain = run->chains[i],
                            .input = &input,
                            .output = &run->output,
                            .report = &report,
                        },
                        err);
        if (code == SHEF_OK && shef_interrupted())
            code = shef_fail_interrupted(err);
    }
    return code;
}

static bool is_enough(const struct shef_run *run)
{
    return run->settings.max_frames > 0 && run->counts.n_processed >= run->settings.max_frames;
}

/* Processes all frames whose snapshots are decided. */
static enum shef_err drain(struct shef_run *run, struct shef_error *err)
{
    struct shef_pairing_result result;
    enum shef_err code = SHEF_OK;

    while (code == SHEF_OK && !is_enough(run) &&
           shef_pairing_take(&run->pairing, (shef_host_time){ 0 }, &result) == SHEF_OK) {
        const struct shef_snapshot *snapshot =
            result.kind == SHEF_PAIRING_PAIR ? find_held(run, result.snapshot) : NULL;

        if (snapshot)
            code = process(run, &result, snapshot, err);
        else
            run->counts.n_unpaired++;
    }
    return code;
}

/* Offers frames, as many as fit the snapshots that were seen. */
static void offer_frames(struct shef_run *run, uint64_t up_to)
{
    while (run->next_frame < shef_recorded_frames_count(run->frames) && run->next_frame < up_to) {
        const struct shef_frame_info *info =
            shef_recorded_frames_info(run->frames, run->next_frame);
        const struct shef_pairing_frame frame = {
            .tag = run->next_frame,
            .camera = info->time,
            .has_host = run->clock.is_known,
            .arrived = info->arrived,
        };

        if (shef_pairing_add_frame(&run->pairing, &frame) != SHEF_OK)
            return;
        run->next_frame++;
    }
}

static enum shef_err use_moment(void *context, const struct shef_moment *moment,
                                struct shef_error *err)
{
    struct shef_run *run = context;
    const struct shef_snapshot *snapshot = moment->snapshot;
    enum shef_err code = hold(run, snapshot, err);

    if (code != SHEF_OK)
        return code;
    shef_pairing_add_snapshot(&run->pairing,
                              &(struct shef_pairing_snapshot){
                                  .number = snapshot->number,
                                  .rise = snapshot->rise,
                                  .mid = snapshot->mid,
                                  .t_err_ns = snapshot->t_err_ns,
                                  .has_host = run->clock.is_known,
                                  .host = shef_recorded_clock_host(&run->clock, snapshot->rise),
                              });
    offer_frames(run, run->n_held + FRAMES_AHEAD);
    code = drain(run, err);
    return code == SHEF_OK && is_enough(run) ? SHEF_ERR_EMPTY : code;
}

/* What is left when there are no more snapshots. */
static enum shef_err finish(struct shef_run *run, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    shef_pairing_finish(&run->pairing);
    while (code == SHEF_OK && !is_enough(run) &&
           (run->next_frame < run->counts.n_frames || run->pairing.n_frames > 0)) {
        offer_frames(run, run->counts.n_frames);
        code = drain(run, err);
    }
    return code;
}

static void note_all(struct shef_run *run)
{
    const struct shef_run_counts *counts = &run->counts;
    const char *note;

    for (int i = 0; (note = shef_events_source_note(run->events, i)); i++)
        add_note(run, "events: %s", note);
    for (int i = 0; (note = shef_recorded_frames_note(run->frames, i)); i++)
        add_note(run, "frames: %s", note);
    if (counts->n_unpaired > 0)
        add_note(run,
                 "%u frames have no snapshot: their trigger or the events around it are missing",
                 counts->n_unpaired);
    if (counts->n_damaged > 0)
        add_note(run, "%u frames are damaged and were left out", counts->n_damaged);
    if (counts->n_ambiguous > 0)
        add_note(run,
                 "%u frames may belong to the trigger before or after: the triggers come without "
                 "a gap and the beginning of the recording is missing",
                 counts->n_ambiguous);
}

enum shef_err shef_run_all(struct shef_run *run, shef_run_frame_fn *use, void *context,
                           struct shef_error *err)
{
    const struct shef_calibration *calibration = &run->calibration;
    struct shef_pairing_params pairing = shef_pairing_default_params();
    struct shef_moments_params moments = {
        .exposure_us = shef_recorded_frames_info(run->frames, 0)->exposure_us,
        .delay_ns = calibration->frame_delay.ns + calibration->event_delay.ns +
                    run->settings.extra_delay_ns,
        .to_s = 1e9,
        .cutoff_rad_s = 120,
        .read = run->settings.read,
        .n_steps = run->settings.look_ahead,
        .mask_hot = true,
        .width_px = run->width_px,
        .height_px = run->height_px,
    };

    pairing.begins_together = run->clock.starts_whole;
    run->counts.n_frames = shef_recorded_frames_count(run->frames);
    run->use = use;
    run->context = context;
    shef_pairing_init(&run->pairing, &pairing);

    enum shef_err code =
        shef_moments_run(run->events, &moments, use_moment, run, &run->counts.snapshots, err);

    if (code == SHEF_OK)
        code = finish(run, err);
    run->counts.pairing = shef_pairing_stats(&run->pairing);
    note_all(run);
    if (code == SHEF_OK && run->counts.n_processed == 0)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "'%s': none of its %u frames has a snapshot of the events, %" PRIu64
                         " triggers were seen; are the triggers on channel 0?",
                         run->settings.recording, run->counts.n_frames,
                         run->counts.snapshots.n_triggers);
    return code;
}
