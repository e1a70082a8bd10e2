/* What the two halves of the recorder share: the threads, and beginning and ending. */
#ifndef SHEF_SERVICE_RECORDER_INTERNAL_H
#define SHEF_SERVICE_RECORDER_INTERNAL_H

#include <stdalign.h>
#include <stdatomic.h>

#include "record/event_recorder.h"
#include "record/frame_recorder.h"
#include "record/pose_recorder.h"
#include "service/counters.h"
#include "service/recorder.h"

enum shef_tap { SHEF_TAP_EVENTS, SHEF_TAP_FRAMES, SHEF_TAP_POSES, SHEF_TAPS };

enum shef_tap_phase {
    SHEF_TAP_OFF,     /* nothing is offered; the parts' recorders are the control thread's */
    SHEF_TAP_ON,      /* the sources offer, the recorder's thread writes */
    SHEF_TAP_CLOSING, /* the recorder's thread writes what waits, then says OFF */
};

struct shef_tap_state {
    /* Set by create. */
    struct shef_link *in;
    struct shef_link *out;
    struct shef_wake *wake;
    /* The control thread opens and closes, the recorder's thread says OFF. */
    _Atomic int phase;
    /* The source's. */
    alignas(64) uint32_t n_lost_since; /* the last one that found room */
    shef_counter n_lost;
    /* The recorder's thread. */
    alignas(64) shef_counter n_bytes;
    struct shef_error failure;
    _Atomic bool has_failed; /* failure is written */
};

struct shef_recorder {
    const struct shef_source *source;
    struct shef_tap_state taps[SHEF_TAPS];
    struct shef_wake closed; /* signalled when a tap says OFF */
    _Atomic bool is_stopping;
    /* The control thread's; the parts' recorders only while their tap is OFF. */
    bool is_on;
    struct shef_recording_writer writer;
    struct shef_event_recorder *events;
    struct shef_frame_recorder *frames;
    struct shef_pose_recorder *poses;
    struct shef_recorder_report last;
};

#endif
