#include "sheftool/events_moments.h"

#include <math.h>

#include "core/cpu.h"
#include "sheftool/progress.h"

/* The filter has forgotten what was before: e^-30 at the lowest cut-off of interest. */
#define WARM_UP_US   INT64_C(500000)
#define MAX_TRIGGERS 2 /* a feed, so that the pool of snapshots is emptied in time */

struct job {
    const struct shef_moments_params *params;
    shef_moment_fn *use;
    void *context;
    struct shef_filter *filter;
    struct shef_hot_pixels *hot;
    struct shef_snapshots *snapshots;
    uint64_t next_number; /* of the snapshots */
    bool has_first;
    int64_t first_us; /* of the stream */
    int64_t begin_us; /* nothing is fed before this */
    int64_t from_us;  /* the stretch of snapshots */
    int64_t to_us;
    uint64_t n_instants; /* made so far, at a rate */
};

static enum shef_err create_job(struct job *job, struct shef_error *err)
{
    const struct shef_moments_params *params = job->params;
    struct shef_filter_params filter =
        shef_filter_default_params((int32_t)params->width_px, (int32_t)params->height_px);
    const struct shef_hot_pixels_params hot =
        shef_hot_pixels_default_params((int32_t)params->width_px, (int32_t)params->height_px);
    struct shef_snapshot_params snapshots = shef_snapshot_default_params();

    filter.cutoff_rad_s = params->cutoff_rad_s;
    snapshots.read = params->read;
    if (params->n_steps > 0)
        snapshots.n_steps = params->n_steps;
    snapshots.channel = params->channel;
    snapshots.delay_ns = params->delay_ns;
    snapshots.exposure_ns = params->exposure_us * SHEF_NS_PER_US;
    if (params->rate_hz > 0) {
        /* Instants are exact: nothing to guess. */
        snapshots.exposure_ns = 0;
        snapshots.exposure_err_ns = 0;
        snapshots.max_predicted = 0;
    }

    enum shef_err code = shef_filter_create(&job->filter, &filter, shef_cpu_features(), err);

    if (code == SHEF_OK && params->mask_hot)
        code = shef_hot_pixels_create(&job->hot, &hot, err);
    if (code == SHEF_OK)
        code = shef_snapshots_create(&job->snapshots, job->filter, job->hot, &snapshots, err);
    return code;
}

static void destroy_job(struct job *job)
{
    shef_snapshots_destroy(job->snapshots);
    shef_hot_pixels_destroy(job->hot);
    shef_filter_destroy(job->filter);
}

/* Hands out what was published. */
static enum shef_err drain(struct job *job, struct shef_error *err)
{
    struct shef_snapshot_pool *pool = shef_snapshots_pool(job->snapshots);
    enum shef_err code = SHEF_OK;

    for (; code == SHEF_OK && job->next_number < shef_snapshot_pool_end(pool); job->next_number++) {
        const struct shef_snapshot *snapshot;
        const struct shef_hot_pixel *pixels;
        const uint32_t *indices;

        /* Numbers of snapshots that were given up are never published. */
        if (shef_snapshot_pool_take(pool, job->next_number, &snapshot) != SHEF_OK)
            continue;

        const int64_t mid_us = snapshot->mid.ns / SHEF_NS_PER_US;
        const struct shef_moment moment = {
            .snapshot = snapshot,
            .since_first_us = mid_us - job->first_us,
            .n_hot = job->hot ? shef_hot_pixels_list(job->hot, &pixels, &indices) : 0,
        };

        if (mid_us >= job->from_us && mid_us <= job->to_us)
            code = job->use(job->context, &moment, err);
        shef_snapshot_pool_give(pool, snapshot);
    }
    return code;
}

/* Feeds the rest of a batch from event `*at` on up to event `end`, with these triggers, whose
 * n_before count from the batch's beginning. */
static enum shef_err feed(struct job *job, const struct shef_event_batch *batch, uint32_t *at,
                          uint32_t end, const struct shef_trigger *triggers, uint32_t n_triggers,
                          int64_t reached_us, struct shef_error *err)
{
    struct shef_event_batch piece = *batch;

    piece.events = batch->events + *at;
    piece.n_events = end - *at;
    piece.n_triggers = n_triggers;
    piece.reached_us = reached_us;
    for (uint32_t i = 0; i < n_triggers; i++) {
        piece.triggers[i] = triggers[i];
        piece.triggers[i].n_before -= *at;
    }
    shef_snapshots_feed(job->snapshots, &piece);
    *at = end;
    return drain(job, err);
}

