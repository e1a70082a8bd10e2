/* The sources' side of the recorder, and the threads that write. */
#include <string.h>

#include "service/recorder_internal.h"

/* Buffers that the live stream keeps for itself: with fewer free ones, the recorder copies. */
#define LIVE_EVENT_BUFFERS 32
#define LIVE_FRAME_BUFFERS 6

#define ROOM_WAIT_MS 1

/* ---- the sources ------------------------------------------------------------------------ */

/* Whether a recording runs; notices a new one. */
static bool is_on(struct shef_tap_state *tap)
{
    uint32_t recording;

    /* Acquire: which recording it is. */
    if (atomic_load_explicit(&tap->phase, memory_order_acquire) != SHEF_TAP_ON)
        return false;
    recording = atomic_load_explicit(&tap->recording, memory_order_relaxed);
    if (recording != tap->seen_recording) {
        tap->seen_recording = recording;
        tap->must_restart = true;
        shef_counter_set(&tap->n_lost_since, 0);
    }
    return true;
}

static uint32_t lost_since(const struct shef_tap_state *tap)
{
    return (uint32_t)shef_counter_get(&tap->n_lost_since);
}

static void lose(struct shef_tap_state *tap)
{
    shef_count(&tap->n_lost, 1);
    shef_count(&tap->n_lost_since, 1);
}

/* Where no clock counts, nothing gets lost: whether to try again, after a while. Room comes back
 * without a signal. */
static bool waits_for_room(const struct shef_recorder *recorder, const struct shef_tap_state *tap)
{
    if (shef_pace_is_live(recorder->pace) || shef_pace_is_stopping(recorder->pace) ||
        atomic_load_explicit(&tap->phase, memory_order_relaxed) != SHEF_TAP_ON)
        return false;
    shef_wake_wait(tap->source_wake, ROOM_WAIT_MS);
    return true;
}

/* Pushes, and counts what finds no room, so that the next one can say how many are missing. */
static bool push(const struct shef_recorder *recorder, struct shef_tap_state *tap, const void *item)
{
    while (shef_link_push(tap->in, item) != SHEF_OK)
        if (!waits_for_room(recorder, tap)) {
            lose(tap);
            return false;
        }
    shef_counter_set(&tap->n_lost_since, 0);
    return true;
}

/* A buffer with the same bytes for the recorder: the same one, or a copy where the live stream
 * would run short of them. NULL: there is no room. */
static struct shef_buffer *share_or_copy(struct shef_tap_state *tap, struct shef_buffer *buffer,
                                         uint32_t n_live)
{
    struct shef_buffer *copy;

    if (shef_pool_free_count(buffer->pool) >= n_live) {
        shef_buffer_share(buffer);
        return buffer;
    }
    copy = shef_pool_take(tap->spare);
    if (copy) {
        memcpy(copy->data, buffer->data, buffer->used_bytes);
        copy->used_bytes = buffer->used_bytes;
    }
    return copy;
}

/* The same with an item that needs a buffer.
 *   buffer  in the item; replaced
 *   n_live  so many must stay free for the live stream */
static bool push_with_buffer(const struct shef_recorder *recorder, struct shef_tap_state *tap,
                             const void *item, struct shef_buffer **buffer, uint32_t n_live)
{
    struct shef_buffer *own = share_or_copy(tap, *buffer, n_live);

    while (!own && waits_for_room(recorder, tap))
        own = share_or_copy(tap, *buffer, n_live);
    if (!own) {
        lose(tap);
        return false;
    }
    *buffer = own;
    if (push(recorder, tap, item))
        return true;
    shef_buffer_give(own);
    return false;
}

