/* Which snapshot belongs to which frame: by time gaps, never by counting.
 *
 * The frame camera stamps frames with its own clock, the event camera stamps the exposure signal
 * with its own. The offset between the two is unknown, their rates differ by some 1e-5, the
 * camera's stamps may come in steps of 125 us, and frames and triggers get lost. So:
 *
 *   start   Every offset that lays the first frames on snapshots is tried. What does not fit
 *           counts against it: frames without a snapshot, snapshots without a frame (before the
 *           first pair only where both streams are known to begin together), an arrival before
 *           the exposure, and how far the smallest delay of arrival is from the calibrated one.
 *           A train of triggers without gaps fits at every shift by a period: then only the last
 *           three decide, and where they do not, the result says it is ambiguous.
 *   track   From the last pair on, the camera's clock predicts the trigger of the next frame; the
 *           snapshot nearest to that is taken if it lies within the gate. A lost frame or trigger
 *           therefore costs itself and no other. The rate is learnt over 5 to 10 s.
 *   again   After a run of frames that fit nothing though there are snapshots, or when a clock
 *           steps back, it starts anew. A gap in the events is bridged.
 *
 * Frames may arrive before or after their snapshots and wait here, in their order.
 *
 * Error bound: a pair's time is the snapshot's, with the snapshot's own bound (t_err_ns). That the
 * pair is the right one is not in that bound: a wrong one is off by whole periods, which the start
 * rules out unless it is flagged SHEF_PAIRING_AMBIGUOUS. A frame whose trigger was lost gets the
 * predicted time, to within the gate and max_skew times the time since the last pair.
 *
 * Pure logic in the caller's memory: no clock, no allocation. Thread: one at a time. */
#ifndef SHEF_PIPELINE_PAIRING_H
#define SHEF_PIPELINE_PAIRING_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_PAIRING_MAX_FRAMES    128 /* that wait */
#define SHEF_PAIRING_MAX_SNAPSHOTS 256 /* that are remembered */

struct shef_pairing_params {
    int64_t gate_ns;          /* a trigger this close to the predicted time is the frame's; more
                               * than two steps of the camera's clock, far below a period */
    double max_skew;          /* the rates of the two clocks differ by less than this */
    int64_t wait_ns;          /* a frame waits this long after its arrival for its snapshot */
    int64_t latency_ns;       /* calibrated: smallest time from start of exposure to arrival */
    int64_t latency_sigma_ns; /* 0: latency_ns is not known */
    int64_t max_latency_ns;   /* no frame arrives later than this */
    int32_t n_start;          /* frames that must fit before the first pair is made, 3..64 */
    int32_t n_decide;         /* and before shifts are told apart by the delay of arrival alone */
    int32_t n_lost;           /* frames in a row that fit nothing before it starts anew */
    bool begins_together;     /* the first frame given is the first one exposed, and the first
                               * snapshot the first one due: what has no partner before the first
                               * pair counts against a shift. Wrong if just that frame or trigger
                               * was lost, so the delay of arrival, if calibrated, counts more */
};

/* 300 us, 100 ppm, 100 ms, unknown latency of at most 250 ms; 4, 48 and 6 frames; begins
 * together. */
struct shef_pairing_params shef_pairing_default_params(void);

/* A snapshot, as far as pairing needs it. */
struct shef_pairing_snapshot {
    uint64_t number;
    shef_event_time rise; /* of the exposure signal */
    shef_event_time mid;
    int64_t t_err_ns;    /* bound of mid's error */
    bool has_host;       /* the next is known: */
    shef_host_time host; /* when event time was at rise, by the host's clock */
};

struct shef_pairing_frame {
    uint64_t tag; /* the caller's name for it */
    shef_frame_time camera;
    bool has_host; /* the next is known: */
    shef_host_time arrived;
};

#define SHEF_PAIRING_AMBIGUOUS (1u << 0) /* other shifts by whole periods fit as well */

enum shef_pairing_kind {
    SHEF_PAIRING_PAIR,    /* snapshot is the frame's */
    SHEF_PAIRING_NO_EDGE, /* its trigger was lost: rise and mid are predicted */
    SHEF_PAIRING_UNKNOWN, /* nothing is known about its time */
};

