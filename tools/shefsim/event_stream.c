#include "shefsim/event_stream.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "codecs/evt_encode.h"
#include "core/time.h"
#include "record/event_recorder.h"
#include "shefsim/event_sensor_parts.h"
#include "shefsim/random.h"

#define BUFFER_US    1000
#define BUFFER_BYTES (128u << 10) /* of one USB transfer */

/* Frames are at least a millisecond apart, and triggers are told just before they come. */
#define MAX_TRIGGERS SHEF_BATCH_TRIGGERS

struct sim_event_stream {
    struct sim_event_stream_config config;
    struct shef_event_recorder *recorder;
    struct shef_evt_encoder encoder;
    struct sim_event_list list; /* waiting; times since base_us */
    int64_t base_us;            /* INT64_MIN: nothing has come yet */
    struct shef_trigger triggers[MAX_TRIGGERS];
    uint32_t n_triggers;
    uint64_t n_buffers;
    bool has_failed;
    uint8_t buffer[BUFFER_BYTES];
};

enum shef_err sim_event_stream_start(struct sim_event_stream **out_stream,
                                     const struct sim_event_stream_config *config,
                                     struct shef_recording_writer *recording,
                                     struct shef_error *err)
{
    const struct shef_raw_header camera = {
        .format = SHEF_EVT3,
        .size = SHEF_RAW_SIZE_GIVEN,
        .width_px = (uint32_t)config->width_px,
        .height_px = (uint32_t)config->height_px,
        .system_id = 28, /* PEK3SVCD: Prophesee's VGA sensor */
        .serial = "00000001",
        .integrator = "shefsim",
    };
    struct shef_event_recorder_config recorder = shef_event_recorder_default_config(&camera);
    struct sim_event_stream *stream = calloc(1, sizeof *stream);

    if (!stream)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record events: out of memory");
    recorder.sync_ns = 0; /* a rendering that a power cut ends is rendered again */
    stream->config = *config;
    stream->base_us = INT64_MIN;
    shef_evt_encoder_init(&stream->encoder, SHEF_EVT3, SHEF_EVT_TICKS_SENSOR, camera.width_px,
                          camera.height_px);

    const enum shef_err code =
        shef_event_recorder_start(recording, &recorder, &stream->recorder, err);

    if (code == SHEF_OK)
        *out_stream = stream;
    else
        free(stream);
    return code;
}

/* When a buffer that was full at this event time reaches the host. */
static shef_host_time arrival(const struct sim_event_stream *stream, int64_t t_us)
{
    const struct sim_event_stream_config *config = &stream->config;
    const uint64_t key = sim_key(config->seed, SIM_STREAM_HOST_DELAY, SHEF_PART_EVENTS);
    const double late = sim_unit(sim_random(key, stream->n_buffers)) * (double)config->jitter_ns;
    const int64_t true_ns = sim_clock_when(&config->clocks.event, t_us * SHEF_NS_PER_US);

    return sim_clocks_host(&config->clocks, true_ns + config->delay_ns + (int64_t)late);
}

/* Encodes a batch and records its bytes as one buffer, or more if there are many. */
static enum shef_err record(struct sim_event_stream *stream, const struct shef_event_batch *batch,
                            struct shef_error *err)
{
    enum shef_err code = SHEF_ERR_FULL;
    enum shef_err written = SHEF_OK;

    while (written == SHEF_OK && code == SHEF_ERR_FULL) {
        size_t n_bytes;

        code = shef_evt_encode(&stream->encoder, batch, stream->buffer, sizeof stream->buffer,
                               &n_bytes);
        assert(code == SHEF_OK || code == SHEF_ERR_FULL);
        if (n_bytes == 0)
            continue;
        written = shef_event_recorder_write(stream->recorder, stream->buffer, (uint32_t)n_bytes,
                                            arrival(stream, batch->reached_us), 0, err);
        stream->n_buffers++;
    }
    return written;
}

/* How many of the waiting events come before a time. */
static uint32_t n_before(const struct sim_event_stream *stream, size_t from, int64_t t_us)
{
    size_t i = from;

    while (i < stream->list.n && stream->base_us + stream->list.events[i].t_us < t_us)
        i++;
    return (uint32_t)(i - from);
}

