/* Rates and percentiles over the last second, from counters that only grow. Thread: control. */
#ifndef SHEF_SERVICE_WINDOW_H
#define SHEF_SERVICE_WINDOW_H

#include <stdint.h>

#include "core/latency.h"
#include "core/time.h"
#include "service/playback.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_window_stage {
    SHEF_WINDOW_DECODING,
    SHEF_WINDOW_WAITING,
    SHEF_WINDOW_PICTURES,
    SHEF_WINDOW_FLOW,
    SHEF_WINDOW_MATCHING,
    SHEF_WINDOW_CONVERTING,
    SHEF_WINDOW_STEREO,
    SHEF_WINDOW_PUBLISHING,
    SHEF_WINDOW_COMPLETE_TO_PUBLISH,
    SHEF_WINDOW_MID_TO_PUBLISH,
    SHEF_WINDOW_EVENTS_LATE,
    SHEF_WINDOW_FRAMES_LATE,
    SHEF_WINDOW_STAGES,
};

#define SHEF_WINDOW_THREADS 12

/* As `shefctl top` shows it, e.g. "matching". */
const char *shef_window_stage_name(enum shef_window_stage stage);

/* The threads of the graph, the helpers, and the control thread. */
const char *shef_window_thread_name(int thread);

struct shef_window_sample {
    shef_host_time at;
    uint64_t n_published;
    uint64_t n_events;
    int64_t cpu_ns; /* of the whole process */
    int64_t thread_cpu_ns[SHEF_WINDOW_THREADS];
    struct shef_latency_counts stages[SHEF_WINDOW_STAGES];
};

struct shef_window {
    struct shef_window_sample from; /* of the window that is under way */
    /* The last full one; length_s 0: there has been none. */
    double length_s;
    double frames_per_s;
    double events_per_s;
    double cpu_share;
    double thread_cpu_share[SHEF_WINDOW_THREADS];
    struct shef_latency_counts stages[SHEF_WINDOW_STAGES];
};

/* Begins anew.
 *   playback  NULL: only the process counts */
void shef_window_start(struct shef_window *window, const struct shef_playback *playback,
                       shef_host_time now);

/* Ends the window and begins the next, if it has lasted a second. */
void shef_window_tick(struct shef_window *window, const struct shef_playback *playback,
                      shef_host_time now);

/* From the source's start until now.
 *   playback  not NULL */
void shef_window_read(const struct shef_playback *playback, struct shef_window_sample *out_sample,
                      shef_host_time now);

#ifdef __cplusplus
}
#endif

#endif
