/* Scores depth maps of a simulated recording against its truth.
 *
 * Scored pixels: of each frame's true rectified left view, the pixels whose Sobel gradient is among
 * the strongest 25 % (the unsigned map of pipeline/frame_edges.h), where the truth is valid and the
 * event camera sees the same place. All of them count: where there is no estimate, it is bad.
 *
 *   bad-1, bad-2   share with |error| > 1 or 2 px of f 555 px, or without an estimate
 *   depth error    median of |Z - Z_true| / Z_true; no estimate counts as infinitely far off
 *   bias           median of (Z - Z_true) / Z_true: + is too far
 *   confident      the same of the most confident 75 % of each frame's scored pixels
 *   away           of the pixels more than 5 px from a depth jump: neighbours whose true
 *                  disparities differ by more than 0.5 px
 *   directions     frames by where the camera moves to, in the picture: the larger of |vx| and |vy|
 *
 * Estimates of another calibration than the true one are taken to the true view through the raw
 * frame, and compared there as depth. Thread: main. */
#ifndef SHEFTOOL_RUN_SCORE_H
#define SHEFTOOL_RUN_SCORE_H

#include <jansson.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/depth_chain.h"
#include "record/recorded_frames.h"
#include "record/recorded_truth.h"

#define SHEF_RUN_ERROR_BINS   10001 /* of 0.01 % */
#define SHEF_RUN_ERROR_BIN    1e-4
#define SHEF_RUN_N_CONFIDENCE 10

/* Pooled counts over any number of frames. */
struct shef_run_part {
    int64_t n_scored;
    int64_t n_found;
    int64_t n_bad_1;
    int64_t n_bad_2;
    double sum_abs_px;                         /* of f 555 px, of those found */
    int64_t n_good;                            /* |error| <= 1 px */
    double sum_good_signed;                    /* relative depth errors of these */
    uint32_t size[SHEF_RUN_ERROR_BINS];        /* |relative depth error|, the last for more */
    uint32_t signed_size[SHEF_RUN_ERROR_BINS]; /* from -50 % to +50 % */
};

enum shef_run_direction {
    SHEF_RUN_LEFT,
    SHEF_RUN_RIGHT,
    SHEF_RUN_UP,
    SHEF_RUN_DOWN,
    SHEF_RUN_STILL,
    SHEF_RUN_N_DIRECTIONS,
};

const char *shef_run_direction_name(enum shef_run_direction direction);

struct shef_run_tally {
    struct shef_run_part all;
    struct shef_run_part confident;
    struct shef_run_part away;
    struct shef_run_part by_direction[SHEF_RUN_N_DIRECTIONS];
    struct {
        int64_t n;
        int64_t n_good; /* |error| <= 1 px */
        double sum_confidence;
    } confidence[SHEF_RUN_N_CONFIDENCE];
    int64_t n_within_sigma; /* of all.n_good */
    int64_t n_frames;
};

/* Figures of a part; NaN where nothing was scored. Shares and relative errors are 0..1. */
struct shef_run_figures {
    double bad_1;
    double bad_2;
    double epe_px;
    double depth_error;
    double bias;
    double mean_bias; /* mean relative depth error of those within 1 px */
    double coverage;
};

struct shef_run_figures shef_run_part_figures(const struct shef_run_part *part);

/* Mean |promised - kept| of the confidences, weighted by their number. */
double shef_run_calibration_error(const struct shef_run_tally *tally);

/* Share of good depths (|error| <= 1 px) within one sigma; NaN where there are none. */
double shef_run_within_sigma(const struct shef_run_tally *tally);

/* Adds all of another tally. */
void shef_run_tally_merge(struct shef_run_tally *into, const struct shef_run_tally *from);

struct shef_run_scorer;

/* Opens the recording's truth and frames.
 *   geometry     of the estimates
 *   calibration  they were made with
 *   profile      "wide" or "paper"
 * SHEF_ERR_NOT_FOUND: it has no truth. SHEF_ERR_INVALID: the truth is of another profile. */
SHEF_MUST_CHECK enum shef_err shef_run_scorer_open(struct shef_run_scorer **out_scorer,
                                                   const char *recording,
                                                   const struct shef_calibration *calibration,
                                                   const char *profile, struct shef_error *err);

/* Loads what is needed for one frame.
 *   number  the camera's
 * SHEF_ERR_NOT_FOUND: there is no truth of it. */
SHEF_MUST_CHECK enum shef_err shef_run_scorer_load(struct shef_run_scorer *scorer, uint64_t number,
                                                   struct shef_error *err);

/* One frame's estimates in their own view; confidence and sigma may have no data. */
struct shef_run_estimate {
    struct shef_image_f32 disparity; /* px, 0 = none */
    struct shef_image_f32 confidence;
    struct shef_image_f32 sigma_m;
};

/* Scores estimates of the loaded frame.
 * SHEF_ERR_NO_MEMORY: the tally is unchanged. */
SHEF_MUST_CHECK enum shef_err shef_run_scorer_add(struct shef_run_scorer *scorer,
                                                  const struct shef_run_estimate *estimate,
                                                  struct shef_run_tally *tally,
                                                  struct shef_error *err);

/* Of the loaded frame, valid until the next: true disparities, 0 where nothing is scored, and what
 * add() found there last, in the same view. For pictures. */
struct shef_image_f32 shef_run_scorer_truth(const struct shef_run_scorer *scorer);
struct shef_image_f32 shef_run_scorer_everywhere(const struct shef_run_scorer *scorer);
struct shef_image_f32 shef_run_scorer_estimate(const struct shef_run_scorer *scorer);
enum shef_run_direction shef_run_scorer_direction(const struct shef_run_scorer *scorer);
/* True velocity of the left camera in rectified axes, m/s. */
const double *shef_run_scorer_velocity(const struct shef_run_scorer *scorer);

/* NULL is allowed. */
void shef_run_scorer_close(struct shef_run_scorer *scorer);

/* Everything as JSON, with the counts that it takes to pool tallies of several files: `sizes` are
 * pixels by |relative depth error| from 0 in steps of bin_percent, `signed_sizes` by the error with
 * its sign from -50 %; the last count is of all that is larger. NULL: out of memory. */
json_t *shef_run_tally_json(const struct shef_run_tally *tally);

#endif
