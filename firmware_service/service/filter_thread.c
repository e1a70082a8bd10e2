#include "service/filter_thread.h"

#include <stdlib.h>

#include "codecs/evt.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/snapshot.h"
#include "service/push.h"
#include "service/wiring.h"

/* 16384 events are 128 KiB: a batch stays in the L2 cache between decoder and filter. */
#define BATCH_EVENTS 16384

struct shef_filter_stage {
    /* Set by create. */
    struct shef_filter_stage_params params;
    struct shef_link *raw_events;
    struct shef_link *to_stereo;
    struct shef_wake *wake;
    struct shef_filter *filter;
    struct shef_hot_pixels *hot;
    struct shef_snapshots *snapshots;
    struct shef_event *events;
    /* The filter thread's. */
    struct shef_evt_decoder decoder;
    struct shef_event_batch batch;
    uint64_t next_number;     /* of the snapshots */
    uint32_t decoded_pass;    /* of the last buffer */
    uint32_t pass;            /* of the last event or trigger */
    bool awaits_pass;         /* the present pass has not yet shown a time */
    int64_t pass_us;          /* event time at which it began */
    uint64_t n_events_before; /* by decoders of earlier passes, as the next */
    uint64_t n_violations_before;
};

static enum shef_err create_parts(struct shef_filter_stage *stage, struct shef_error *err)
{
    const struct shef_source *source = stage->params.source;
    const struct shef_event_part *part = shef_replay_part(source->events);
    const int32_t width_px = (int32_t)part->width_px;
    const int32_t height_px = (int32_t)part->height_px;
    const struct shef_filter_params filter = shef_filter_default_params(width_px, height_px);
    const struct shef_hot_pixels_params hot = shef_hot_pixels_default_params(width_px, height_px);
    struct shef_snapshot_params snapshots = shef_snapshot_default_params();
    enum shef_err code;

    snapshots.channel = SHEF_EXPOSURE_CHANNEL;
    snapshots.n_snapshots = SHEF_FILTER_SNAPSHOTS;
    snapshots.n_steps = stage->params.look_ahead;
    snapshots.delay_ns = source->calibration.frame_delay.ns + source->calibration.event_delay.ns;
    snapshots.exposure_ns =
        shef_recorded_frames_info(source->frames, 0)->exposure_us * SHEF_NS_PER_US;
    stage->events = shef_memory_create(BATCH_EVENTS, sizeof *stage->events);
    if (!stage->events)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "filter: out of memory");
    stage->batch = (struct shef_event_batch){ .events = stage->events, .capacity = BATCH_EVENTS };
    code = shef_filter_create(&stage->filter, &filter, shef_cpu_features(), err);
    if (code == SHEF_OK)
        code = shef_hot_pixels_create(&stage->hot, &hot, err);
    if (code == SHEF_OK)
        code = shef_snapshots_create(&stage->snapshots, stage->filter, stage->hot, &snapshots, err);
    return code;
}

enum shef_err shef_filter_stage_create(const struct shef_filter_stage_params *params,
                                       struct shef_filter_stage **out_stage, struct shef_error *err)
{
    struct shef_filter_stage *stage = shef_memory_create(1, sizeof *stage);

    if (!stage)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "filter: out of memory");
    stage->params = *params;

    const enum shef_err code = create_parts(stage, err);

    if (code != SHEF_OK) {
        shef_filter_stage_destroy(stage);
        return code;
    }
    stage->raw_events = shef_graph_consumer_end(params->graph, "raw_events", "filter");
    stage->to_stereo = shef_graph_producer_end(params->graph, "snapshots", "filter");
    stage->wake = shef_graph_wake(params->graph, "filter");
    *out_stage = stage;
    return SHEF_OK;
}

void shef_filter_stage_destroy(struct shef_filter_stage *stage)
{
    if (!stage)
        return;
    shef_snapshots_destroy(stage->snapshots);
    shef_hot_pixels_destroy(stage->hot);
    shef_filter_destroy(stage->filter);
    free(stage->events);
    free(stage);
}

struct shef_snapshot_pool *shef_filter_stage_pool(struct shef_filter_stage *stage)
{
    return shef_snapshots_pool(stage->snapshots);
}

/* A pass's snapshots begin with its first event or trigger; what the rhythm of the triggers lets
 * expect before that belongs to the pass before. */
static uint32_t pass_of(const struct shef_filter_stage *stage, const struct shef_snapshot *snapshot)
{
    return stage->pass > 0 && snapshot->rise.ns < stage->pass_us * SHEF_NS_PER_US ? stage->pass - 1
                                                                                  : stage->pass;
}

/* Lends what was finished to the stereo thread. */
static void hand_on(struct shef_filter_stage *stage, shef_host_time arrived)
{
    struct shef_snapshot_pool *pool = shef_snapshots_pool(stage->snapshots);
    struct shef_counters *counters = stage->params.counters;

    for (; stage->next_number < shef_snapshot_pool_end(pool); stage->next_number++) {
        struct shef_snapshot_item item = { .arrived = arrived };

        /* Numbers of snapshots that were given up are never published. */
        if (shef_snapshot_pool_take(pool, stage->next_number, &item.snapshot) != SHEF_OK)
            continue;
        shef_count(&counters->n_snapshots, 1);
        shef_count(&counters->n_predicted, (item.snapshot->flags & SHEF_SNAPSHOT_PREDICTED) != 0);
        item.pass = pass_of(stage, item.snapshot);
        item.ready = shef_clock_now(stage->params.pace->clock);
        if (!shef_push_in_time(stage->to_stereo, &item, stage->params.pace, stage->wake)) {
            shef_count(&counters->n_snapshots_lost, 1);
            shef_snapshot_pool_give(pool, item.snapshot);
        }
    }
}