void shef_recorder_offer_events(struct shef_recorder *recorder, const struct shef_event_item *item)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_EVENTS];
    struct shef_recorded_event_item copy = { .item = *item };

    if (!is_on(tap))
        return;
    copy.recording = tap->seen_recording;
    /* What was lost before the recording began is none of its losses. */
    if (tap->must_restart && lost_since(tap) == 0)
        copy.item.raw.n_lost_before = 0;
    tap->must_restart = tap->must_restart || !item->follows;
    copy.item.follows = !tap->must_restart;
    copy.item.raw.n_lost_before += lost_since(tap);
    if (push_with_buffer(recorder, tap, &copy, &copy.item.raw.buffer, LIVE_EVENT_BUFFERS))
        tap->must_restart = false;
}

void shef_recorder_offer_frame(struct shef_recorder *recorder,
                               const struct shef_frame_packet *frame)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_FRAMES];
    struct shef_recorded_frame_item item = { .frame = *frame };

    if (!is_on(tap))
        return;
    item.recording = tap->seen_recording;
    item.n_lost_before = lost_since(tap);
    (void)push_with_buffer(recorder, tap, &item, &item.frame.buffer, LIVE_FRAME_BUFFERS);
}

void shef_recorder_offer_pose(struct shef_recorder *recorder, shef_host_time arrived,
                              const uint8_t *package, uint32_t n_bytes)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_POSES];
    struct shef_recorded_pose_item item = { .arrived = arrived, .n_bytes = n_bytes };

    if (!is_on(tap))
        return;
    if (n_bytes > sizeof item.bytes) {
        lose(tap);
        return;
    }
    item.recording = tap->seen_recording;
    item.n_lost_before = lost_since(tap);
    memcpy(item.bytes, package, n_bytes);
    (void)push(recorder, tap, &item);
}

void shef_recorder_offer_edge(struct shef_recorder *recorder, const struct shef_edge *edge)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_TRIGGERS];
    struct shef_recorded_edge_item item = { .edge = *edge };

    if (!is_on(tap))
        return;
    item.recording = tap->seen_recording;
    item.n_lost_before = lost_since(tap);
    (void)push(recorder, tap, &item);
}

/* ---- the threads ------------------------------------------------------------------------ */

/* Whether an item is to be written. One that can no longer be is counted. */
static bool is_wanted(struct shef_tap_state *tap, uint32_t recording)
{
    /* Acquire: the part's recorder is visible with the phase. */
    const bool is_open = atomic_load_explicit(&tap->phase, memory_order_acquire) != SHEF_TAP_OFF &&
                         atomic_load_explicit(&tap->recording, memory_order_relaxed) == recording;

    if (!is_open)
        return false;
    if (atomic_load_explicit(&tap->has_failed, memory_order_relaxed)) {
        shef_count(&tap->n_unwritten, 1);
        return false;
    }
    return true;
}

static void fail(struct shef_tap_state *tap, const struct shef_error *err)
{
    if (atomic_load_explicit(&tap->has_failed, memory_order_relaxed))
        return;
    tap->failure = *err;
    /* Release: the sentence is visible with the flag. */
    atomic_store_explicit(&tap->has_failed, true, memory_order_release);
}

static void note(struct shef_tap_state *tap, enum shef_err code, uint32_t n_bytes,
                 const struct shef_error *err)
{
    if (code == SHEF_OK)
        shef_count(&tap->n_bytes, n_bytes);
    else
        shef_count(&tap->n_unwritten, 1);
    /* INVALID: an item that is none of its part's; the next one may be. */
    if (code != SHEF_OK && code != SHEF_ERR_INVALID)
        fail(tap, err);
}

/* After everything that waited: answers the wish to close. The disk is waited for here, not on the
 * control thread. */
static void close_if_wanted(struct shef_recorder *recorder, enum shef_tap which)
{
    struct shef_tap_state *tap = &recorder->taps[which];
    struct shef_error err;

    if (atomic_load_explicit(&tap->phase, memory_order_acquire) != SHEF_TAP_CLOSING)
        return;
    if (shef_recorder_stop_part(recorder, which, &err) != SHEF_OK)
        fail(tap, &err);
    /* Release: what was written to the part's recorder is visible to the control thread. */
    atomic_store_explicit(&tap->phase, SHEF_TAP_OFF, memory_order_release);
    shef_wake_signal(&recorder->closed);
}