struct shef_pairing_result {
    uint64_t tag;
    enum shef_pairing_kind kind;
    uint64_t snapshot;    /* its number */
    shef_event_time rise; /* of PAIR and NO_EDGE */
    shef_event_time mid;
    int64_t t_err_ns;    /* bound of mid's error */
    int64_t residual_ns; /* of PAIR: rise minus what the camera's clock predicted */
    uint32_t flags;
};

struct shef_pairing_stats {
    uint64_t n_pairs;
    uint64_t n_no_edge;
    uint64_t n_unknown;
    uint64_t n_skipped; /* snapshots passed over: their frames were lost */
    uint64_t n_starts;  /* how often an offset was found */
    double skew;        /* event clock's rate over the camera's, minus 1 */
    double residual_rms_ns;
};

/* A pair: the frame's time and the rise of its trigger. */
struct shef_pairing_anchor {
    shef_frame_time camera;
    shef_event_time event;
};

/* Fields are the pairing's own. */
struct shef_pairing {
    struct shef_pairing_params params;
    struct shef_pairing_snapshot snapshots[SHEF_PAIRING_MAX_SNAPSHOTS]; /* ring, by rise */
    uint32_t first_snapshot;
    uint32_t n_snapshots;
    struct shef_pairing_frame frames[SHEF_PAIRING_MAX_FRAMES]; /* ring, by camera time */
    uint32_t first_frame;
    uint32_t n_frames;
    bool is_complete;   /* nothing more will come */
    bool is_from_start; /* params.begins_together still holds */
    bool is_locked;
    bool is_ambiguous;
    struct shef_pairing_anchor last; /* pair */
    struct shef_pairing_anchor base; /* pair at least 5 s before it, or the first */
    struct shef_pairing_anchor next_base;
    int64_t exposure_half_ns; /* mid minus rise, of the last pair */
    bool has_skipped_from;
    uint64_t skip_from; /* snapshots after this number are not yet accounted for */
    int32_t n_misses;   /* in a row */
    uint32_t n_tried;   /* frames and snapshots at the last failed start */
    double sum_square_ns2;
    struct shef_pairing_stats stats;
};

void shef_pairing_init(struct shef_pairing *pairing, const struct shef_pairing_params *params);

/* The frame camera was opened anew: its clock and the offset are unknown again. Waiting frames are
 * dropped. */
void shef_pairing_restart(struct shef_pairing *pairing);

/* Starts with an offset that is known beforehand, so that no frame has to wait for others to find
 * it: of a recording that has been looked at before. As soon as that proves wrong it starts anew.
 *   known         a pair, at or before the next frame; it need not come again
 *   is_ambiguous  results are to be flagged as SHEF_PAIRING_AMBIGUOUS */
void shef_pairing_lock(struct shef_pairing *pairing, const struct shef_pairing_anchor *known,
                       bool is_ambiguous);

/* Adds a snapshot, in the order of their numbers. The oldest is forgotten when there is no room.
 * A rise that is not after the one before it means that event time has jumped: starts anew. */
void shef_pairing_add_snapshot(struct shef_pairing *pairing,
                               const struct shef_pairing_snapshot *snapshot);

/* Adds a frame, in the order of their camera times; a time that steps back starts anew.
 * SHEF_ERR_FULL: take() first; a full pairing always has a result. */
SHEF_MUST_CHECK enum shef_err shef_pairing_add_frame(struct shef_pairing *pairing,
                                                     const struct shef_pairing_frame *frame);

/* Nothing more will come: everything that waits is decided. */
void shef_pairing_finish(struct shef_pairing *pairing);

/* The next frame whose snapshot is decided, in the order of the frames.
 *   now  frames that have waited too long are decided; of frames that came without a host time
 *        none has
 * SHEF_ERR_EMPTY: none is decided. */
SHEF_MUST_CHECK enum shef_err shef_pairing_take(struct shef_pairing *pairing, shef_host_time now,
                                                struct shef_pairing_result *out_result);

struct shef_pairing_stats shef_pairing_stats(const struct shef_pairing *pairing);

#ifdef __cplusplus
}
#endif

#endif
