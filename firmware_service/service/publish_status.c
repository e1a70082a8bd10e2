#include "service/publish_status.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "service/playback_internal.h"

int64_t shef_resident_bytes(void)
{
    char text[128];
    const int fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    const ssize_t n_bytes = fd < 0 ? -1 : read(fd, text, sizeof text - 1);

    if (fd >= 0)
        close(fd);
    if (n_bytes < 1)
        return 0;
    text[n_bytes] = '\0';

    const char *second = strchr(text, ' '); /* in pages: all, resident, ... */

    return second ? strtoll(second, NULL, 10) * sysconf(_SC_PAGESIZE) : 0;
}

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;

    return clock_gettime(clock, &now) == 0 ? now.tv_sec * SHEF_NS_PER_S + now.tv_nsec : 0;
}

static const char *state_word(const struct shef_playback *playback)
{
    switch (shef_playback_state(playback)) {
    case SHEF_PLAYBACK_PLAYING:
        return "playing";
    case SHEF_PLAYBACK_ENDED:
        return "ended:";
    case SHEF_PLAYBACK_FAILED:
        return "failed:";
    }
    return "";
}

static void fill_counts(const struct shef_counters *counters,
                        struct shef_publish_status *out_status)
{
    out_status->event.ns = (int64_t)shef_counter_get(&counters->last_event_us) * SHEF_NS_PER_US;
    out_status->n_events = shef_counter_get(&counters->n_events);
    out_status->n_frames = shef_counter_get(&counters->n_frames_in);
    out_status->n_shed = shef_frames_lost(counters, SHEF_LOSS_SHED) +
                         shef_frames_lost(counters, SHEF_LOSS_NO_BUFFER) +
                         shef_frames_lost(counters, SHEF_LOSS_NO_RESULT);
    out_status->n_unmatched = shef_frames_lost(counters, SHEF_LOSS_NO_PAIR);
    out_status->n_damaged = shef_counter_get(&counters->n_violations) +
                            shef_counter_get(&counters->n_lost[SHEF_LOSS_DAMAGED]);
}

/* Rates since the last message, and what the next one will need. */
static void fill_rates(struct shef_playback *playback, struct shef_publish_status *out_status)
{
    struct shef_publish_status_before *before = &playback->status_before;
    struct shef_publisher_stats publisher;
    struct shef_publish_status_before now = {
        .at = out_status->now,
        .n_events = out_status->n_events,
        .cpu_ns = clock_ns(CLOCK_PROCESS_CPUTIME_ID),
    };
    const double length_s = (double)shef_host_time_since(now.at, before->at) * 1e-9;

    shef_publisher_stats(playback->publisher, &publisher);
    now.n_published = publisher.n_published;
    if (before->at.ns != 0 && length_s > 0.0) {
        out_status->events_per_s = (float)((double)(now.n_events - before->n_events) / length_s);
        out_status->frames_per_s =
            (float)((double)(now.n_published - before->n_published) / length_s);
        out_status->cpu_cores = (float)((double)(now.cpu_ns - before->cpu_ns) * 1e-9 / length_s);
    }
    *before = now;
}

bool shef_playback_publish_status(void *context, struct shef_publish_status *out_status)
{
    struct shef_playback *playback = context;
    const char *slash = strrchr(playback->source->path, '/');

    /* A long name is cut. */
    (void)snprintf(out_status->state, sizeof out_status->state, "%s %.80s", state_word(playback),
                   slash && slash[1] ? slash + 1 : playback->source->path);
    out_status->now = shef_clock_now(playback->pace.clock);
    out_status->utc_minus_mono_ns = clock_ns(CLOCK_REALTIME) - out_status->now.ns;
    shef_stereo_stage_identity(playback->stereo, &out_status->session_id, out_status->calib_id);
    out_status->mode = shef_live_get(&playback->live->mode);
    out_status->memory_mib = (int32_t)(shef_resident_bytes() >> 20);
    out_status->backlog = (int32_t)shef_ring_count(&playback->results_in->ring);
    fill_counts(&playback->counters, out_status);
    fill_rates(playback, out_status);
    return true;
}
