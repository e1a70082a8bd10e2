/* The threads that bring a recording in, as devices would. */
#include <assert.h>
#include <string.h>

#include "service/playback_internal.h"
#include "service/push.h"

/* Buffers come back without a signal; there are so many that waiting for one is rare. */
#define BUFFER_WAIT_MS 1

/* As often as a sensor without events tells the time. */
#define TAIL_STEP_NS (2 * SHEF_NS_PER_MS)

static_assert(SHEF_EVT_STATE_BYTES == SHEF_BLOCK_STATE_BYTES, "blocks keep the decoder's state");

/* What to add to a recorded arrival time. */
struct shift {
    int64_t recorded_ns; /* to stay on the recording's clock: the passes that are over */
    int64_t live_ns;     /* to get to the service's clock */
};

static struct shift shift_of(const struct shef_playback *playback, uint32_t pass)
{
    const int64_t recorded_ns = pass * playback->source->pass_ns;

    return (struct shift){ recorded_ns, recorded_ns + playback->pace.host_shift_ns };
}

/* Whether there is any use in the next item. */
static bool goes_on(const struct shef_playback *playback)
{
    return !shef_pace_is_stopping(&playback->pace) && !shef_playback_is_failing(playback);
}

/* ---- events ----------------------------------------------------------------------------- */

/* The clock of a sensor goes on when there is nothing to see. So that the last frames of a pass
 * need not wait for the next one, it does so here for a while. False: the service stops. */
static bool end_pass(struct shef_playback *playback, struct shef_wake *own, uint32_t pass)
{
    const struct shef_source *source = playback->source;
    const struct shift shift = shift_of(playback, pass);
    struct shef_event_item item = {
        .pass = pass,
        .follows = true,
        .time_shift_us = shift.recorded_ns / SHEF_NS_PER_US,
    };

    for (int64_t ns = TAIL_STEP_NS; ns <= source->tail_ns; ns += TAIL_STEP_NS) {
        const shef_host_time recorded = shef_host_time_add(source->clock.last_arrived, ns);

        item.raw.arrived = shef_host_time_add(recorded, shift.live_ns);
        item.reached_us = (source->clock.last_event.ns + ns) / SHEF_NS_PER_US;
        if (!shef_pace_wait(&playback->pace, SHEF_PACE_EVENTS,
                            shef_host_time_add(recorded, shift.recorded_ns)))
            return false;
        /* A full ring costs a little time, no data; the link counts it. */
        (void)shef_push_in_time(playback->to_filter, &item, &playback->pace, own);
        shef_pace_went(&playback->pace, SHEF_PACE_EVENTS);
    }
    return true;
}

/* The next buffer of the recording; goes on with the next pass if it is looped.
 * SHEF_ERR_EMPTY: that was all, or all that is of use. */
static enum shef_err next_buffer(struct shef_playback *playback, struct shef_wake *own,
                                 struct shef_event_item *item, struct shef_error *err)
{
    bool begins_pass = false;

    while (goes_on(playback)) {
        const enum shef_err code = shef_replay_take(playback->source->events, &item->raw, err);

        if (code == SHEF_ERR_FULL) {
            shef_wake_wait(own, BUFFER_WAIT_MS);
        } else if (code == SHEF_ERR_EMPTY && playback->config.source.loop && !begins_pass) {
            if (!end_pass(playback, own, item->pass))
                break;
            shef_replay_rewind(playback->source->events);
            item->pass++;
            begins_pass = true;
        } else {
            return code;
        }
    }
    return SHEF_ERR_EMPTY;
}

/* Returns whether the filter got it. */
static bool hand_on_events(struct shef_playback *playback, struct shef_wake *own,
                           struct shef_event_item *item)
{
    struct shef_counters *counters = &playback->counters;

    shef_count(&counters->n_buffers, 1);
    shef_count(&counters->n_buffers_missing, item->raw.n_lost_before);
    if (shef_push_in_time(playback->to_filter, item, &playback->pace, own))
        return true;
    shef_count(&counters->n_buffers_lost, 1);
    shef_buffer_give(item->raw.buffer);
    return false;
}

/* What decoding has to know. */
static void set_state(const struct shef_playback *playback, struct shef_event_item *item)
{
    const uint8_t *state = shef_replay_state(playback->source->events, &item->follows);

    memcpy(item->state, state, sizeof item->state);
}

