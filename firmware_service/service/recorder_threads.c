/* The sources' side of the recorder, and the threads that write. */
#include <string.h>

#include "service/recorder_internal.h"
#include "service/wiring.h"

static bool is_on(const struct shef_tap_state *tap)
{
    /* Relaxed: a packet more or less; the threads' own loads order what they touch. */
    return atomic_load_explicit(&tap->phase, memory_order_relaxed) == SHEF_TAP_ON;
}

/* Pushes, and counts what finds no room, so that the next one can say how many are missing. */
static bool push(struct shef_tap_state *tap, const void *item)
{
    if (shef_link_push(tap->in, item) == SHEF_OK) {
        tap->n_lost_since = 0;
        return true;
    }
    tap->n_lost_since++;
    shef_count(&tap->n_lost, 1);
    return false;
}

void shef_recorder_offer_events(struct shef_recorder *recorder,
                                const struct shef_raw_packet *packet)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_EVENTS];
    struct shef_raw_packet copy = *packet;

    if (!is_on(tap))
        return;
    copy.n_lost_before += tap->n_lost_since;
    shef_buffer_share(packet->buffer);
    if (!push(tap, &copy))
        shef_buffer_give(packet->buffer);
}

void shef_recorder_offer_frame(struct shef_recorder *recorder,
                               const struct shef_frame_packet *frame)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_FRAMES];
    const struct shef_recorded_frame_item item = { *frame, tap->n_lost_since };

    if (!is_on(tap))
        return;
    shef_buffer_share(frame->buffer);
    if (!push(tap, &item))
        shef_buffer_give(frame->buffer);
}

void shef_recorder_offer_pose(struct shef_recorder *recorder, shef_host_time arrived,
                              const uint8_t *package, uint32_t n_bytes)
{
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_POSES];
    struct shef_pose_package_item item = { .arrived = arrived, .n_bytes = n_bytes };

    if (!is_on(tap) || n_bytes > sizeof item.bytes)
        return;
    item.n_lost_before = tap->n_lost_since;
    memcpy(item.bytes, package, n_bytes);
    (void)push(tap, &item);
}

/* ---- the threads ------------------------------------------------------------------------ */

/* Whether there is something to write to. Acquire: the part's recorder is visible with the phase.
 */
static bool is_writing(const struct shef_tap_state *tap)
{
    return atomic_load_explicit(&tap->phase, memory_order_acquire) != SHEF_TAP_OFF &&
           !atomic_load_explicit(&tap->has_failed, memory_order_relaxed);
}

static void note(struct shef_tap_state *tap, enum shef_err code, uint32_t n_bytes,
                 const struct shef_error *err)
{
    if (code == SHEF_OK) {
        shef_count(&tap->n_bytes, n_bytes);
    } else if (code != SHEF_ERR_INVALID) {
        tap->failure = *err;
        /* Release: the sentence is visible with the flag. */
        atomic_store_explicit(&tap->has_failed, true, memory_order_release);
    }
}

/* After everything that waited: answers the wish to close. Release: what was written to the part's
 * recorder is visible to the control thread. */
static void close_if_wanted(struct shef_recorder *recorder, struct shef_tap_state *tap)
{
    int closing = SHEF_TAP_CLOSING;

    if (atomic_compare_exchange_strong_explicit(&tap->phase, &closing, SHEF_TAP_OFF,
                                                memory_order_acq_rel, memory_order_relaxed))
        shef_wake_signal(&recorder->closed);
}

static bool is_stopping(const struct shef_recorder *recorder)
{
    return atomic_load_explicit(&recorder->is_stopping, memory_order_relaxed);
}

void shef_recorder_events_thread(void *context)
{
    struct shef_recorder *recorder = context;
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_EVENTS];
    struct shef_raw_packet packet;
    struct shef_error err;

    while (!is_stopping(recorder)) {
        shef_wake_wait(tap->wake, -1);
        while (shef_link_pop(tap->out, &packet) == SHEF_OK) {
            const struct shef_buffer *buffer = packet.buffer;

            if (is_writing(tap))
                note(tap,
                     shef_event_recorder_write(recorder->events, buffer->data, buffer->used_bytes,
                                               packet.arrived, packet.n_lost_before, &err),
                     buffer->used_bytes, &err);
            shef_buffer_give(packet.buffer);
        }
        close_if_wanted(recorder, tap);
    }
}

void shef_recorder_frames_thread(void *context)
{
    struct shef_recorder *recorder = context;
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_FRAMES];
    struct shef_recorded_frame_item item;
    struct shef_error err;

    while (!is_stopping(recorder)) {
        shef_wake_wait(tap->wake, -1);
        while (shef_link_pop(tap->out, &item) == SHEF_OK) {
            const struct shef_buffer *buffer = item.frame.buffer;

            if (is_writing(tap))
                note(tap,
                     shef_frame_recorder_write(recorder->frames, &item.frame.info, buffer->data,
                                               item.frame.n_lost_before + item.n_lost_before, &err),
                     buffer->used_bytes, &err);
            shef_buffer_give(item.frame.buffer);
        }
        close_if_wanted(recorder, tap);
    }
}

void shef_recorder_poses_thread(void *context)
{
    struct shef_recorder *recorder = context;
    struct shef_tap_state *tap = &recorder->taps[SHEF_TAP_POSES];
    struct shef_pose_package_item item;
    struct shef_error err;

    while (!is_stopping(recorder)) {
        shef_wake_wait(tap->wake, -1);
        while (shef_link_pop(tap->out, &item) == SHEF_OK)
            if (is_writing(tap) && recorder->poses)
                note(tap,
                     shef_pose_recorder_write(recorder->poses, item.bytes, item.n_bytes,
                                              item.arrived, item.n_lost_before, &err),
                     item.n_bytes, &err);
        close_if_wanted(recorder, tap);
    }
}