/* Feeds a batch with the stream's own triggers, a few at a time. */
static enum shef_err feed_triggers(struct job *job, const struct shef_event_batch *batch,
                                   struct shef_error *err)
{
    uint32_t at = 0;
    uint32_t k = 0;
    enum shef_err code = SHEF_OK;

    while (code == SHEF_OK && batch->n_triggers - k > MAX_TRIGGERS) {
        const struct shef_trigger *last = &batch->triggers[k + MAX_TRIGGERS - 1];

        code = feed(job, batch, &at, last->n_before, batch->triggers + k, MAX_TRIGGERS, last->t_us,
                    err);
        k += MAX_TRIGGERS;
    }
    if (code != SHEF_OK)
        return code;
    return feed(job, batch, &at, batch->n_events, batch->triggers + k, batch->n_triggers - k,
                batch->reached_us, err);
}

/* The next instant at a rate. */
static int64_t next_instant_us(const struct job *job)
{
    return job->from_us + llrint((double)job->n_instants * 1e6 / job->params->rate_hz);
}

/* Feeds a batch with an edge at every instant that it reaches. */
static enum shef_err feed_instants(struct job *job, const struct shef_event_batch *batch,
                                   struct shef_error *err)
{
    uint32_t at = 0;
    enum shef_err code = SHEF_OK;

    for (int64_t instant_us = next_instant_us(job);
         code == SHEF_OK && instant_us <= batch->reached_us && instant_us <= job->to_us;
         instant_us = next_instant_us(job)) {
        struct shef_trigger edge = { .t_us = instant_us,
                                     .channel = (uint8_t)job->params->channel,
                                     .rising = true };
        uint32_t end = at;

        while (end < batch->n_events && shef_event_batch_time_us(batch, end) < instant_us)
            end++;
        edge.n_before = end;
        code = feed(job, batch, &at, end, &edge, 1, instant_us, err);
        job->n_instants++;
    }
    if (code != SHEF_OK)
        return code;
    return feed(job, batch, &at, batch->n_events, NULL, 0, batch->reached_us, err);
}

static void note_first(struct job *job, const struct shef_event_batch *batch)
{
    const struct shef_moments_params *params = job->params;

    if (batch->n_triggers > 0 && batch->triggers[0].n_before == 0)
        job->first_us = batch->triggers[0].t_us;
    else
        job->first_us = shef_event_batch_time_us(batch, 0);
    job->has_first = true;
    job->from_us = job->first_us + llrint(params->from_s * 1e6);
    job->to_us = job->first_us + llrint(params->to_s * 1e6);
    job->begin_us = job->from_us - WARM_UP_US;
    /* Nothing is in the filter at the very first event. */
    job->n_instants = params->from_s > 0 ? 0 : 1;
}

static enum shef_err use_batch(struct job *job, const struct shef_event_batch *batch,
                               struct shef_error *err)
{
    if (!job->has_first)
        note_first(job, batch);
    if (batch->reached_us < job->begin_us)
        return SHEF_OK;
    return job->params->rate_hz > 0 ? feed_instants(job, batch, err)
                                    : feed_triggers(job, batch, err);
}

static enum shef_err run_job(struct job *job, struct shef_events_source *source,
                             struct shef_error *err)
{
    static struct shef_event events[SHEF_EVENTS_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = SHEF_EVENTS_BATCH };
    struct shef_progress progress;
    enum shef_err code;

    shef_progress_begin(&progress, "rendering", 1000);
    while ((code = shef_events_source_next(source, &batch, err)) == SHEF_OK) {
        code = use_batch(job, &batch, err);
        if (code != SHEF_OK)
            break;
        /* A snapshot looks ahead by a few times the filter's memory. */
        if (batch.reached_us - job->to_us > WARM_UP_US) {
            code = SHEF_ERR_EMPTY;
            break;
        }
        shef_progress_step(&progress, (int64_t)(1000 * shef_events_source_progress(source)));
    }
    shef_progress_end(&progress);
    return code == SHEF_ERR_EMPTY ? SHEF_OK : code;
}

enum shef_err shef_moments_run(struct shef_events_source *source,
                               const struct shef_moments_params *params, shef_moment_fn *use,
                               void *context, struct shef_snapshot_stats *out_stats,
                               struct shef_error *err)
{
    struct job job = { .params = params, .use = use, .context = context };
    enum shef_err code = create_job(&job, err);

    if (code == SHEF_OK)
        code = run_job(&job, source, err);
    if (code == SHEF_OK)
        *out_stats = shef_snapshots_stats(job.snapshots);
    destroy_job(&job);
    return code;
}
