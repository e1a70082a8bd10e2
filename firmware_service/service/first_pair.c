#include "service/first_pair.h"

#include <stdlib.h>

#include "core/cpu.h"
#include "record/recorded_events.h"

/* More than the four of the start of pairing: here nobody waits for them. */
#define N_START 8

/* What does not show in so many frames does not show. */
#define MAX_FRAMES 64

#define BATCH_EVENTS 16384

struct search {
    const struct shef_recorded_clock *clock;
    int64_t delay_ns;
    uint64_t n_rises;
    struct shef_pairing pairing;
    struct shef_event events[BATCH_EVENTS];
};

static void begin(struct search *search, const struct shef_recorded_frames *frames)
{
    const uint32_t n = shef_recorded_frames_count(frames);
    struct shef_pairing_params params = shef_pairing_default_params();

    params.begins_together = search->clock->starts_whole;
    params.n_start = N_START;
    params.n_decide = MAX_FRAMES / 2;
    shef_pairing_init(&search->pairing, &params);
    for (uint32_t i = 0; i < n && i < MAX_FRAMES; i++) {
        const struct shef_frame_info *info = shef_recorded_frames_info(frames, i);
        const enum shef_err code =
            shef_pairing_add_frame(&search->pairing, &(struct shef_pairing_frame){
                                                         .tag = i,
                                                         .camera = info->time,
                                                         .has_host = true,
                                                         .arrived = info->arrived,
                                                     });

        (void)code; /* there is room for more */
    }
}

/* Takes what is decided. Returns whether a pair was among it. */
static bool decide(struct search *search, const struct shef_recorded_frames *frames,
                   struct shef_first_pair *out_pair)
{
    /* Before everything: nothing has waited too long. */
    const shef_host_time now = { INT64_MIN / 2 };
    struct shef_pairing_result result;

    while (shef_pairing_take(&search->pairing, now, &result) == SHEF_OK) {
        if (result.kind != SHEF_PAIRING_PAIR)
            continue;
        *out_pair = (struct shef_first_pair){
            .is_known = true,
            .is_ambiguous = (result.flags & SHEF_PAIRING_AMBIGUOUS) != 0,
            .pair = { shef_recorded_frames_info(frames, (uint32_t)result.tag)->time, result.rise },
        };
        return true;
    }
    return false;
}

static void add_triggers(struct search *search, const struct shef_event_batch *batch)
{
    for (uint32_t i = 0; i < batch->n_triggers; i++) {
        const struct shef_trigger *trigger = &batch->triggers[i];
        const shef_event_time rise = { trigger->t_us * SHEF_NS_PER_US + search->delay_ns };

        if (!trigger->rising || trigger->channel != SHEF_EXPOSURE_CHANNEL)
            continue;
        shef_pairing_add_snapshot(&search->pairing,
                                  &(struct shef_pairing_snapshot){
                                      .number = search->n_rises++,
                                      .rise = rise,
                                      .mid = rise,
                                      .has_host = true,
                                      .host = shef_recorded_clock_host(search->clock, rise),
                                  });
    }
}

static enum shef_err look(struct search *search, struct shef_recorded_events *events,
                          const struct shef_recorded_frames *frames,
                          struct shef_first_pair *out_pair, struct shef_error *err)
{
    struct shef_event_batch batch = { .events = search->events, .capacity = BATCH_EVENTS };
    enum shef_err code = SHEF_OK;

    begin(search, frames);
    while (search->n_rises < MAX_FRAMES &&
           (code = shef_recorded_events_next(events, &batch, err)) == SHEF_OK) {
        add_triggers(search, &batch);
        if (decide(search, frames, out_pair))
            return SHEF_OK;
    }
    if (code != SHEF_OK && code != SHEF_ERR_EMPTY)
        return code;
    shef_pairing_finish(&search->pairing);
    (void)decide(search, frames, out_pair);
    return SHEF_OK;
}

enum shef_err shef_first_pair_find(const char *recording, const struct shef_recorded_frames *frames,
                                   const struct shef_recorded_clock *clock, int64_t delay_ns,
                                   struct shef_first_pair *out_pair, struct shef_error *err)
{
    struct search *search = calloc(1, sizeof *search);
    struct shef_first_pair found = { .is_known = false };
    struct shef_recorded_events *events;
    enum shef_err code;

    if (!search)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "play '%s': out of memory", recording);
    search->clock = clock;
    search->delay_ns = delay_ns;
    code = shef_recorded_events_open(recording, shef_cpu_features(), &events, err);
    if (code == SHEF_OK) {
        code = look(search, events, frames, &found, err);
        shef_recorded_events_close(events);
    }
    free(search);
    if (code == SHEF_OK)
        *out_pair = found;
    return code;
}
