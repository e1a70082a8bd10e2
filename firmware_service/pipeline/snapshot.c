#include "pipeline/snapshot.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "pipeline/snapshot_schedule.h"

/* The future half of the centred read-out: events of these intervals, in units of 1 / cutoff,
 * count with the mean of exp(-t) over their interval. Few steps correlate with the truth as well
 * as the exponential itself. */
static const double centred_ends[SHEF_SNAPSHOT_MAX_STEPS] = { 0.0, 0.5, 1.1, 2.0, 3.0 };

struct open_snapshot {
    uint64_t number;
    struct shef_snapshot *snapshot; /* NULL: free */
    struct shef_image_i16 before;   /* running sums when last looked at */
};

struct shef_snapshots {
    struct shef_snapshot_params params;
    struct shef_filter *filter;
    struct shef_hot_pixels *hot;
    struct shef_snapshot_pool *pool;
    struct shef_snapshot_schedule schedule;
    struct open_snapshot open[SHEF_SNAPSHOT_MAX_RECORDS];
    struct shef_snapshot_stats stats;
    uint32_t n_published; /* in this call */
};

struct shef_snapshot_params shef_snapshot_default_params(void)
{
    return (struct shef_snapshot_params){
        .read = SHEF_SNAPSHOT_CENTRED,
        .n_steps = SHEF_SNAPSHOT_MAX_STEPS - 1,
        .n_snapshots = 8,
        .exposure_ns = 5 * SHEF_NS_PER_MS,
        .exposure_err_ns = 5 * SHEF_NS_PER_MS,
        .max_predicted = 4,
    };
}

static enum shef_err check_params(const struct shef_snapshot_params *p, struct shef_error *err)
{
    if (p->channel < 0 || p->channel > 31)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "snapshots by trigger channel %d: there are channels 0 to 31", p->channel);
    if (p->n_steps < 1 || p->n_steps > SHEF_SNAPSHOT_MAX_STEPS - 1)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "snapshots with %d steps after mid-exposure: there can be 1 to %d",
                         p->n_steps, SHEF_SNAPSHOT_MAX_STEPS - 1);
    if (llabs(p->delay_ns) > 100 * SHEF_NS_PER_MS)
        return shef_fail(err, SHEF_ERR_INVALID, "snapshots: a delay of %lld ns is more than 100 ms",
                         (long long)p->delay_ns);
    if (p->exposure_ns < 0 || p->exposure_ns > SHEF_NS_PER_S || p->exposure_err_ns < 0 ||
        p->exposure_err_ns > SHEF_NS_PER_S)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "snapshots for exposures of %lld +- %lld ns: both must be 0 to 1 s",
                         (long long)p->exposure_ns, (long long)p->exposure_err_ns);
    if (p->max_predicted < 0 || p->max_predicted > 1000)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "snapshots for %d lost triggers in a row: it must be 0 to 1000",
                         p->max_predicted);
    return SHEF_OK;
}

static struct shef_snapshot_schedule_params schedule_params(
    const struct shef_snapshot_params *params, const struct shef_filter *filter)
{
    const int64_t lag_ns = shef_filter_lag_ns(filter);
    struct shef_snapshot_schedule_params p = {
        .exposure_ns = params->exposure_ns,
        .exposure_err_ns = params->exposure_err_ns,
        .max_predicted = params->max_predicted,
        .n_steps = 1,
    };

    if (params->read == SHEF_SNAPSHOT_LATE) {
        p.n_steps = 2;
        p.step_offsets_ns[1] = lag_ns;
    } else if (params->read == SHEF_SNAPSHOT_CENTRED) {
        p.n_steps = 1 + params->n_steps;
        for (int i = 0; i < p.n_steps; i++)
            p.step_offsets_ns[i] = llrint(centred_ends[i] * (double)lag_ns);
    }
    return p;
}

static void mask_hot_pixels(struct shef_snapshots *snapshots)
{
    const struct shef_hot_pixel *pixels;
    const uint32_t *indices;
    const uint32_t n_hot = shef_hot_pixels_list(snapshots->hot, &pixels, &indices);

    shef_filter_set_mask(snapshots->filter, indices, n_hot);
}

enum shef_err shef_snapshots_create(struct shef_snapshots **out_snapshots,
                                    struct shef_filter *filter, struct shef_hot_pixels *hot,
                                    const struct shef_snapshot_params *params,
                                    struct shef_error *err)
{
    const struct shef_filter_params *sensor = shef_filter_params(filter);
    enum shef_err code = check_params(params, err);

    if (code != SHEF_OK)
        return code;

    struct shef_snapshots *snapshots = calloc(1, sizeof *snapshots);

    if (!snapshots)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "snapshots: out of memory");
    code = shef_snapshot_pool_create(&snapshots->pool, params->n_snapshots, sensor->width_px,
                                     sensor->height_px, err);
    if (code != SHEF_OK) {
        free(snapshots);
        return code;
    }

    const struct shef_snapshot_schedule_params schedule = schedule_params(params, filter);

    snapshots->params = *params;
    snapshots->filter = filter;
    snapshots->hot = hot;
    shef_snapshot_schedule_init(&snapshots->schedule, &schedule);
    if (hot)
        mask_hot_pixels(snapshots);
    *out_snapshots = snapshots;
    return SHEF_OK;
}

