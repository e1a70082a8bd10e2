#include "sheftool/metrics.h"

#include <assert.h>
#include <math.h>

const double shef_bad_px[SHEF_N_BAD] = { 1, 2, 3, 5 };

static const double delta_limits[SHEF_N_DELTAS] = { 1.25, 1.25 * 1.25, 1.25 * 1.25 * 1.25 };

static void add_confidence(struct shef_tally *tally, double confidence, double error_px)
{
    int bin = (int)(confidence * SHEF_N_CONFIDENCE_BINS);

    if (bin > SHEF_N_CONFIDENCE_BINS - 1)
        bin = SHEF_N_CONFIDENCE_BINS - 1;
    tally->confidence[bin].n++;
    tally->confidence[bin].n_hits += error_px <= SHEF_CONFIDENT_PX;
    tally->confidence[bin].sum_promised += confidence;
}

static void add_depth(struct shef_depth_counts *depth, double estimate_px, double truth_px,
                      const struct shef_rig *rig)
{
    const double bf_px_cm = rig->focal_px * rig->baseline_m * 100.0;
    const double error_cm = fabs(bf_px_cm / estimate_px - bf_px_cm / truth_px);
    const double bin = error_cm / SHEF_DEPTH_BIN_CM + 0.5;

    depth->n[bin < SHEF_N_DEPTH_BINS - 1 ? (int)bin : SHEF_N_DEPTH_BINS - 1]++;
}

void shef_tally_add(struct shef_tally *tally, float estimate, float truth, float confidence,
                    const struct shef_rig *rig)
{
    assert(estimate > 0 && truth > 0 && confidence <= 1);

    const double error_px = fabs((double)estimate - (double)truth);
    const double ratio =
        estimate > truth ? (double)estimate / (double)truth : (double)truth / (double)estimate;

    tally->n_scored++;
    tally->n_image_scored++;
    tally->sum_abs_px += error_px;
    tally->sum_square_px2 += error_px * error_px;
    for (int i = 0; i < SHEF_N_BAD; i++)
        tally->n_bad[i] += error_px > shef_bad_px[i];
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        tally->n_within[i] += ratio < delta_limits[i];
    if (confidence >= 0)
        add_confidence(tally, confidence, error_px);
    if (tally->depth)
        add_depth(tally->depth, estimate, truth, rig);
}

void shef_tally_want(struct shef_tally *tally, int found)
{
    tally->n_wanted++;
    tally->n_found += found != 0;
}

void shef_tally_end_image(struct shef_tally *tally)
{
    tally->n_images++;
    if (tally->n_image_scored > 0) {
        tally->n_images_scored++;
        tally->sum_rmse_px += sqrt(tally->sum_square_px2 / (double)tally->n_image_scored);
    }
    tally->n_image_scored = 0;
    tally->sum_square_px2 = 0;
}

void shef_tally_merge(struct shef_tally *into, const struct shef_tally *from)
{
    assert(from->n_image_scored == 0 && "only closed images can be merged");

    into->n_scored += from->n_scored;
    for (int i = 0; i < SHEF_N_BAD; i++)
        into->n_bad[i] += from->n_bad[i];
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        into->n_within[i] += from->n_within[i];
    into->sum_abs_px += from->sum_abs_px;
    for (int i = 0; i < SHEF_N_CONFIDENCE_BINS; i++) {
        into->confidence[i].n += from->confidence[i].n;
        into->confidence[i].n_hits += from->confidence[i].n_hits;
        into->confidence[i].sum_promised += from->confidence[i].sum_promised;
    }
    into->n_wanted += from->n_wanted;
    into->n_found += from->n_found;
    into->n_images += from->n_images;
    into->n_images_scored += from->n_images_scored;
    into->sum_rmse_px += from->sum_rmse_px;
    if (into->depth && from->depth)
        for (int i = 0; i < SHEF_N_DEPTH_BINS; i++)
            into->depth->n[i] += from->depth->n[i];
}

/* 0 / 0 is NaN, which the reports print as a dash. */
static double share(double part, double whole)
{
    return part / whole;
}

static double calibration_error(const struct shef_tally *tally)
{
    double sum = 0;
    int64_t n_pixels = 0;

    for (int i = 0; i < SHEF_N_CONFIDENCE_BINS; i++) {
        const struct shef_confidence_bin *bin = &tally->confidence[i];

        sum += fabs(bin->sum_promised - (double)bin->n_hits);
        n_pixels += bin->n;
    }
    return share(sum, (double)n_pixels);
}

/* The bin in which half of the counts are reached. */
static double depth_median_cm(const struct shef_depth_counts *depth)
{
    int64_t n_all = 0;
    int64_t n_below = 0;

    for (int i = 0; i < SHEF_N_DEPTH_BINS; i++)
        n_all += depth->n[i];
    if (n_all == 0)
        return NAN;
    for (int i = 0; i < SHEF_N_DEPTH_BINS - 1; i++) {
        n_below += depth->n[i];
        if (2 * n_below >= n_all)
            return i * SHEF_DEPTH_BIN_CM;
    }
    return INFINITY;
}

struct shef_figures shef_tally_figures(const struct shef_tally *tally)
{
    const double n_scored = (double)tally->n_scored;
    struct shef_figures figures = {
        .rmse_px = share(tally->sum_rmse_px, (double)tally->n_images_scored),
        .epe_px = share(tally->sum_abs_px, n_scored),
        .coverage = share((double)tally->n_found, (double)tally->n_wanted),
        .calibration_error = calibration_error(tally),
        .depth_median_cm = tally->depth ? depth_median_cm(tally->depth) : NAN,
        .pixels_per_image = share(n_scored, (double)tally->n_images),
    };

    for (int i = 0; i < SHEF_N_BAD; i++)
        figures.bad[i] = share((double)tally->n_bad[i], n_scored);
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        figures.delta[i] = share((double)tally->n_within[i], n_scored);
    return figures;
}
