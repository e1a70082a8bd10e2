#include "service/window.h"

#include <string.h>
#include <time.h>

#define WINDOW_NS SHEF_NS_PER_S

static const char *const stage_names[SHEF_WINDOW_STAGES] = {
    [SHEF_WINDOW_DECODING] = "decode_filter",
    [SHEF_WINDOW_WAITING] = "wait",
    [SHEF_WINDOW_PICTURES] = "pictures",
    [SHEF_WINDOW_FLOW] = "flow",
    [SHEF_WINDOW_MATCHING] = "match",
    [SHEF_WINDOW_CONVERTING] = "convert",
    [SHEF_WINDOW_STEREO] = "stereo",
    [SHEF_WINDOW_PUBLISHING] = "publish",
    [SHEF_WINDOW_COMPLETE_TO_PUBLISH] = "complete_to_publish",
    [SHEF_WINDOW_MID_TO_PUBLISH] = "mid_exposure_to_publish",
    [SHEF_WINDOW_EVENTS_LATE] = "events_late",
    [SHEF_WINDOW_FRAMES_LATE] = "frames_late",
};

static const char *const thread_names[SHEF_WINDOW_THREADS] = {
    "events",        "frames",        "poses",        "filter",          "stereo",  "publisher",
    "record_events", "record_frames", "record_poses", "record_triggers", "workers", "control",
};

const char *shef_window_stage_name(enum shef_window_stage stage)
{
    return stage_names[stage];
}

const char *shef_window_thread_name(int thread)
{
    return thread_names[thread];
}

static int64_t clock_ns(clockid_t clock)
{
    struct timespec used;

    return clock_gettime(clock, &used) == 0 ? used.tv_sec * SHEF_NS_PER_S + used.tv_nsec : 0;
}

static void read_latencies(const struct shef_playback *playback, struct shef_window_sample *sample)
{
    const struct shef_counters *counters = shef_playback_counters(playback);
    const struct shef_publisher_latency *publisher =
        shef_publisher_latency(shef_playback_publisher(playback));
    const struct shef_latency *const from[SHEF_WINDOW_STAGES] = {
        [SHEF_WINDOW_DECODING] = &counters->decoding,
        [SHEF_WINDOW_WAITING] = &counters->waiting,
        [SHEF_WINDOW_PICTURES] = &counters->pictures,
        [SHEF_WINDOW_FLOW] = &counters->flow,
        [SHEF_WINDOW_MATCHING] = &counters->matching,
        [SHEF_WINDOW_CONVERTING] = &counters->converting,
        [SHEF_WINDOW_STEREO] = &counters->stereo,
        [SHEF_WINDOW_PUBLISHING] = &publisher->own,
        [SHEF_WINDOW_COMPLETE_TO_PUBLISH] = &publisher->from_complete,
        [SHEF_WINDOW_MID_TO_PUBLISH] = &publisher->from_mid,
        [SHEF_WINDOW_EVENTS_LATE] = &counters->events_late,
        [SHEF_WINDOW_FRAMES_LATE] = &counters->frames_late,
    };

    for (int i = 0; i < SHEF_WINDOW_STAGES; i++)
        shef_latency_read(from[i], &sample->stages[i]);
}

void shef_window_read(const struct shef_playback *playback, struct shef_window_sample *out_sample,
                      shef_host_time now)
{
    struct shef_publisher_stats publisher;

    shef_publisher_stats(shef_playback_publisher(playback), &publisher);
    out_sample->at = now;
    out_sample->n_published = publisher.n_published;
    out_sample->n_events = shef_counter_get(&shef_playback_counters(playback)->n_events);
    out_sample->cpu_ns = clock_ns(CLOCK_PROCESS_CPUTIME_ID);
    for (int i = 0; i < SHEF_WINDOW_THREADS - 1; i++) {
        const int64_t used_ns = shef_graph_cpu_ns(shef_playback_graph(playback), thread_names[i]);

        out_sample->thread_cpu_ns[i] = used_ns > 0 ? used_ns : 0;
    }
    out_sample->thread_cpu_ns[SHEF_WINDOW_THREADS - 1] = clock_ns(CLOCK_THREAD_CPUTIME_ID);
    read_latencies(playback, out_sample);
}

static void read_any(const struct shef_playback *playback, struct shef_window_sample *out_sample,
                     shef_host_time now)
{
    if (playback) {
        shef_window_read(playback, out_sample, now);
        return;
    }
    memset(out_sample, 0, sizeof *out_sample);
    out_sample->at = now;
    out_sample->cpu_ns = clock_ns(CLOCK_PROCESS_CPUTIME_ID);
}

void shef_window_start(struct shef_window *window, const struct shef_playback *playback,
                       shef_host_time now)
{
    memset(window, 0, sizeof *window);
    read_any(playback, &window->from, now);
}

/* A thread that has ended since is not asked any more and reads as 0. */
static double share_of(int64_t to_ns, int64_t from_ns, double length_s)
{
    return to_ns > from_ns ? (double)(to_ns - from_ns) * 1e-9 / length_s : 0;
}

void shef_window_tick(struct shef_window *window, const struct shef_playback *playback,
                      shef_host_time now)
{
    static struct shef_window_sample to; /* large, and of the one control thread */
    const int64_t length_ns = shef_host_time_since(now, window->from.at);
    const double length_s = (double)length_ns * 1e-9;

    if (length_ns < WINDOW_NS)
        return;
    read_any(playback, &to, now);
    window->length_s = length_s;
    window->frames_per_s = (double)(to.n_published - window->from.n_published) / length_s;
    window->events_per_s = (double)(to.n_events - window->from.n_events) / length_s;
    window->cpu_share = (double)(to.cpu_ns - window->from.cpu_ns) * 1e-9 / length_s;
    for (int i = 0; i < SHEF_WINDOW_THREADS; i++)
        window->thread_cpu_share[i] =
            share_of(to.thread_cpu_ns[i], window->from.thread_cpu_ns[i], length_s);
    for (int i = 0; i < SHEF_WINDOW_STAGES; i++)
        shef_latency_window(&to.stages[i], &window->from.stages[i], &window->stages[i]);
    window->from = to;
}
