/* The threads that bring a recording in, as devices would. */
#include "service/playback_internal.h"

/* Buffers come back without a signal; there are so many that waiting for one is rare. */
#define BUFFER_WAIT_MS 1

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

/* Hands an item on for certain: nothing may get lost after the last one. */
static void push_end(struct shef_playback *playback, struct shef_link *link, struct shef_wake *own,
                     const void *item)
{
    shef_pace_begun(&playback->pace);
    while (shef_link_push(link, item) != SHEF_OK) {
        if (shef_pace_is_stopping(&playback->pace)) {
            shef_pace_done(&playback->pace);
            return;
        }
        shef_wake_wait(own, BUFFER_WAIT_MS);
    }
}

/* ---- events ----------------------------------------------------------------------------- */

/* The next buffer of the recording; goes on with the next pass if it is looped. */
static enum shef_err next_buffer(struct shef_playback *playback, struct shef_wake *own,
                                 struct shef_event_item *item, struct shef_error *err)
{
    enum shef_err code;

    item->begins_pass = false;
    for (;;) {
        code = shef_replay_take(playback->source->events, &item->raw, err);
        if (code == SHEF_OK || shef_pace_is_stopping(&playback->pace))
            return code;
        if (code == SHEF_ERR_FULL) {
            shef_wake_wait(own, BUFFER_WAIT_MS);
        } else if (code == SHEF_ERR_EMPTY && playback->config.source.loop) {
            shef_replay_rewind(playback->source->events);
            item->pass++;
            item->begins_pass = true;
        } else {
            return code;
        }
    }
}

static void hand_on_events(struct shef_playback *playback, struct shef_event_item *item)
{
    struct shef_counters *counters = &playback->counters;

    shef_count(&counters->n_buffers, 1);
    shef_count(&counters->n_buffers_missing, item->raw.n_lost_before);
    shef_recorder_offer_events(playback->recorder, &item->raw);
    shef_pace_begun(&playback->pace);
    if (shef_link_push(playback->to_filter, item) == SHEF_OK)
        return;
    shef_pace_done(&playback->pace);
    shef_count(&counters->n_buffers_lost, 1);
    shef_buffer_give(item->raw.buffer);
}

void shef_events_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *own = shef_graph_wake(playback->graph, "events");
    struct shef_event_item item = { .pass = 0 };
    struct shef_error err;
    bool begins_pass = true;
    enum shef_err code;

    while ((code = next_buffer(playback, own, &item, &err)) == SHEF_OK) {
        const struct shift shift = shift_of(playback, item.pass);
        const shef_host_time recorded = shef_host_time_add(item.raw.arrived, shift.recorded_ns);

        if (!shef_pace_wait(&playback->pace, SHEF_PACE_EVENTS, recorded)) {
            shef_buffer_give(item.raw.buffer);
            return;
        }
        item.begins_pass = item.begins_pass || begins_pass;
        begins_pass = false;
        item.time_shift_us = shift.recorded_ns / SHEF_NS_PER_US;
        item.raw.arrived = shef_host_time_add(item.raw.arrived, shift.live_ns);
        if (shef_pace_is_live(&playback->pace))
            shef_latency_add(
                &playback->counters.events_late,
                shef_host_time_since(shef_clock_now(playback->pace.clock), item.raw.arrived));
        hand_on_events(playback, &item);
        shef_pace_went(&playback->pace, SHEF_PACE_EVENTS);
    }
    if (shef_pace_is_stopping(&playback->pace))
        return;
    if (code != SHEF_ERR_EMPTY)
        shef_playback_fail(playback, &err);
    push_end(playback, playback->to_filter, own, &(struct shef_event_item){ .pass = item.pass });
    shef_pace_ended(&playback->pace, SHEF_PACE_EVENTS);
}

/* ---- frames ----------------------------------------------------------------------------- */

/* Takes a free buffer when the frame's turn has come. With others under way at fast pace one may
 * still come back; otherwise the frame is lost, as a camera would lose it. */
static struct shef_buffer *take_late(struct shef_playback *playback, struct shef_wake *own)
{
    struct shef_buffer *buffer = shef_pool_take(playback->source->frame_pool);

    while (!buffer && playback->pace.kind == SHEF_PACE_FAST &&
           shef_pace_under_way(&playback->pace) > 0 && !shef_pace_is_stopping(&playback->pace)) {
        shef_wake_wait(own, BUFFER_WAIT_MS);
        buffer = shef_pool_take(playback->source->frame_pool);
    }
    return buffer;
}

static enum shef_err read_frame(struct shef_playback *playback, uint32_t index,
                                struct shef_buffer *buffer, struct shef_frame_item *item,
                                struct shef_error *err)
{
    struct shef_recorded_frame frame;
    const enum shef_err code =
        shef_recorded_frames_read_into(playback->source->frames, index, buffer->data, &frame, err);