void shef_snapshots_destroy(struct shef_snapshots *snapshots)
{
    if (!snapshots)
        return;
    shef_snapshot_pool_destroy(snapshots->pool);
    free(snapshots);
}

/* The open snapshot of that number, or the first free place for a number that is not open. */
static struct open_snapshot *open_of(struct shef_snapshots *snapshots, const uint64_t *number)
{
    for (int i = 0; i < SHEF_SNAPSHOT_MAX_RECORDS; i++) {
        struct open_snapshot *open = &snapshots->open[i];

        if (number ? open->snapshot && open->number == *number : !open->snapshot)
            return open;
    }
    return NULL;
}

/* The step at mid-exposure. */
static void open_snapshot(struct shef_snapshots *snapshots,
                          const struct shef_snapshot_record *record)
{
    const struct shef_filter *filter = snapshots->filter;
    struct open_snapshot *open = open_of(snapshots, NULL);

    assert(open); /* there are as many as records */
    open->snapshot = shef_snapshot_pool_begin(snapshots->pool, &open->before);
    if (!open->snapshot)
        return;
    open->number = record->number;
    open->snapshot->number = record->number;
    open->snapshot->flags = 0;
    open->snapshot->epoch = shef_filter_stats(filter).n_epochs;
    open->snapshot->n_events = shef_filter_stats(filter).n_events;
    shef_filter_read_sums(filter, open->snapshot->sums);
    if (snapshots->params.read != SHEF_SNAPSHOT_LATE)
        shef_filter_read(filter, record->mid, open->snapshot->values);
    if (snapshots->params.read == SHEF_SNAPSHOT_CENTRED)
        shef_filter_read_sums(filter, open->before);
}

/* A step after mid-exposure. */
static void continue_snapshot(struct shef_snapshots *snapshots, const struct open_snapshot *open,
                              const struct shef_snapshot_step *step)
{
    if (snapshots->params.read == SHEF_SNAPSHOT_LATE) {
        shef_filter_read(snapshots->filter, step->at, open->snapshot->values);
    } else {
        const double begin = centred_ends[step->step - 1];
        const double end = centred_ends[step->step];

        shef_filter_accrue_sums(snapshots->filter, (exp(-begin) - exp(-end)) / (end - begin),
                                open->snapshot->values, open->before);
    }
}

static void publish_snapshot(struct shef_snapshots *snapshots, struct open_snapshot *open,
                             const struct shef_snapshot_record *record)
{
    struct shef_snapshot *snapshot = open->snapshot;

    snapshot->rise = record->rise;
    snapshot->mid = record->mid;
    snapshot->exposure_ns = record->exposure_ns;
    snapshot->t_err_ns += record->t_err_ns;
    snapshot->flags |= record->is_predicted ? SHEF_SNAPSHOT_PREDICTED : 0;
    snapshot->flags |= record->has_fall ? 0 : SHEF_SNAPSHOT_NO_FALL;
    snapshots->stats.n_predicted += record->is_predicted;
    snapshots->stats.n_late += (snapshot->flags & SHEF_SNAPSHOT_LATE_TRIGGER) != 0;
    snapshots->stats.n_published++;
    snapshots->n_published++;
    shef_snapshot_pool_publish(snapshots->pool, snapshot);
    open->snapshot = NULL;
}

static void take_step(struct shef_snapshots *snapshots, const struct shef_snapshot_step *step)
{
    const struct shef_snapshot_record *record =
        shef_snapshot_schedule_begin(&snapshots->schedule, step);
    const int64_t newer_ns = shef_event_time_since(shef_filter_newest(snapshots->filter), step->at);

    if (step->step == 0)
        open_snapshot(snapshots, record);

    struct open_snapshot *open = open_of(snapshots, &record->number);

    if (open && step->step == 0) {
        /* Events after the instant were applied before anybody knew of it. */
        const bool is_late = newer_ns > 0;

        open->snapshot->flags |= is_late ? SHEF_SNAPSHOT_LATE_TRIGGER : 0;
        open->snapshot->t_err_ns = is_late ? newer_ns : 0;
    } else if (open && step->step < snapshots->schedule.params.n_steps) {
        continue_snapshot(snapshots, open, step);
    } else if (open) {
        publish_snapshot(snapshots, open, record);
    }
    shef_snapshot_schedule_end(&snapshots->schedule, step);
}

/* Ends a window of the hot pixels, now that event time has passed it. */
static void learn_hot_pixels(struct shef_snapshots *snapshots, shef_event_time passed)
{
    if (shef_hot_pixels_learn(snapshots->hot, shef_hot_pixels_due(snapshots->hot)))
        mask_hot_pixels(snapshots);
    /* After a gap: nothing to learn from the empty windows in it. */
    if (shef_event_time_before(shef_hot_pixels_due(snapshots->hot), passed))
        shef_hot_pixels_start(snapshots->hot, passed);
}

