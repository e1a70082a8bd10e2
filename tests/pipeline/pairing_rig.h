/* Frames and snapshots of a rig whose clocks differ and that loses some of both, put through the
 * pairing, and what came of each.
 *
 * Thread: the test's own. */
#ifndef SHEF_TESTS_PAIRING_RIG_H
#define SHEF_TESTS_PAIRING_RIG_H

#include <stdbool.h>
#include <stdint.h>

#include "pipeline/pairing.h"
#include "support/support.h"

#define PAIRING_RIG_MAX_N   4096
#define PAIRING_NO_SNAPSHOT UINT64_MAX

/* A frame camera that drives the event camera's trigger input, and what gets lost on the way. */
struct pairing_rig {
    int32_t n;
    int64_t period_ns;
    double skew; /* of the event clock over the camera's */
    int64_t offset_ns;
    int64_t quantum_ns; /* of the camera's stamps; 1: none */
    double frame_loss;
    double trigger_loss;
    double predicted_share; /* of lost triggers that the schedule makes up for */
    double skipped_share;   /* of exposures that the trigger source leaves out: a code */
    int64_t least_delay_ns; /* of a frame's arrival after its exposure began */
    int64_t late_ns;        /* uniform, more, */
    double late_share;      /* of the frames */
    int64_t snapshot_delay_ns;
    bool has_host;
};

/* 600 exposures at 54 Hz, of which nothing gets lost. */
extern const struct pairing_rig pairing_rig_plain;

/* One exposure: what came of it. */
struct pairing_exposure {
    int64_t true_ns; /* host time of its start */
    bool has_frame;
    bool has_snapshot;
    bool is_predicted;
    struct shef_pairing_frame frame;
    struct shef_pairing_snapshot snapshot;
    int64_t ready_ns; /* the snapshot */
};

/* What was made last and what came of it, by tag: the number of the exposure. */
extern struct pairing_played {
    struct pairing_exposure exposures[PAIRING_RIG_MAX_N];
    uint64_t snapshot_of[PAIRING_RIG_MAX_N]; /* number, or PAIRING_NO_SNAPSHOT */
    struct shef_pairing pairing;
    struct shef_pairing_result results[PAIRING_RIG_MAX_N];
    bool has_result[PAIRING_RIG_MAX_N];
} played;

struct pairing_verdict {
    int32_t n_frames;
    int32_t n_right;   /* with their snapshot */
    int32_t n_none;    /* rightly without one */
    int32_t n_missed;  /* without one, but it was there */
    int32_t n_wrong;   /* with another's */
    int32_t n_flagged; /* as ambiguous */
};

/* Draws the exposures. */
void pairing_rig_make(const struct pairing_rig *rig, struct shef_test_random *random);

/* Plays everything in the order in which it happens, from exposure first_frame of the frames on. */
void pairing_rig_play(const struct pairing_rig *rig, const struct shef_pairing_params *params,
                      int32_t first_frame);

/* Parts of that: one snapshot or frame is added, and all results are taken. */
void pairing_rig_add_snapshot(const struct pairing_exposure *e);
void pairing_rig_add_frame(const struct pairing_exposure *e);
void pairing_rig_take_all(int64_t now_ns);

/* Every frame from first_frame on must have its result. */
struct pairing_verdict pairing_rig_judge(const struct pairing_rig *rig, int32_t first_frame);

/* All of it; the random numbers go on from one call to the next. */
struct pairing_verdict pairing_rig_run(const struct pairing_rig *rig,
                                       const struct shef_pairing_params *params);

#endif