/* Takes the triggers before a time off the queue and puts them between a batch's events. */
static void take_triggers(struct sim_event_stream *stream, size_t from, int64_t until_us,
                          struct shef_event_batch *batch)
{
    uint32_t n = 0;

    for (; n < stream->n_triggers && stream->triggers[n].t_us < until_us; n++) {
        batch->triggers[n] = stream->triggers[n];
        batch->triggers[n].n_before = n_before(stream, from, stream->triggers[n].t_us);
    }
    batch->n_triggers = n;
    stream->n_triggers -= n;
    memmove(stream->triggers, stream->triggers + n, stream->n_triggers * sizeof *stream->triggers);
}

/* Records all whole milliseconds before a time. */
static enum shef_err record_until(struct sim_event_stream *stream, int64_t until_us,
                                  struct shef_error *err)
{
    enum shef_err code = SHEF_OK;
    size_t at = 0;
    int64_t reached_us = stream->base_us;

    while (code == SHEF_OK && reached_us + BUFFER_US <= until_us) {
        struct shef_event_batch batch = {
            .events = stream->list.events + at,
            .base_us = stream->base_us,
            .reached_us = reached_us + BUFFER_US,
        };

        batch.n_events = n_before(stream, at, batch.reached_us);
        batch.capacity = batch.n_events;
        take_triggers(stream, at, batch.reached_us, &batch);
        code = record(stream, &batch, err);
        at += batch.n_events;
        reached_us = batch.reached_us;
    }

    /* What is left waits for the next call, its times counted from there. */
    const uint32_t passed_us = (uint32_t)(reached_us - stream->base_us);

    stream->list.n -= at;
    if (stream->list.n > 0)
        memmove(stream->list.events, stream->list.events + at,
                stream->list.n * sizeof *stream->list.events);
    for (size_t i = 0; i < stream->list.n; i++)
        stream->list.events[i].t_us -= passed_us;
    stream->base_us = reached_us;
    stream->has_failed = code != SHEF_OK;
    return code;
}

enum shef_err sim_event_stream_trigger(struct sim_event_stream *stream, int64_t t_us, bool rising,
                                       struct shef_error *err)
{
    if (stream->n_triggers == MAX_TRIGGERS)
        return shef_fail(err, SHEF_ERR_FULL, "record events: more than %d triggers wait",
                         MAX_TRIGGERS);
    assert(t_us >= stream->base_us);
    stream->triggers[stream->n_triggers++] =
        (struct shef_trigger){ .t_us = t_us, .channel = 0, .rising = rising };
    return SHEF_OK;
}

enum shef_err sim_event_stream_add(struct sim_event_stream *stream, const struct sim_events *events,
                                   struct shef_error *err)
{
    const int64_t shift_us = stream->config.shift_us;
    struct sim_event_list *list = &stream->list;

    if (stream->base_us == INT64_MIN)
        stream->base_us = events->base_us + (shift_us < 0 ? shift_us : 0);
    if (!sim_event_list_reserve(list, list->n + events->n))
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record events: out of memory");
    for (size_t i = 0; i < events->n; i++) {
        struct shef_event event = events->events[i];

        event.t_us = (uint32_t)(events->base_us + event.t_us + shift_us - stream->base_us);
        list->events[list->n++] = event;
    }
    /* Shifted events are complete later, or would overtake triggers. */
    return record_until(stream, events->complete_us + (shift_us < 0 ? shift_us : 0), err);
}

enum shef_err sim_event_stream_stop(struct sim_event_stream *stream, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (!stream->has_failed && stream->base_us != INT64_MIN) {
        int64_t last_us = stream->base_us;

        if (stream->list.n > 0)
            last_us += stream->list.events[stream->list.n - 1].t_us;
        if (stream->n_triggers > 0 && stream->triggers[stream->n_triggers - 1].t_us > last_us)
            last_us = stream->triggers[stream->n_triggers - 1].t_us;
        code = record_until(stream, last_us + BUFFER_US + 1, err);
    }

    const enum shef_err stopped =
        shef_event_recorder_stop(stream->recorder, code == SHEF_OK ? err : NULL);

    free(stream->list.events);
    free(stream);
    return code == SHEF_OK ? stopped : code;
}