    if (code != SHEF_OK)
        return code;
    buffer->used_bytes = shef_frame_bytes(&frame.info);
    item->frame.buffer = buffer;
    item->frame.info = frame.info;
    return SHEF_OK;
}

static void hand_on_frame(struct shef_playback *playback, struct shef_frame_item *item)
{
    struct shef_counters *counters = &playback->counters;

    shef_recorder_offer_frame(playback->recorder, &item->frame);
    shef_pace_begun(&playback->pace);
    if (shef_link_push(playback->frames_to_stereo, item) == SHEF_OK)
        return;
    shef_pace_done(&playback->pace);
    shef_count(&counters->n_frames_unread, 1);
    shef_buffer_give(item->frame.buffer);
}

/* One frame of the recording. False: the service stops, or reading failed. */
static bool play_frame(struct shef_playback *playback, struct shef_wake *own, uint32_t pass,
                       uint32_t index, uint64_t number)
{
    struct shef_source *source = playback->source;
    struct shef_counters *counters = &playback->counters;
    const struct shift shift = shift_of(playback, pass);
    struct shef_frame_item item = { .pass = pass, .frame = { .number = number } };
    const shef_host_time arrived = shef_recorded_frames_info(source->frames, index)->arrived;
    struct shef_buffer *buffer = shef_pool_take(source->frame_pool);
    struct shef_error err;
    enum shef_err code = SHEF_OK;

    if (buffer)
        code = read_frame(playback, index, buffer, &item, &err);

    bool goes_on = shef_pace_wait(&playback->pace, SHEF_PACE_FRAMES,
                                  shef_host_time_add(arrived, shift.recorded_ns));

    if (goes_on && !buffer) {
        buffer = take_late(playback, own);
        if (buffer)
            code = read_frame(playback, index, buffer, &item, &err);
    }
    if (goes_on && code != SHEF_ERR_FORMAT)
        shef_count(&counters->n_frames_in, 1);
    if (goes_on && !buffer) {
        shef_count(&counters->n_frames_unread, 1);
    } else if (goes_on && code == SHEF_OK) {
        item.frame.info.arrived = shef_host_time_add(arrived, shift.live_ns);
        item.frame.info.number += (uint64_t)pass * source->numbers_per_pass;
        if (shef_pace_is_live(&playback->pace)) {
            item.complete = item.frame.info.arrived;
            shef_latency_add(
                &counters->frames_late,
                shef_host_time_since(shef_clock_now(playback->pace.clock), item.complete));
        }
        hand_on_frame(playback, &item);
    } else {
        if (buffer)
            shef_buffer_give(buffer);
        if (goes_on && code == SHEF_ERR_FORMAT)
            shef_count(&counters->n_frames_missing, 1);
        else if (goes_on)
            shef_playback_fail(playback, &err);
        goes_on = goes_on && code == SHEF_ERR_FORMAT;
    }
    shef_pace_went(&playback->pace, SHEF_PACE_FRAMES);
    return goes_on;
}

void shef_frames_thread(void *context)
{
    struct shef_playback *playback = context;
    struct shef_wake *own = shef_graph_wake(playback->graph, "frames");
    uint64_t number = 0;
    uint32_t pass = 0;
    bool goes_on = true;

    do {
        for (uint32_t i = 0; i < playback->source->n_frames && goes_on; i++)
            goes_on = play_frame(playback, own, pass, i, number++);
        pass++;
    } while (goes_on && playback->config.source.loop);
    if (shef_pace_is_stopping(&playback->pace))
        return;
    push_end(playback, playback->frames_to_stereo, own, &(struct shef_frame_item){ .pass = pass });
    shef_pace_ended(&playback->pace, SHEF_PACE_FRAMES);
}

/* ---- poses ------------------------------------------------------------------------------ */

void shef_poses_thread(void *context)
{
    struct shef_playback *playback = context;
    const struct shef_pose_track *track = &playback->source->poses;
    uint32_t pass = 0;

    do {
        const struct shift shift = shift_of(playback, pass);

        for (size_t i = 0; i < track->n; i++) {
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
            shef_pace_begun(&playback->pace);
            /* A full ring costs one of 125 poses a second; the link counts it. */
            if (shef_link_push(playback->poses_to_stereo, &item) != SHEF_OK)
                shef_pace_done(&playback->pace);
            shef_pace_went(&playback->pace, SHEF_PACE_POSES);
        }
        pass++;
    } while (playback->config.source.loop && track->n > 0);
    shef_pace_ended(&playback->pace, SHEF_PACE_POSES);
}