void shef_events_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *own = shef_graph_wake(playback->graph, "events");
    struct shef_event_item item = { .pass = 0 };
    struct shef_error err;
    bool is_lost = false; /* the buffer before */
    enum shef_err code;

    while ((code = next_buffer(playback, own, &item, &err)) == SHEF_OK) {
        const struct shift shift = shift_of(playback, item.pass);
        const shef_host_time recorded = shef_host_time_add(item.raw.arrived, shift.recorded_ns);

        if (!shef_pace_wait(&playback->pace, SHEF_PACE_EVENTS, recorded)) {
            shef_buffer_give(item.raw.buffer);
            return;
        }
        set_state(playback, &item);
        item.time_shift_us = shift.recorded_ns / SHEF_NS_PER_US;
        item.raw.arrived = shef_host_time_add(item.raw.arrived, shift.live_ns);
        if (shef_pace_is_live(&playback->pace))
            shef_latency_add(
                &playback->counters.events_late,
                shef_host_time_since(shef_clock_now(playback->pace.clock), item.raw.arrived));
        shef_recorder_offer_events(playback->recorder, &item);
        item.follows = item.follows && !is_lost;
        is_lost = !hand_on_events(playback, own, &item);
        shef_pace_went(&playback->pace, SHEF_PACE_EVENTS);
    }
    if (shef_pace_is_stopping(&playback->pace))
        return;
    if (code != SHEF_ERR_EMPTY)
        shef_playback_fail(playback, &err);
    item = (struct shef_event_item){ .pass = item.pass, .has_ended = true };
    (void)shef_push_surely(playback->to_filter, &item, &playback->pace, own);
    shef_pace_ended(&playback->pace, SHEF_PACE_EVENTS);
}

/* ---- frames ----------------------------------------------------------------------------- */

/* Whether a buffer will come back without another frame: from what is under way at fast pace; from
 * the recorder when stepped, for the stereo thread holds SHEF_SOURCE_FRAMES_HELD at most. */
static bool may_wait_for_buffer(const struct shef_playback *playback)
{
    return playback->pace.kind == SHEF_PACE_STEPPED ||
           (playback->pace.kind == SHEF_PACE_FAST && shef_pace_under_way(&playback->pace) > 0);
}

/* Takes a free buffer when the frame's turn has come. If there is none and none will come back, the
 * frame is lost, as a camera would lose it. */
static struct shef_buffer *take_late(struct shef_playback *playback, struct shef_wake *own)
{
    struct shef_buffer *buffer = shef_pool_take(playback->source->frame_pool);

    while (!buffer && may_wait_for_buffer(playback) && !shef_pace_is_stopping(&playback->pace)) {
        shef_wake_wait(own, BUFFER_WAIT_MS);
        buffer = shef_pool_take(playback->source->frame_pool);
    }
    return buffer;
}

/* Into the item's buffer. */
static enum shef_err read_frame(struct shef_playback *playback, uint32_t index,
                                struct shef_frame_item *item, struct shef_error *err)
{
    struct shef_recorded_frame frame;
    const enum shef_err code = shef_recorded_frames_read_into(
        playback->source->frames, index, item->frame.buffer->data, &frame, err);

    if (code != SHEF_OK)
        return code;
    item->frame.buffer->used_bytes = shef_frame_bytes(&frame.info);
    item->frame.info = frame.info;
    return SHEF_OK;
}

/* Puts the frame into the present pass and by the service's clock. */
static void stamp_frame(struct shef_playback *playback, const struct shift *shift,
                        struct shef_frame_item *item)
{
    struct shef_frame_info *info = &item->frame.info;

    info->arrived = shef_host_time_add(info->arrived, shift->live_ns);
    info->time.ns += shift->recorded_ns;
    info->number += (uint64_t)item->pass * playback->source->numbers_per_pass;
    if (!shef_pace_is_live(&playback->pace))
        return;
    item->complete = info->arrived;
    shef_latency_add(&playback->counters.frames_late,
                     shef_host_time_since(shef_clock_now(playback->pace.clock), item->complete));
}

static void hand_on_frame(struct shef_playback *playback, struct shef_wake *own,
                          struct shef_frame_item *item)
{
    shef_recorder_offer_frame(playback->recorder, &item->frame);
    if (shef_push_in_time(playback->frames_to_stereo, item, &playback->pace, own))
        return;
    shef_count(&playback->counters.n_frames_unread, 1);
    shef_buffer_give(item->frame.buffer);
}

