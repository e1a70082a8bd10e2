#include "pipeline/snapshot_schedule.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#define RESOLUTION_NS   2000 /* 1 us of the edges' times, 1 us of the read-out's */
#define FIT             8    /* intervals are regular within an eighth */
#define MATCH           4    /* a rising edge is the predicted one within a quarter period */
#define FALL_MARGIN_NS  100000
#define MAX_EXPOSURE_NS SHEF_NS_PER_S

void shef_snapshot_schedule_init(struct shef_snapshot_schedule *schedule,
                                 const struct shef_snapshot_schedule_params *params)
{
    assert(params->n_steps >= 1 && params->n_steps <= SHEF_SNAPSHOT_MAX_STEPS);
    assert(params->step_offsets_ns[0] == 0);
    *schedule =
        (struct shef_snapshot_schedule){ .params = *params, .exposure_ns = params->exposure_ns };
}

void shef_snapshot_schedule_restart(struct shef_snapshot_schedule *schedule)
{
    schedule->n_records = 0;
    schedule->has_rise = false;
    schedule->interval_ns = 0;
    schedule->period_ns = 0;
}

static void remove_record(struct shef_snapshot_schedule *schedule, int32_t i)
{
    struct shef_snapshot_record *record = &schedule->records[i];

    schedule->n_records--;
    memmove(record, record + 1, (size_t)(schedule->n_records - i) * sizeof *record);
}

/* What the assumed exposure may be off by. */
static int64_t exposure_err_ns(const struct shef_snapshot_schedule *schedule)
{
    return schedule->has_exposure ? schedule->exposure_change_ns : schedule->params.exposure_err_ns;
}

static void add_record(struct shef_snapshot_schedule *schedule, shef_event_time rise,
                       int32_t n_missing)
{
    if (schedule->n_records == SHEF_SNAPSHOT_MAX_RECORDS) {
        schedule->n_crowded++;
        return;
    }

    const struct shef_snapshot_record record = {
        .rise = rise,
        .mid = shef_event_time_add(rise, schedule->exposure_ns / 2),
        .exposure_ns = schedule->exposure_ns,
        .is_predicted = n_missing > 0,
        .n_missing = n_missing,
        .guess_err_ns = n_missing * schedule->jitter_ns + exposure_err_ns(schedule) / 2,
    };

    schedule->records[schedule->n_records++] = record;
}

/* Expects the next rising edge a period after this one. */
static void predict(struct shef_snapshot_schedule *schedule, shef_event_time rise,
                    int32_t n_missing)
{
    if (schedule->period_ns > 0 && n_missing <= schedule->params.max_predicted)
        add_record(schedule, shef_event_time_add(rise, schedule->period_ns), n_missing);
}

/* Learns the rhythm from the interval between two rising edges that were seen. */
static void learn_interval(struct shef_snapshot_schedule *schedule, int64_t interval_ns)
{
    if (schedule->period_ns > 0) {
        /* Edges may be missing in between. */
        const int64_t n_periods = (interval_ns + schedule->period_ns / 2) / schedule->period_ns;
        const int64_t off_ns =
            n_periods > 0 ? llabs(interval_ns / n_periods - schedule->period_ns) : INT64_MAX;

        if (off_ns <= schedule->period_ns / FIT) {
            const int64_t faded_ns = schedule->jitter_ns * 7 / 8;

            schedule->jitter_ns = off_ns > faded_ns ? off_ns : faded_ns;
            schedule->period_ns += (interval_ns / n_periods - schedule->period_ns) / 8;
            schedule->interval_ns = interval_ns / n_periods;
            return;
        }
        schedule->n_irregular++;
        schedule->period_ns = 0;
    } else if (schedule->interval_ns > 0) {
        const int64_t off_ns = llabs(interval_ns - schedule->interval_ns);

        if (off_ns <= interval_ns / FIT) {
            schedule->period_ns = interval_ns;
            schedule->jitter_ns = off_ns;
        }
    }
    schedule->interval_ns = interval_ns;
}

/* The predicted record that this rising edge belongs to, or -1. */
static int32_t predicted_record(const struct shef_snapshot_schedule *schedule, shef_event_time at)
{
    for (int32_t i = schedule->n_records - 1; i >= 0; i--) {
        const struct shef_snapshot_record *record = &schedule->records[i];
        const int64_t off_ns = llabs(shef_event_time_since(at, record->rise));

        if (record->is_predicted && off_ns <= schedule->period_ns / MATCH)
            return i;
    }
    return -1;
}

/* The record's rising edge has been seen after all. */
static void confirm(struct shef_snapshot_schedule *schedule, struct shef_snapshot_record *record,
                    shef_event_time at)
{
    const shef_event_time mid = shef_event_time_add(at, schedule->exposure_ns / 2);

    record->rise = at;
    record->is_predicted = false;
    record->n_missing = 0;
    record->exposure_ns = schedule->exposure_ns;
    record->guess_err_ns = exposure_err_ns(schedule) / 2;
    if (record->n_steps_done == 0)
        record->mid = mid;
    record->mid_error_ns = shef_event_time_since(mid, record->mid);
}

void shef_snapshot_schedule_rise(struct shef_snapshot_schedule *schedule, shef_event_time at)
{
    const int64_t interval_ns = shef_event_time_since(at, schedule->last_rise);

    schedule->n_rises++;
    if (schedule->has_rise && interval_ns <= 0)
        return; /* doubled, or time went back: the first one counts */

    const int32_t predicted = predicted_record(schedule, at);

    if (schedule->has_rise)
        learn_interval(schedule, interval_ns);
    schedule->has_rise = true;
    schedule->last_rise = at;
    if (predicted >= 0)
        confirm(schedule, &schedule->records[predicted], at);
    /* What else was expected starts from here now. */
    for (int32_t i = schedule->n_records - 1; i >= 0; i--)
        if (schedule->records[i].is_predicted && schedule->records[i].n_steps_done == 0)
            remove_record(schedule, i);
    if (predicted < 0)
        add_record(schedule, at, 0);
    predict(schedule, at, 1);
}

