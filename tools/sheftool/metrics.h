/* Error figures of disparity maps against the truth, gathered pixel by pixel.
 *
 * All disparities are in px, 0 = none. A tally holds pooled sums over any number of pixels; the
 * RMSE alone is an average over images of the per-image RMSE (the authors' evaluation does it so).
 * Tallies of disjoint images can be merged. Pure arithmetic, no allocation. Thread: one a tally. */
#ifndef SHEFTOOL_METRICS_H
#define SHEFTOOL_METRICS_H

#include <stdint.h>

/* |error| above which a pixel is bad, px. bad-p of the paper is the last (Wang 2021, sec. V: 5 px
 * or 5 %; with truth up to 80 px, 5 % is at most 4 px, so the pixels decide). */
#define SHEF_N_BAD 4
extern const double shef_bad_px[SHEF_N_BAD]; /* 1, 2, 3, 5 */

/* delta_i counts max(d / truth, truth / d) < 1.25^i. */
#define SHEF_N_DELTAS 3

#define SHEF_N_CONFIDENCE_BINS 10
#define SHEF_CONFIDENT_PX      3.0 /* a confidence is the probability of |error| <= 3 px */

/* Depth errors are rounded to 0.01 cm and counted, up to 10 m, so that medians can be merged. */
#define SHEF_N_DEPTH_BINS 100000
#define SHEF_DEPTH_BIN_CM 0.01

struct shef_depth_counts {
    uint32_t n[SHEF_N_DEPTH_BINS]; /* the last bin takes everything above */
};

struct shef_confidence_bin {
    int64_t n;
    int64_t n_hits;      /* |error| <= SHEF_CONFIDENT_PX */
    double sum_promised; /* of the confidences */
};

struct shef_tally {
    /* Pooled over pixels. */
    int64_t n_scored;
    int64_t n_bad[SHEF_N_BAD];
    int64_t n_within[SHEF_N_DELTAS];
    double sum_abs_px;
    struct shef_confidence_bin confidence[SHEF_N_CONFIDENCE_BINS];
    /* Pixels that an ideal method would have given an estimate for, and those that have one. */
    int64_t n_wanted;
    int64_t n_found;
    /* Per image. */
    int64_t n_images;        /* seen */
    int64_t n_images_scored; /* with at least one scored pixel: only they have an RMSE */
    double sum_rmse_px;
    /* The image under way. */
    int64_t n_image_scored;
    double sum_square_px2;
    /* Optional, zeroed by the caller, not owned; NULL: no depth figures. */
    struct shef_depth_counts *depth;
};

/* The rectified rig, for depths: Z = focal_px * baseline_m / disparity. */
struct shef_rig {
    double focal_px;
    double baseline_m;
};

/* Scores one pixel.
 *   estimate, truth  px, above 0
 *   confidence       0..1; negative: none was given */
void shef_tally_add(struct shef_tally *tally, float estimate, float truth, float confidence,
                    const struct shef_rig *rig);

/* Counts one pixel that should have an estimate. */
void shef_tally_want(struct shef_tally *tally, int found);

/* Closes an image: its RMSE joins the average. Call it once per image, also for empty ones. */
void shef_tally_end_image(struct shef_tally *tally);

/* Adds the closed images of `from`. depth is merged if both have it. */
void shef_tally_merge(struct shef_tally *into, const struct shef_tally *from);

/* What a reader wants to know; NaN where nothing was counted. Shares are 0..1. */
struct shef_figures {
    double rmse_px;
    double epe_px; /* mean |error|, pooled */
    double bad[SHEF_N_BAD];
    double delta[SHEF_N_DELTAS];
    double coverage;          /* n_found / n_wanted */
    double calibration_error; /* expected |promised - kept| of the confidence */
    double depth_median_cm;   /* of |Z(estimate) - Z(truth)| */
    double pixels_per_image;
};

struct shef_figures shef_tally_figures(const struct shef_tally *tally);

#endif
