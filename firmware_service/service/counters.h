/* What the threads of the service count: who writes what, and who may read it.
 *
 * Each group has one writer; anyone reads. Who sees something counted also sees what was counted
 * on its way there: whoever reads how many left before how many came in never finds more of them.
 */
#ifndef SHEF_SERVICE_COUNTERS_H
#define SHEF_SERVICE_COUNTERS_H

#include <stdalign.h>
#include <stdatomic.h>
#include <stdint.h>

#include "core/latency.h"
#include "service/shed.h"

typedef _Atomic uint64_t shef_counter;

/* One writer each: a load and a store suffice. Release: see above; the rings carry it on. */
static inline void shef_count(shef_counter *counter, uint64_t n)
{
    atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + n,
                          memory_order_release);
}

static inline void shef_counter_set(shef_counter *counter, uint64_t value)
{
    atomic_store_explicit(counter, value, memory_order_release);
}

static inline uint64_t shef_counter_get(const shef_counter *counter)
{
    /* Acquire: pairs with the release of whoever counted. */
    return atomic_load_explicit(counter, memory_order_acquire);
}

/* Why a frame that came in was not published. */
enum shef_frame_loss {
    SHEF_LOSS_NO_BUFFER, /* no free buffer, or the ring to the stereo thread was full */
    SHEF_LOSS_DAMAGED,   /* incomplete, or of another size */
    SHEF_LOSS_NO_PAIR,   /* no snapshot belongs to it: its trigger or its events are missing */
    SHEF_LOSS_SHED,      /* it had waited too long */
    SHEF_LOSS_NO_RESULT, /* the publisher is behind */
    SHEF_LOSS_STOPPED,   /* it was under way when the source was stopped */
    SHEF_LOSSES,
};

struct shef_counters {
    /* The thread of the events. */
    alignas(64) shef_counter n_buffers;
    shef_counter n_buffers_lost;     /* the ring was full */
    shef_counter n_buffers_missing;  /* known to have been lost before they came here */
    struct shef_latency events_late; /* behind the recorded pace */
    /* The thread of the frames. */
    alignas(64) shef_counter n_frames_in;
    shef_counter n_frames_missing;
    shef_counter n_frames_unread; /* lost as SHEF_LOSS_NO_BUFFER */
    struct shef_latency frames_late;
    /* The thread of the poses. */
    alignas(64) shef_counter n_poses;
    /* The filter thread. */
    alignas(64) shef_counter n_packets; /* decoded */
    shef_counter n_events;
    shef_counter n_violations;
    shef_counter n_rising;
    shef_counter n_falling;
    shef_counter n_predicted; /* snapshots whose trigger was lost */
    shef_counter n_snapshots;
    shef_counter n_snapshots_lost;
    shef_counter n_hot_pixels;
    shef_counter last_event_us;
    struct shef_latency decoding; /* of one buffer */
    /* The stereo thread. */
    alignas(64) shef_counter n_lost[SHEF_LOSSES]; /* of frames; NO_BUFFER and NO_RESULT not
                                                   * all of them */
    shef_counter n_frames_taken;                  /* out of the ring */
    shef_counter n_finished;                      /* handed to the publisher */
    shef_counter n_unpaired_snapshots;
    shef_counter n_ambiguous;
    shef_counter n_with_velocity;
    shef_counter shed_level;
    struct shef_latency waiting;  /* frame and snapshot were there until work began */
    struct shef_latency pictures; /* rectification and edge maps */
    struct shef_latency flow;
    struct shef_latency matching;
    struct shef_latency converting;
    struct shef_latency stereo; /* all of a frame */
    /* The publisher thread. */
    alignas(64) shef_counter n_results_done;
    shef_counter n_shed[SHEF_SHED_FRAME]; /* of them, published without this piece of work */
    shef_counter n_results_stale; /* of them, left out: frames lost as SHEF_LOSS_NO_RESULT */
};

/* Frames lost for one reason, whoever counted them. Thread: any. */
static inline uint64_t shef_frames_lost(const struct shef_counters *counters,
                                        enum shef_frame_loss why)
{
    const uint64_t n = shef_counter_get(&counters->n_lost[why]);

    switch (why) {
    case SHEF_LOSS_NO_BUFFER:
        return n + shef_counter_get(&counters->n_frames_unread);
    case SHEF_LOSS_NO_RESULT:
        return n + shef_counter_get(&counters->n_results_stale);
    default:
        return n;
    }
}

#endif