/* Learns the exposure from a pair of edges that were both seen. */
static void learn_exposure(struct shef_snapshot_schedule *schedule, shef_event_time fall)
{
    const int64_t exposure_ns = shef_event_time_since(fall, schedule->last_rise);

    if (!schedule->has_rise || exposure_ns <= 0 || exposure_ns > MAX_EXPOSURE_NS ||
        (schedule->period_ns > 0 && exposure_ns > schedule->period_ns))
        return;
    if (schedule->has_exposure) {
        const int64_t change_ns = llabs(exposure_ns - schedule->exposure_ns);
        const int64_t faded_ns = schedule->exposure_change_ns * 7 / 8;

        schedule->exposure_change_ns = change_ns > faded_ns ? change_ns : faded_ns;
    }
    schedule->exposure_ns = exposure_ns;
    schedule->has_exposure = true;
}

void shef_snapshot_schedule_fall(struct shef_snapshot_schedule *schedule, shef_event_time at,
                                 shef_event_time newest)
{
    struct shef_snapshot_record *record = NULL;

    for (int32_t i = schedule->n_records - 1; i >= 0 && !record; i--)
        if (!schedule->records[i].has_fall && shef_event_time_before(schedule->records[i].rise, at))
            record = &schedule->records[i];

    /* A rising edge that was not seen does not tell the exposure. */
    if (!record || !record->is_predicted)
        learn_exposure(schedule, at);
    if (!record || shef_event_time_since(at, record->rise) > MAX_EXPOSURE_NS)
        return;
    if (record->is_predicted) {
        record->rise = shef_event_time_add(at, -record->exposure_ns);
        record->guess_err_ns = exposure_err_ns(schedule) / 2;
    } else {
        record->exposure_ns = shef_event_time_since(at, record->rise);
        record->guess_err_ns = 0;
    }
    record->has_fall = true;

    const shef_event_time mid = shef_event_time_add(record->rise, record->exposure_ns / 2);

    if (record->n_steps_done == 0)
        record->mid = shef_event_time_before(mid, newest) ? newest : mid;
    record->mid_error_ns = shef_event_time_since(mid, record->mid);
}

/* When the record has nothing more to do, or to wait for: its falling edge may come as late as the
 * exposure may be wrong. */
static shef_event_time completion(const struct shef_snapshot_schedule *schedule,
                                  const struct shef_snapshot_record *record)
{
    const struct shef_snapshot_schedule_params *p = &schedule->params;
    const shef_event_time read =
        shef_event_time_add(record->mid, p->step_offsets_ns[p->n_steps - 1]);
    const shef_event_time fall = shef_event_time_add(
        record->rise, record->exposure_ns + exposure_err_ns(schedule) + FALL_MARGIN_NS);

    return record->has_fall || shef_event_time_before(fall, read) ? read : fall;
}

/* Snapshots are completed in the order of their numbers. */
static shef_event_time completion_in_order(const struct shef_snapshot_schedule *schedule,
                                           const struct shef_snapshot_record *record)
{
    shef_event_time at = completion(schedule, record);

    for (int32_t i = 0; i < schedule->n_records; i++) {
        const struct shef_snapshot_record *other = &schedule->records[i];

        if (other->n_steps_done > 0 && other->number < record->number &&
            shef_event_time_before(at, completion(schedule, other)))
            at = completion(schedule, other);
    }
    return at;
}

bool shef_snapshot_schedule_next(const struct shef_snapshot_schedule *schedule,
                                 struct shef_snapshot_step *out_step)
{
    uint64_t number = 0;
    bool is_found = false;

    for (int32_t i = 0; i < schedule->n_records; i++) {
        const struct shef_snapshot_record *record = &schedule->records[i];
        const int32_t step = record->n_steps_done;
        const shef_event_time at =
            step < schedule->params.n_steps
                ? shef_event_time_add(record->mid, schedule->params.step_offsets_ns[step])
                : completion_in_order(schedule, record);

        if (!is_found || shef_event_time_before(at, out_step->at) ||
            (at.ns == out_step->at.ns && record->number < number)) {
            *out_step = (struct shef_snapshot_step){ .at = at, .record = i, .step = step };
            number = record->number;
            is_found = true;
        }
    }
    return is_found;
}

struct shef_snapshot_record *shef_snapshot_schedule_begin(struct shef_snapshot_schedule *schedule,
                                                          const struct shef_snapshot_step *step)
{
    struct shef_snapshot_record *record = &schedule->records[step->record];

    if (step->step == 0)
        record->number = schedule->next_number++;
    record->t_err_ns = RESOLUTION_NS + llabs(record->mid_error_ns) + record->guess_err_ns;
    return record;
}

void shef_snapshot_schedule_end(struct shef_snapshot_schedule *schedule,
                                const struct shef_snapshot_step *step)
{
    struct shef_snapshot_record *record = &schedule->records[step->record];

    if (step->step == schedule->params.n_steps) {
        remove_record(schedule, step->record);
        return;
    }
    record->n_steps_done++;
    /* A predicted edge that was used up was lost: the next one is expected after it. */
    if (step->step == 0 && record->is_predicted)
        predict(schedule, record->rise, record->n_missing + 1);
}