static void restart(struct shef_snapshots *snapshots)
{
    for (int i = 0; i < SHEF_SNAPSHOT_MAX_RECORDS; i++) {
        struct open_snapshot *open = &snapshots->open[i];

        if (!open->snapshot)
            continue;
        shef_snapshot_pool_cancel(snapshots->pool, open->snapshot);
        open->snapshot = NULL;
        snapshots->stats.n_dropped++;
    }
    shef_snapshot_schedule_restart(&snapshots->schedule);
    if (snapshots->hot)
        shef_hot_pixels_start(snapshots->hot, shef_filter_newest(snapshots->filter));
}

/* Does what is due before the time that has passed, the earliest first. Returns whether it did. */
static bool do_due(struct shef_snapshots *snapshots, shef_event_time passed)
{
    const shef_event_time hot_due =
        snapshots->hot ? shef_hot_pixels_due(snapshots->hot) : (shef_event_time){ INT64_MAX };
    struct shef_snapshot_step step;
    const bool has_step = shef_snapshot_schedule_next(&snapshots->schedule, &step) &&
                          shef_event_time_before(step.at, passed);

    if (has_step && !shef_event_time_before(hot_due, step.at)) {
        take_step(snapshots, &step);
        return true;
    }
    if (!shef_event_time_before(hot_due, passed))
        return false;
    learn_hot_pixels(snapshots, passed);
    return true;
}

/* The next instant at which something has to be done. */
static shef_event_time next_due(const struct shef_snapshots *snapshots)
{
    shef_event_time due =
        snapshots->hot ? shef_hot_pixels_due(snapshots->hot) : (shef_event_time){ INT64_MAX };
    struct shef_snapshot_step step;

    if (shef_snapshot_schedule_next(&snapshots->schedule, &step) &&
        shef_event_time_before(step.at, due))
        due = step.at;
    return due;
}

static shef_event_time time_of(int64_t us)
{
    return (shef_event_time){ us * SHEF_NS_PER_US };
}

/* Applies events first..end - 1 of the batch, stopping at what falls due in between. */
static void apply(struct shef_snapshots *snapshots, const struct shef_event_batch *batch,
                  uint32_t first, uint32_t end)
{
    while (first < end) {
        const uint32_t n_epochs = shef_filter_stats(snapshots->filter).n_epochs;

        if (snapshots->hot && shef_hot_pixels_due(snapshots->hot).ns == INT64_MAX)
            shef_hot_pixels_start(snapshots->hot, time_of(shef_event_batch_time_us(batch, first)));

        const uint32_t n = shef_filter_apply(snapshots->filter, batch->events + first, end - first,
                                             batch->base_us, next_due(snapshots));

        if (snapshots->hot)
            shef_hot_pixels_count(snapshots->hot, batch->events + first, n);
        first += n;
        if (shef_filter_stats(snapshots->filter).n_epochs != n_epochs)
            restart(snapshots);
        else if (first < end)
            do_due(snapshots, time_of(shef_event_batch_time_us(batch, first)));
    }
}

uint32_t shef_snapshots_feed(struct shef_snapshots *snapshots, const struct shef_event_batch *batch)
{
    const struct shef_filter_params *params = shef_filter_params(snapshots->filter);
    uint32_t n_applied = 0;

    snapshots->n_published = 0;
    for (uint32_t i = 0; i < batch->n_triggers; i++) {
        const struct shef_trigger *trigger = &batch->triggers[i];

        if (trigger->channel != snapshots->params.channel)
            continue;
        apply(snapshots, batch, n_applied, trigger->n_before);
        n_applied = trigger->n_before;
        snapshots->stats.n_triggers++;
        const shef_event_time at =
            shef_event_time_add(time_of(trigger->t_us), snapshots->params.delay_ns);

        if (trigger->rising != snapshots->params.is_inverted)
            shef_snapshot_schedule_rise(&snapshots->schedule, at);
        else
            shef_snapshot_schedule_fall(&snapshots->schedule, at,
                                        shef_filter_newest(snapshots->filter));
    }
    apply(snapshots, batch, n_applied, batch->n_events);

    /* In a quiet stream no event passes the instant, but its clock does. Events may still come as
     * far back as the filter tolerates. */
    while (do_due(snapshots, time_of(batch->reached_us - params->back_step_us)))
        ;
    return snapshots->n_published;
}

struct shef_snapshot_pool *shef_snapshots_pool(struct shef_snapshots *snapshots)
{
    return snapshots->pool;
}

struct shef_snapshot_stats shef_snapshots_stats(const struct shef_snapshots *snapshots)
{
    struct shef_snapshot_stats stats = snapshots->stats;

    stats.n_lost = shef_snapshot_pool_lost_count(snapshots->pool) + snapshots->schedule.n_crowded;
    stats.n_irregular = snapshots->schedule.n_irregular;
    stats.period_ns = snapshots->schedule.period_ns;
    stats.exposure_ns = snapshots->schedule.exposure_ns;
    return stats;
}