static void write_events(struct shef_recorder *recorder, struct shef_tap_state *tap)
{
    struct shef_recorded_event_item taken;
    struct shef_error err;

    while (shef_link_pop(tap->out, &taken) == SHEF_OK) {
        const struct shef_event_item *item = &taken.item;
        const struct shef_buffer *buffer = item->raw.buffer;

        if (is_wanted(tap, taken.recording)) {
            enum shef_err code = SHEF_OK;

            if (!item->follows)
                code = shef_event_recorder_restart(recorder->events, item->state,
                                                   item->time_shift_us, &err);
            if (code == SHEF_OK)
                code = shef_event_recorder_write(recorder->events, buffer->data, buffer->used_bytes,
                                                 item->raw.arrived, item->raw.n_lost_before, &err);
            note(tap, code, buffer->used_bytes, &err);
        }
        shef_buffer_give(item->raw.buffer);
    }
}

static void write_frames(struct shef_recorder *recorder, struct shef_tap_state *tap)
{
    struct shef_recorded_frame_item item;
    struct shef_error err;

    while (shef_link_pop(tap->out, &item) == SHEF_OK) {
        const struct shef_buffer *buffer = item.frame.buffer;

        if (is_wanted(tap, item.recording))
            note(tap,
                 shef_frame_recorder_write(recorder->frames, &item.frame.info, buffer->data,
                                           item.frame.n_lost_before + item.n_lost_before, &err),
                 buffer->used_bytes, &err);
        shef_buffer_give(item.frame.buffer);
    }
}

static void write_poses(struct shef_recorder *recorder, struct shef_tap_state *tap)
{
    struct shef_recorded_pose_item item;
    struct shef_error err;

    while (shef_link_pop(tap->out, &item) == SHEF_OK)
        if (is_wanted(tap, item.recording))
            note(tap,
                 shef_pose_recorder_write(recorder->poses, item.bytes, item.n_bytes, item.arrived,
                                          item.n_lost_before, &err),
                 item.n_bytes, &err);
}

static void write_edges(struct shef_recorder *recorder, struct shef_tap_state *tap)
{
    struct shef_recorded_edge_item item;
    struct shef_error err;

    while (shef_link_pop(tap->out, &item) == SHEF_OK)
        if (is_wanted(tap, item.recording))
            note(tap,
                 shef_trigger_recorder_write(recorder->triggers, &item.edge, 1, item.edge.time,
                                             item.n_lost_before, &err),
                 SHEF_EDGE_BYTES, &err);
}

void shef_recorder_serve(struct shef_recorder *recorder, enum shef_tap which)
{
    static void (*const write[SHEF_TAPS])(struct shef_recorder *, struct shef_tap_state *) = {
        [SHEF_TAP_EVENTS] = write_events,
        [SHEF_TAP_FRAMES] = write_frames,
        [SHEF_TAP_POSES] = write_poses,
        [SHEF_TAP_TRIGGERS] = write_edges,
    };

    write[which](recorder, &recorder->taps[which]);
    close_if_wanted(recorder, which);
}

static void run(struct shef_recorder *recorder, enum shef_tap which)
{
    bool is_last;

    do {
        shef_wake_wait(recorder->taps[which].wake, -1);
        /* Acquire: with the wish to return comes the one to close. What waits is written first. */
        is_last = atomic_load_explicit(&recorder->is_stopping, memory_order_acquire);
        shef_recorder_serve(recorder, which);
    } while (!is_last);
}

void shef_recorder_events_thread(void *context)
{
    run(context, SHEF_TAP_EVENTS);
}

void shef_recorder_frames_thread(void *context)
{
    run(context, SHEF_TAP_FRAMES);
}

void shef_recorder_poses_thread(void *context)
{
    run(context, SHEF_TAP_POSES);
}

void shef_recorder_triggers_thread(void *context)
{
    run(context, SHEF_TAP_TRIGGERS);
}