/* The earliest time in a batch that holds anything. */
static int64_t first_us(const struct shef_event_batch *batch)
{
    int64_t us = batch->reached_us;

    if (batch->n_events > 0 && shef_event_batch_time_us(batch, 0) < us)
        us = shef_event_batch_time_us(batch, 0);
    if (batch->n_triggers > 0 && batch->triggers[0].t_us < us)
        us = batch->triggers[0].t_us;
    return us;
}

static void use_batch(struct shef_filter_stage *stage, const struct shef_event_item *item)
{
    struct shef_event_batch *batch = &stage->batch;
    struct shef_counters *counters = stage->params.counters;

    batch->base_us += item->time_shift_us;
    batch->reached_us += item->time_shift_us;
    for (uint32_t i = 0; i < batch->n_triggers; i++) {
        struct shef_trigger *trigger = &batch->triggers[i];

        trigger->t_us += item->time_shift_us;
        if (trigger->channel == SHEF_EXPOSURE_CHANNEL)
            shef_count(trigger->rising ? &counters->n_rising : &counters->n_falling, 1);
    }
    if (stage->awaits_pass && (batch->n_events > 0 || batch->n_triggers > 0)) {
        stage->pass = item->pass;
        stage->pass_us = first_us(batch);
        stage->awaits_pass = false;
    }
    shef_snapshots_feed(stage->snapshots, batch);
    shef_counter_set(&counters->last_event_us, (uint64_t)batch->reached_us);
    hand_on(stage, item->raw.arrived);
}

/* Something is missing before this item, or everything: what came before says nothing about it. */
static void restart_decoder(struct shef_filter_stage *stage, const struct shef_event_item *item)
{
    const struct shef_event_part *part = shef_replay_part(stage->params.source->events);
    const struct shef_evt_stats *stats = &stage->decoder.stats;
    enum shef_err code;

    stage->n_events_before += stats->n_events;
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        stage->n_violations_before += stats->n_violations[i];
    shef_evt_init(&stage->decoder, part->format, part->width_px, part->height_px, 0,
                  shef_cpu_features());
    code = shef_evt_restore(&stage->decoder, item->state, NULL);
    /* A state that makes no sense: decoding finds its own way, with times of its own. */
    (void)code;
}

static void count(struct shef_filter_stage *stage, int64_t took_ns)
{
    const struct shef_evt_stats *stats = &stage->decoder.stats;
    struct shef_counters *counters = stage->params.counters;
    const struct shef_hot_pixel *pixels;
    const uint32_t *indices;
    uint64_t n_violations = stage->n_violations_before;

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        n_violations += stats->n_violations[i];
    shef_counter_set(&counters->n_events, stage->n_events_before + stats->n_events);
    shef_counter_set(&counters->n_violations, n_violations);
    shef_counter_set(&counters->n_hot_pixels, shef_hot_pixels_list(stage->hot, &pixels, &indices));
    shef_count(&counters->n_packets, 1);
    shef_latency_add(&counters->decoding, took_ns);
}

static void use_buffer(struct shef_filter_stage *stage, const struct shef_event_item *item)
{
    const struct shef_clock *clock = stage->params.pace->clock;
    const shef_host_time start = shef_clock_now(clock);
    const uint8_t *bytes = item->raw.buffer->data;
    size_t n_left = item->raw.buffer->used_bytes;

    if (!item->follows)
        restart_decoder(stage, item);
    stage->awaits_pass = stage->awaits_pass || item->pass != stage->decoded_pass;
    stage->decoded_pass = item->pass;
    while (n_left > 0) {
        shef_event_batch_clear(&stage->batch);

        const size_t n_taken = shef_evt_decode(&stage->decoder, bytes, n_left, &stage->batch);

        use_batch(stage, item);
        bytes += n_taken;
        n_left -= n_taken;
    }
    shef_buffer_give(item->raw.buffer);
    count(stage, shef_host_time_since(shef_clock_now(clock), start));
}

/* Nothing has happened up to an instant. */
static void use_time(struct shef_filter_stage *stage, const struct shef_event_item *item)
{
    shef_event_batch_clear(&stage->batch);
    stage->batch.base_us = item->reached_us;
    stage->batch.reached_us = item->reached_us;
    use_batch(stage, item);
}

void shef_filter_thread(void *context)
{
    struct shef_filter_stage *stage = context;
    const struct shef_snapshot_item end = { .snapshot = NULL };
    struct shef_event_item item;

    while (!shef_pace_is_stopping(stage->params.pace)) {
        shef_wake_wait(stage->wake, -1);
        while (shef_link_pop(stage->raw_events, &item) == SHEF_OK) {
            if (item.raw.buffer)
                use_buffer(stage, &item);
            else if (!item.has_ended)
                use_time(stage, &item);
            else
                (void)shef_push_surely(stage->to_stereo, &end, stage->params.pace, stage->wake);
            shef_pace_done(stage->params.pace);
        }
    }
}

void shef_filter_stage_empty(struct shef_filter_stage *stage)
{
    struct shef_event_item item;

    while (shef_link_pop(stage->raw_events, &item) == SHEF_OK)
        if (item.raw.buffer)
            shef_buffer_give(item.raw.buffer);
}
