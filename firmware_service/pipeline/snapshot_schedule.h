/* When to look at the filter: turns the edges of the frame camera's exposure signal into instants.
 *
 * A rising edge makes a record: a snapshot about the middle of its exposure. Each record has one
 * or more steps, the first at mid-exposure. A falling edge gives the true exposure; if the first
 * step has not been taken it moves the middle (not before the newest event), else it goes into the
 * stated error. Where the edges come regularly, the next one is expected in advance, so that a lost
 * trigger costs a flag and some precision but no snapshot.
 *
 * Pure logic in int64 nanoseconds of event time: no clock, no memory, no threads. */
#ifndef SHEF_PIPELINE_SNAPSHOT_SCHEDULE_H
#define SHEF_PIPELINE_SNAPSHOT_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_SNAPSHOT_MAX_STEPS   5
#define SHEF_SNAPSHOT_MAX_RECORDS 8

struct shef_snapshot_schedule_params {
    int64_t exposure_ns;     /* assumed until a falling edge has been seen, 0 or more */
    int64_t exposure_err_ns; /* how wrong that may be */
    int64_t step_offsets_ns[SHEF_SNAPSHOT_MAX_STEPS]; /* after mid-exposure, growing from 0 */
    int32_t n_steps;                                  /* 1..SHEF_SNAPSHOT_MAX_STEPS */
    int32_t max_predicted; /* triggers in a row that may be predicted, 0 or more */
};

struct shef_snapshot_record {
    uint64_t number; /* of the snapshot, counting up from 0; set by its first step */
    shef_event_time rise;
    shef_event_time mid; /* as the steps use it */
    int64_t exposure_ns;
    int64_t t_err_ns;  /* bound of how far mid is from the true mid-exposure */
    bool is_predicted; /* the rising edge was not seen */
    bool has_fall;
    /* The schedule's own. */
    int32_t n_missing; /* rising edges predicted in a row, this one included */
    int32_t n_steps_done;
    int64_t mid_error_ns; /* between the middle used and the one known later */
    int64_t guess_err_ns; /* what the prediction and the assumed exposure add */
};

/* Fields are the schedule's own but for the counts. */
struct shef_snapshot_schedule {
    struct shef_snapshot_schedule_params params;
    struct shef_snapshot_record records[SHEF_SNAPSHOT_MAX_RECORDS]; /* by mid-exposure */
    int32_t n_records;
    uint64_t next_number;
    bool has_rise;
    shef_event_time last_rise; /* seen */
    int64_t interval_ns;       /* between the last two seen, 0: none yet */
    int64_t period_ns;         /* 0: not regular */
    int64_t jitter_ns;         /* of the regular intervals */
    int64_t exposure_ns;
    int64_t exposure_change_ns; /* from one exposure to the next, the largest of late */
    bool has_exposure;
    /* Read-only for others. */
    uint64_t n_rises;
    uint64_t n_irregular; /* intervals that did not fit a regular sequence */
    uint64_t n_crowded;   /* rising edges given up because SHEF_SNAPSHOT_MAX_RECORDS were open */
};

void shef_snapshot_schedule_init(struct shef_snapshot_schedule *schedule,
                                 const struct shef_snapshot_schedule_params *params);

/* Forgets all open records and the rhythm, after a jump of time. Numbers go on. */
void shef_snapshot_schedule_restart(struct shef_snapshot_schedule *schedule);

/* The exposure signal rose. */
void shef_snapshot_schedule_rise(struct shef_snapshot_schedule *schedule, shef_event_time at);

/* The exposure signal fell.
 *   newest  how far the events have been applied: no instant before it can be read any more */
void shef_snapshot_schedule_fall(struct shef_snapshot_schedule *schedule, shef_event_time at,
                                 shef_event_time newest);

struct shef_snapshot_step {
    shef_event_time at;
    int32_t record; /* index into records, valid until the next call that changes the schedule */
    int32_t step;   /* 0..n_steps - 1, or n_steps: nothing more to read, the record is complete */
};

/* What is due next. Returns false if nothing is. */
bool shef_snapshot_schedule_next(const struct shef_snapshot_schedule *schedule,
                                 struct shef_snapshot_step *out_step);

/* Begins the step that next() gave: a first step gets its number. */
struct shef_snapshot_record *shef_snapshot_schedule_begin(struct shef_snapshot_schedule *schedule,
                                                          const struct shef_snapshot_step *step);

/* Ends it: the record goes on to its next step, or leaves the schedule after the last. */
void shef_snapshot_schedule_end(struct shef_snapshot_schedule *schedule,
                                const struct shef_snapshot_step *step);

#ifdef __cplusplus
}
#endif

#endif
