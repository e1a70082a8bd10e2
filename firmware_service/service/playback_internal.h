/* What the threads of a playback share. Only playback*.c and the threads include this. */
#ifndef SHEF_SERVICE_PLAYBACK_INTERNAL_H
#define SHEF_SERVICE_PLAYBACK_INTERNAL_H

#include <stdatomic.h>

#include "service/filter_thread.h"
#include "service/pace.h"
#include "service/playback.h"
#include "service/publish_status.h"
#include "service/recorder.h"
#include "service/stereo_thread.h"
#include "service/wiring.h"

/* The stages that take from a ring, and the sources. */
#define SHEF_PLAYBACK_STEPS (3 + SHEF_PACE_SOURCES)

struct shef_playback {
    /* Set by create, then read-only. */
    struct shef_config config;
    struct shef_live *live;
    struct shef_wake *end_wake;
    struct shef_source *source;
    struct shef_graph *graph;
    struct shef_filter_stage *filter;
    struct shef_stereo_stage *stereo;
    struct shef_workers *workers;
    struct shef_result_pool *results;
    struct shef_publisher *publisher;
    struct shef_recorder *recorder;
    /* The ends of the rings, each of the thread that the table names. */
    struct shef_link *to_filter;
    struct shef_link *frames_to_stereo;
    struct shef_link *poses_to_stereo;
    struct shef_link *results_in;
    /* Shared by all threads. */
    struct shef_pace pace;
    struct shef_counters counters;
    _Atomic int state;                    /* enum shef_playback_state */
    _Atomic bool is_failing;              /* whoever sets it first writes failure */
    _Atomic bool has_failed;              /* failure is written */
    struct shef_error failure;            /* read once state says FAILED */
    _Atomic(struct shef_result *) newest; /* the stereo thread puts, the control thread takes */
    /* The publisher thread's. */
    struct shef_publish_status_before status_before;
    /* The control thread's. */
    uint64_t n_progress;
    uint64_t last_steps[SHEF_PLAYBACK_STEPS];
};

/* Threads of the sources. */
void shef_events_thread(void *context);
void shef_frames_thread(void *context);
void shef_poses_thread(void *context);
void shef_publisher_thread(void *context);

/* Publishes a result and gives it back.            Thread: publisher; setup once it has ended. */
void shef_playback_publish(struct shef_playback *playback, struct shef_result *result);

/* Notes why the source ends before its end; all of them end then. Thread: any. */
void shef_playback_fail(struct shef_playback *playback, const struct shef_error *err);

/* Whether one of them has failed.                                 Thread: any. */
bool shef_playback_is_failing(const struct shef_playback *playback);

#endif
