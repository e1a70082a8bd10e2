/* A whole recording through the offline chain: events, filter, snapshots, pairing, frames, depth.
 *
 * The same parts as in the live service, in the order of event time. Several modes may run side by
 * side on the same snapshots. What is missing or damaged is left out and becomes a note; every
 * frame that has a snapshot is processed. Thread: main (with worker threads). */
#ifndef SHEFTOOL_RUN_CHAIN_H
#define SHEFTOOL_RUN_CHAIN_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/calibration.h"
#include "core/error.h"
#include "core/workers.h"
#include "pipeline/depth_chain.h"
#include "pipeline/pairing.h"
#include "pipeline/snapshot.h"
#include "record/recorded_frames.h"

#define SHEF_RUN_MAX_NOTES 48

struct shef_run_settings {
    const char *recording;
    const char *calibration; /* file; NULL: the recording's */
    const char *profile;     /* "wide" or "paper"; NULL: the calibration's */
    enum shef_depth_mode modes[SHEF_DEPTH_N_MODES];
    int32_t n_modes;
    bool ignores_robot;             /* velocities are not used though they were recorded */
    bool needs_robot;               /* fails where they were not */
    struct shef_depth_params depth; /* mode and profile are not used */
    enum shef_snapshot_read read;
    int32_t look_ahead;     /* n_steps of the centred read-out, 1..4 */
    int64_t extra_delay_ns; /* added to the calibrated ones, for studies of timing errors */
    int64_t max_frames;     /* stop after so many; 0: all */
    int32_t n_threads;
    uint32_t cpu_features;
};

/* One frame, as the consumer sees it; everything is valid during the call only. */
struct shef_run_frame {
    const struct shef_recorded_frame *frame;
    const struct shef_pairing_result *pairing;
    const struct shef_snapshot *snapshot;
    int32_t mode; /* index into the settings' modes */
    const struct shef_depth_chain *chain;
    const struct shef_depth_input *input;
    const struct shef_depth_output *output; /* with dense images */
    const struct shef_depth_report *report;
};

typedef enum shef_err shef_run_frame_fn(void *context, const struct shef_run_frame *frame,
                                        struct shef_error *err);

struct shef_run;

struct shef_run_counts {
    uint32_t n_frames; /* in the recording, by its indexes */
    uint32_t n_processed;
    uint32_t n_damaged;   /* their bytes could not be read */
    uint32_t n_unpaired;  /* without a snapshot: their trigger or its events are missing */
    uint32_t n_ambiguous; /* paired, but other shifts by whole periods fit as well */
    uint32_t n_with_velocity;
    struct shef_snapshot_stats snapshots;
    struct shef_pairing_stats pairing;
};

/* Opens the recording and allocates.
 *   settings  kept
 * SHEF_ERR_NOT_FOUND: it has no frames, events or calibration; the sentence says which. Errors of
 * the readers and of shef_depth_chain_create(). */
SHEF_MUST_CHECK enum shef_err shef_run_open(struct shef_run **out_run,
                                            const struct shef_run_settings *settings,
                                            struct shef_error *err);

const struct shef_calibration *shef_run_calibration(const struct shef_run *run);
const char *shef_run_profile(const struct shef_run *run);
uint32_t shef_run_n_frames(const struct shef_run *run); /* in the recording */
struct shef_depth_geometry shef_run_geometry(const struct shef_run *run);
bool shef_run_has_robot(const struct shef_run *run);
size_t shef_run_memory_bytes(const struct shef_run *run); /* of the first mode's chain */

/* Runs everything and calls `use` for each frame and mode, in order.
 * Errors of reading, of `use`, or SHEF_ERR_GONE: stopped by a signal. */
SHEF_MUST_CHECK enum shef_err shef_run_all(struct shef_run *run, shef_run_frame_fn *use,
                                           void *context, struct shef_error *err);

struct shef_run_counts shef_run_counts(const struct shef_run *run);

/* The i-th note, one sentence about what is odd; NULL behind the last. Complete after all(). */
const char *shef_run_note(const struct shef_run *run, int i);

/* NULL is allowed. */
void shef_run_close(struct shef_run *run);

#endif
