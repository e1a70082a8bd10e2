/* What arrives, what waits, and what belongs together. */
#include "service/stereo_thread.h"

#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "service/push.h"
#include "service/stereo_internal.h"

/* While frames wait for snapshots that may never come, their waiting is looked at this often. */
#define LOOK_AGAIN_MS 20

/* Frames in a row that show which trigger is theirs by their delay alone. As many are held here;
 * with 1.5 ms of jitter against a period of 18 ms they suffice. */
#define DECIDE_FRAMES 8

/* Of the present pass. */
static void begin_pairing(struct shef_stereo_stage *stage)
{
    const struct shef_source *source = stage->params.source;
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_pairing_anchor pair = source->first_pair.pair;

    params.begins_together = source->clock.starts_whole;
    params.n_decide = DECIDE_FRAMES;
    shef_pairing_init(&stage->pairing, &params);
    pair.event = shef_event_time_add(pair.event, stage->pass * source->pass_ns);
    pair.camera.ns += stage->pass * source->pass_ns;
    if (source->first_pair.is_known)
        shef_pairing_lock(&stage->pairing, &pair, source->first_pair.is_ambiguous);
}

static void set_calib_id(struct shef_stereo_stage *stage)
{
    const char *hex = stage->params.source->calibration.id;

    for (size_t i = 0; i < SHEF_CALIB_ID_BYTES && strlen(hex) >= 2 * i + 2; i++) {
        const char digits[3] = { hex[2 * i], hex[2 * i + 1], '\0' };

        stage->calib_id[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
}

static enum shef_err create_chain(struct shef_stereo_stage *stage, struct shef_error *err)
{
    const struct shef_config *config = stage->params.config;
    struct shef_depth_params params = shef_depth_default_params();
    enum shef_err code;

    params.profile = config->calibration.profile;
    params.pixels = stage->params.source->pixels;
    params.mode = (enum shef_depth_mode)shef_live_get(&stage->params.live->mode);
    params.modes = SHEF_DEPTH_ALL_MODES;
    params.max_disparity_px = config->depth.max_disparity_px;
    code = shef_depth_chain_create(&stage->chain, &stage->params.source->calibration, &params,
                                   stage->params.workers, shef_cpu_features(), err);
    if (code == SHEF_OK)
        stage->geometry = shef_depth_chain_geometry(stage->chain);
    return code;
}

enum shef_err shef_stereo_stage_create(const struct shef_stereo_stage_params *params,
                                       struct shef_stereo_stage **out_stage, struct shef_error *err)
{
    struct shef_stereo_stage *stage = shef_memory_create(1, sizeof *stage);

    if (!stage)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "stereo: out of memory");
    stage->params = *params;

    const enum shef_err code = create_chain(stage, err);

    if (code != SHEF_OK) {
        shef_stereo_stage_destroy(stage);
        return code;
    }
    stage->frames_in = shef_graph_consumer_end(params->graph, "frames", "stereo");
    stage->snapshots_in = shef_graph_consumer_end(params->graph, "snapshots", "stereo");
    stage->poses_in = shef_graph_consumer_end(params->graph, "poses", "stereo");
    stage->results_out = shef_graph_producer_end(params->graph, "results", "stereo");
    stage->wake = shef_graph_wake(params->graph, "stereo");
    begin_pairing(stage);
    set_calib_id(stage);
    *out_stage = stage;
    return SHEF_OK;
}

void shef_stereo_stage_destroy(struct shef_stereo_stage *stage)
{
    if (!stage)
        return;
    shef_depth_chain_destroy(stage->chain);
    free(stage);
}

void shef_stereo_stage_identity(const struct shef_stereo_stage *stage, int64_t *out_session_id,
                                uint8_t out_calib_id[SHEF_CALIB_ID_BYTES])
{
    *out_session_id = stage->params.session_id;
    memcpy(out_calib_id, stage->calib_id, SHEF_CALIB_ID_BYTES);
}

struct shef_depth_geometry shef_stereo_stage_geometry(const struct shef_stereo_stage *stage)
{
    return stage->geometry;
}

void shef_stereo_stage_set_results(struct shef_stereo_stage *stage,
                                   struct shef_result_pool *results)
{
    stage->results = results;
}

/* ---- what is held ----------------------------------------------------------------------- */

static void lose(struct shef_stereo_stage *stage, struct shef_held_frame *held,
                 enum shef_frame_loss why)
{
    shef_count(&stage->params.counters->n_lost[why], 1);
    shef_buffer_give(held->item.frame.buffer);
    held->is_held = false;
}

/* Lets go of the oldest held snapshots, n of them. */
static void release_snapshots(struct shef_stereo_stage *stage, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        shef_snapshot_pool_give(stage->params.snapshots, stage->snapshots[i].snapshot);
    stage->n_snapshots -= n;
    memmove(stage->snapshots, stage->snapshots + n,
            (size_t)stage->n_snapshots * sizeof stage->snapshots[0]);
}

static const struct shef_snapshot_item *find_snapshot(const struct shef_stereo_stage *stage,
                                                      uint64_t number)
{
    for (int32_t i = 0; i < stage->n_snapshots; i++)
        if (stage->snapshots[i].snapshot->number == number)
            return &stage->snapshots[i];
    return NULL;
}

/* What is older than a snapshot that was used will never be used. */
static void release_before(struct shef_stereo_stage *stage, uint64_t number)
{
    int32_t n = 0;

    while (n < stage->n_snapshots && stage->snapshots[n].snapshot->number <= number)
        n++;
    release_snapshots(stage, n);
}

/* ---- pairing ---------------------------------------------------------------------------- */

static void use_decided(struct shef_stereo_stage *stage, const struct shef_pairing_result *result)
{
    struct shef_held_frame *held = &stage->frames[result->tag];
    const struct shef_snapshot_item *snapshot =
        result->kind == SHEF_PAIRING_PAIR ? find_snapshot(stage, result->snapshot) : NULL;

    if (!snapshot) {
        lose(stage, held, SHEF_LOSS_NO_PAIR);
        return;
    }
    shef_stereo_process(stage, &held->item, snapshot, result);
    shef_buffer_give(held->item.frame.buffer);
    held->is_held = false;
    release_before(stage, result->snapshot);
}

/* Works on the next frame whose snapshot is decided. Returns whether there was one. */
static bool work_on_one(struct shef_stereo_stage *stage)
{
    const struct shef_pace *pace = stage->params.pace;
    const shef_host_time now =
        shef_pace_is_live(pace) ? shef_clock_now(pace->clock) : stage->newest_arrival;
    const bool was_locked = stage->pairing.is_locked;
    struct shef_pairing_result result;

    if (shef_pairing_take(&stage->pairing, now, &result) != SHEF_OK)
        return false;
    if (!was_locked && stage->pairing.is_locked)
        stage->locked_at = now;
    use_decided(stage, &result);
    shef_counter_set(&stage->params.counters->n_unpaired_snapshots,
                     stage->n_skipped_before + shef_pairing_stats(&stage->pairing).n_skipped);
    return true;
}

static void pair_frame(struct shef_stereo_stage *stage, struct shef_held_frame *held)
{
    const struct shef_pairing_frame frame = {
        .tag = (uint64_t)(held - stage->frames),
        .camera = held->item.frame.info.time,
        .has_host = true,
        .arrived = held->item.frame.info.arrived,
    };

    held->is_early = false;
    while (shef_pairing_add_frame(&stage->pairing, &frame) != SHEF_OK)
        if (!work_on_one(stage))
            break;
}

/* The recording starts again: what is left of the pass before is decided, then pairing begins
 * anew, as at the first start. */
static void change_pass(struct shef_stereo_stage *stage, uint32_t pass)
{
    shef_pairing_finish(&stage->pairing);
    while (work_on_one(stage))
        continue;
    stage->n_skipped_before += shef_pairing_stats(&stage->pairing).n_skipped;
    release_snapshots(stage, stage->n_snapshots);
    stage->pass = pass;
    begin_pairing(stage);
    shef_depth_chain_reset(stage->chain);
    for (int32_t i = 0; i < SHEF_STEREO_FRAMES; i++)
        if (stage->frames[i].is_held && stage->frames[i].item.pass == pass)
            pair_frame(stage, &stage->frames[i]);
}

/* ---- what arrives ----------------------------------------------------------------------- */

static void note_arrival(struct shef_stereo_stage *stage, shef_host_time arrived)
{
    if (shef_host_time_before(stage->newest_arrival, arrived))
        stage->newest_arrival = arrived;
}

static void use_pose(struct shef_stereo_stage *stage, const struct shef_pose_item *item)
{
    note_arrival(stage, item->pose.arrived);
    if (stage->n_poses == 2 * SHEF_STEREO_POSES) {
        memcpy(stage->poses, stage->poses + SHEF_STEREO_POSES,
               SHEF_STEREO_POSES * sizeof stage->poses[0]);
        stage->n_poses = SHEF_STEREO_POSES;
    }
    stage->poses[stage->n_poses++] = item->pose;
}

/* Without a trigger nothing can be decided: rather than to run out of buffers, what waits is given
 * up and pairing begins anew with what comes. */
static void give_up_waiting(struct shef_stereo_stage *stage)
{
    shef_pairing_restart(&stage->pairing);
    for (int32_t i = 0; i < SHEF_STEREO_FRAMES; i++)
        if (stage->frames[i].is_held && !stage->frames[i].is_early)
            lose(stage, &stage->frames[i], SHEF_LOSS_NO_PAIR);
}

static bool is_usable(const struct shef_stereo_stage *stage, const struct shef_frame_info *info)
{
    return shef_frame_is_usable(info, shef_recorded_frames_format(stage->params.source->frames));
}

static void use_frame(struct shef_stereo_stage *stage, const struct shef_frame_item *item)
{
    struct shef_held_frame *held = stage->frames;

    if (!item->frame.buffer) {
        stage->frames_ended = true;
        return;
    }
    shef_count(&stage->params.counters->n_frames_taken, 1);
    note_arrival(stage, item->frame.info.arrived);
    /* There is room for as many frames as there are buffers. */
    while (held->is_held)
        held++;
    *held = (struct shef_held_frame){ .is_held = true, .item = *item };
    if (!is_usable(stage, &item->frame.info))
        lose(stage, held, SHEF_LOSS_DAMAGED);
    else if (item->pass < stage->pass)
        lose(stage, held, SHEF_LOSS_NO_PAIR); /* so late that its pass is over */
    else if (item->pass > stage->pass)
        held->is_early = true;
    else
        pair_frame(stage, held);
}

static void use_snapshot(struct shef_stereo_stage *stage, const struct shef_snapshot_item *item)
{
    const struct shef_snapshot *snapshot = item->snapshot;

    if (!snapshot) {
        stage->events_ended = true;
        return;
    }
    note_arrival(stage, item->arrived);
    if (item->pass > stage->pass)
        change_pass(stage, item->pass);
    if (stage->n_snapshots == SHEF_STEREO_SNAPSHOTS)
        release_snapshots(stage, 1);
    stage->snapshots[stage->n_snapshots++] = *item;
    shef_pairing_add_snapshot(&stage->pairing,
                              &(struct shef_pairing_snapshot){
                                  .number = snapshot->number,
                                  .rise = snapshot->rise,
                                  .mid = snapshot->mid,
                                  .t_err_ns = snapshot->t_err_ns,
                                  .has_host = true,
                                  .host = shef_stereo_host(stage, snapshot->rise, item->pass),
                              });
}

/* Takes everything that has arrived. Returns how many items. */
static int32_t take_arrivals(struct shef_stereo_stage *stage)
{
    struct shef_pose_item pose;
    struct shef_snapshot_item snapshot;
    struct shef_frame_item frame;
    int32_t n = 0;

    for (; shef_link_pop(stage->poses_in, &pose) == SHEF_OK; n++)
        use_pose(stage, &pose);
    for (; shef_link_pop(stage->snapshots_in, &snapshot) == SHEF_OK; n++)
        use_snapshot(stage, &snapshot);
    for (; shef_link_pop(stage->frames_in, &frame) == SHEF_OK; n++)
        use_frame(stage, &frame);
    return n;
}

static int32_t waiting_count(const struct shef_stereo_stage *stage)
{
    int32_t n = 0;

    for (int32_t i = 0; i < SHEF_STEREO_FRAMES; i++)
        n += stage->frames[i].is_held;
    return n;
}

/* Both sources have ended: what waits is decided, and the publisher told. */
static void end(struct shef_stereo_stage *stage)
{
    const struct shef_result_item last = { .result = NULL };

    shef_pairing_finish(&stage->pairing);
    while (work_on_one(stage))
        continue;
    release_snapshots(stage, stage->n_snapshots);
    for (int32_t i = 0; i < SHEF_STEREO_FRAMES; i++)
        if (stage->frames[i].is_held)
            lose(stage, &stage->frames[i], SHEF_LOSS_NO_PAIR);
    stage->frames_ended = false;
    stage->events_ended = false;
    (void)shef_push_surely(stage->results_out, &last, stage->params.pace, stage->wake);
}

void shef_stereo_thread(void *context)
{
    struct shef_stereo_stage *stage = context;
    struct shef_pace *pace = stage->params.pace;

    while (!shef_pace_is_stopping(pace)) {
        int32_t n_taken = 0;
        int32_t n_new;
        bool has_worked;

        shef_wake_wait(stage->wake, waiting_count(stage) > 0 ? LOOK_AGAIN_MS : -1);
        do {
            n_new = take_arrivals(stage);
            n_taken += n_new;
            has_worked = work_on_one(stage);
        } while ((n_new > 0 || has_worked) && !shef_pace_is_stopping(pace));
        if (waiting_count(stage) >= SHEF_SOURCE_FRAMES_HELD)
            give_up_waiting(stage);
        if (stage->frames_ended && stage->events_ended)
            end(stage);
        for (; n_taken > 0; n_taken--)
            shef_pace_done(pace);
    }
}

void shef_stereo_stage_empty(struct shef_stereo_stage *stage)
{
    struct shef_snapshot_item snapshot;
    struct shef_frame_item frame;

    while (shef_link_pop(stage->snapshots_in, &snapshot) == SHEF_OK)
        if (snapshot.snapshot)
            shef_snapshot_pool_give(stage->params.snapshots, snapshot.snapshot);
    while (shef_link_pop(stage->frames_in, &frame) == SHEF_OK)
        if (frame.frame.buffer) {
            shef_count(&stage->params.counters->n_lost[SHEF_LOSS_STOPPED], 1);
            shef_buffer_give(frame.frame.buffer);
        }
    for (int32_t i = 0; i < SHEF_STEREO_FRAMES; i++)
        if (stage->frames[i].is_held)
            lose(stage, &stage->frames[i], SHEF_LOSS_STOPPED);
    release_snapshots(stage, stage->n_snapshots);
}
