/* What the two halves of the recorder share: the threads, and beginning and ending. */
#ifndef SHEF_SERVICE_RECORDER_INTERNAL_H
#define SHEF_SERVICE_RECORDER_INTERNAL_H

#include <stdalign.h>
#include <stdatomic.h>

#include "record/event_recorder.h"
#include "record/frame_recorder.h"
#include "record/pose_recorder.h"
#include "record/trigger_recorder.h"
#include "service/counters.h"
#include "service/recorder.h"

enum shef_tap { SHEF_TAP_EVENTS, SHEF_TAP_FRAMES, SHEF_TAP_POSES, SHEF_TAP_TRIGGERS, SHEF_TAPS };

enum shef_tap_phase {
    SHEF_TAP_OFF,     /* nothing is offered; the parts' recorders are the control thread's */
    SHEF_TAP_ON,      /* the sources offer, the recorder's thread writes */
    SHEF_TAP_CLOSING, /* the recorder's thread writes what waits, ends the part, then says OFF */
};

struct shef_tap_state {
    /* Set by create. */
    struct shef_link *in;
    struct shef_link *out;
    struct shef_wake *wake;
    struct shef_wake *source_wake;
    /* Made with the first recording, kept until the source ends: the source takes, the recorder's
     * thread gives. NULL: items need no buffers. */
    struct shef_pool *spare;
    /* The control thread opens and closes, the recorder's thread says OFF. */
    _Atomic int phase;
    _Atomic uint32_t recording; /* counted from 1; set before phase says ON */
    /* The source's. */
    alignas(64) uint32_t seen_recording;
    bool must_restart; /* events: the next one does not continue the last one that was taken */
    shef_counter n_lost;
    shef_counter n_lost_since; /* the last one that found room */
    /* The recorder's thread. */
    alignas(64) shef_counter n_bytes;
    shef_counter n_unwritten; /* came, and could not be written */
    struct shef_error failure;
    _Atomic bool has_failed; /* failure is written */
};

struct shef_recorder {
    const struct shef_source *source;
    const struct shef_pace *pace;
    int64_t utc_minus_host_ns;
    struct shef_tap_state taps[SHEF_TAPS];
    struct shef_wake closed; /* signalled when a tap says OFF */
    _Atomic bool is_stopping;
    /* The parts' recorders: their tap's thread's, the control thread's while it is OFF. NULL: there
     * is no such part. */
    struct shef_event_recorder *events;
    struct shef_frame_recorder *frames;
    struct shef_pose_recorder *poses;
    struct shef_trigger_recorder *triggers;
    /* The control thread's, but for what the parts write into the manifest. */
    struct shef_recording_writer writer;
    bool is_on;
    bool is_closing;
    struct shef_error stop; /* why it is ended before anybody has asked for it; "": it is not */
    struct shef_recorder_report last;
};

/* Writes what waits, and ends the part if that is wanted.
 * Thread: the tap's, or any once that has been joined. */
void shef_recorder_serve(struct shef_recorder *recorder, enum shef_tap tap);

/* Ends one part, if it is there.                    Thread: whose the part's recorder is. */
SHEF_MUST_CHECK enum shef_err shef_recorder_stop_part(struct shef_recorder *recorder,
                                                      enum shef_tap tap, struct shef_error *err);

#endif