/* One frame of the recording. False: the service stops, or reading failed. */
static bool play_frame(struct shef_playback *playback, struct shef_wake *own, uint32_t pass,
                       uint32_t index, uint64_t number)
{
    struct shef_source *source = playback->source;
    struct shef_counters *counters = &playback->counters;
    const struct shift shift = shift_of(playback, pass);
    const shef_host_time arrived = shef_recorded_frames_info(source->frames, index)->arrived;
    struct shef_frame_item item = { .pass = pass, .frame = { .number = number } };
    struct shef_buffer *buffer = shef_pool_take(source->frame_pool);
    enum shef_err code = SHEF_OK;
    struct shef_error err;

    item.frame.buffer = buffer;
    if (buffer)
        code = read_frame(playback, index, &item, &err);
    if (!shef_pace_wait(&playback->pace, SHEF_PACE_FRAMES,
                        shef_host_time_add(arrived, shift.recorded_ns))) {
        if (buffer)
            shef_buffer_give(buffer);
        return false;
    }
    if (!buffer) {
        buffer = take_late(playback, own);
        item.frame.buffer = buffer;
        if (buffer)
            code = read_frame(playback, index, &item, &err);
    }
    shef_count(code == SHEF_OK ? &counters->n_frames_in : &counters->n_frames_missing, 1);
    if (!buffer) {
        shef_count(&counters->n_frames_unread, 1);
    } else if (code == SHEF_OK) {
        stamp_frame(playback, &shift, &item);
        hand_on_frame(playback, own, &item);
    } else {
        shef_buffer_give(buffer);
        if (code != SHEF_ERR_FORMAT)
            shef_playback_fail(playback, &err);
    }
    shef_pace_went(&playback->pace, SHEF_PACE_FRAMES);
    return code == SHEF_OK || code == SHEF_ERR_FORMAT;
}

/* Nothing but a recorder wants the sync edges, so no thread wakes for them: they go with the next
 * frame, by arrival.
 *   next   the first that has not gone
 *   until  the frame's arrival, by the recording */
static void hand_on_edges(struct shef_playback *playback, uint32_t pass, size_t *next,
                          shef_host_time until)
{
    const struct shef_edge_track *track = &playback->source->edges;
    const struct shift shift = shift_of(playback, pass);

    for (; *next < track->n && !shef_host_time_before(until, track->edges[*next].time); ++*next) {
        struct shef_edge edge = track->edges[*next];

        edge.time = shef_host_time_add(edge.time, shift.live_ns);
        edge.number += pass * playback->source->edges_per_pass;
        shef_recorder_offer_edge(playback->recorder, &edge);
    }
}

/* Returns whether it was played to its end. */
static bool play_pass(struct shef_playback *playback, struct shef_wake *own, uint32_t pass,
                      uint64_t *number)
{
    const struct shef_source *source = playback->source;
    size_t next_edge = 0;

    for (uint32_t i = 0; i < source->n_frames; i++) {
        const shef_host_time arrived = shef_recorded_frames_info(source->frames, i)->arrived;

        if (!goes_on(playback) || !play_frame(playback, own, pass, i, (*number)++))
            return false;
        hand_on_edges(playback, pass, &next_edge, arrived);
    }
    hand_on_edges(playback, pass, &next_edge, (shef_host_time){ INT64_MAX });
    return true;
}

void shef_frames_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *own = shef_graph_wake(playback->graph, "frames");
    uint64_t number = 0;
    uint32_t pass = 0;
    bool may_go_on = true;

    do {
        may_go_on = play_pass(playback, own, pass, &number);
        pass++;
    } while (may_go_on && playback->config.source.loop);
    if (shef_pace_is_stopping(&playback->pace))
        return;
    (void)shef_push_surely(playback->frames_to_stereo, &(struct shef_frame_item){ .pass = pass },
                           &playback->pace, own);
    shef_pace_ended(&playback->pace, SHEF_PACE_FRAMES);
}

/* ---- poses ------------------------------------------------------------------------------ */

void shef_poses_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *own = shef_graph_wake(playback->graph, "poses");
    const struct shef_pose_track *track = &playback->source->poses;
    uint32_t pass = 0;

    do {
        const struct shift shift = shift_of(playback, pass);

        for (size_t i = 0; i < track->n && goes_on(playback); i++) {
            struct shef_pose_item item = { .pose = track->poses[i] };

            if (!shef_pace_wait(&playback->pace, SHEF_PACE_POSES,
                                shef_host_time_add(item.pose.arrived, shift.recorded_ns)))
                return;
            item.pose.at = shef_host_time_add(item.pose.at, shift.live_ns);
            item.pose.arrived = shef_host_time_add(item.pose.arrived, shift.live_ns);
            shef_count(&playback->counters.n_poses, 1);
            shef_recorder_offer_pose(playback->recorder, item.pose.arrived,
                                     track->packages + i * track->recipe.package_bytes,
                                     track->recipe.package_bytes);
            /* A full ring costs one of 125 poses a second; the link counts it. */
            (void)shef_push_in_time(playback->poses_to_stereo, &item, &playback->pace, own);
            shef_pace_went(&playback->pace, SHEF_PACE_POSES);
        }
        pass++;
    } while (playback->config.source.loop && track->n > 0 && goes_on(playback));
    shef_pace_ended(&playback->pace, SHEF_PACE_POSES);
}
