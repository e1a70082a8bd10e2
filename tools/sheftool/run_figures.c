/* Figures from tallies of runs, and their JSON. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "sheftool/report_parts.h"
#include "sheftool/run_score.h"

#define JSON_STEP  5  /* bins that become one in JSON */
#define MAX_DIGITS 21 /* of a count, with its blank */

static void part_merge(struct shef_run_part *into, const struct shef_run_part *from)
{
    into->n_scored += from->n_scored;
    into->n_found += from->n_found;
    into->n_bad_1 += from->n_bad_1;
    into->n_bad_2 += from->n_bad_2;
    into->sum_abs_px += from->sum_abs_px;
    into->n_good += from->n_good;
    into->sum_good_signed += from->sum_good_signed;
    for (int i = 0; i < SHEF_RUN_ERROR_BINS; i++) {
        into->size[i] += from->size[i];
        into->signed_size[i] += from->signed_size[i];
    }
}

void shef_run_tally_merge(struct shef_run_tally *into, const struct shef_run_tally *from)
{
    part_merge(&into->all, &from->all);
    part_merge(&into->confident, &from->confident);
    part_merge(&into->away, &from->away);
    for (int i = 0; i < SHEF_RUN_N_DIRECTIONS; i++)
        part_merge(&into->by_direction[i], &from->by_direction[i]);
    for (int i = 0; i < SHEF_RUN_N_CONFIDENCE; i++) {
        into->confidence[i].n += from->confidence[i].n;
        into->confidence[i].n_good += from->confidence[i].n_good;
        into->confidence[i].sum_confidence += from->confidence[i].sum_confidence;
    }
    into->n_within_sigma += from->n_within_sigma;
    into->n_frames += from->n_frames;
}

/* Where half of them lie below, in units of bins from the first one. */
static double median_bin(const uint32_t bins[SHEF_RUN_ERROR_BINS], int64_t n)
{
    int64_t n_below = 0;

    for (int i = 0; i < SHEF_RUN_ERROR_BINS; i++) {
        if (2 * (n_below + bins[i]) >= n)
            return i + ((double)n / 2 - (double)n_below) / bins[i];
        n_below += bins[i];
    }
    return NAN;
}

struct shef_run_figures shef_run_part_figures(const struct shef_run_part *part)
{
    const double n = (double)part->n_scored;
    struct shef_run_figures figures = { NAN, NAN, NAN, NAN, NAN, NAN, NAN };

    if (part->n_scored == 0)
        return figures;
    figures.bad_1 = (double)part->n_bad_1 / n;
    figures.bad_2 = (double)part->n_bad_2 / n;
    figures.coverage = (double)part->n_found / n;
    figures.depth_error = median_bin(part->size, part->n_scored) * SHEF_RUN_ERROR_BIN;
    if (part->n_found > 0) {
        figures.epe_px = part->sum_abs_px / (double)part->n_found;
        figures.bias = median_bin(part->signed_size, part->n_found) * SHEF_RUN_ERROR_BIN - 0.5;
    }
    if (part->n_good > 0)
        figures.mean_bias = part->sum_good_signed / (double)part->n_good;
    return figures;
}

double shef_run_calibration_error(const struct shef_run_tally *tally)
{
    double sum = 0;
    int64_t n = 0;

    for (int i = 0; i < SHEF_RUN_N_CONFIDENCE; i++) {
        sum += fabs((double)tally->confidence[i].n_good - tally->confidence[i].sum_confidence);
        n += tally->confidence[i].n;
    }
    return n > 0 ? sum / (double)n : NAN;
}

double shef_run_within_sigma(const struct shef_run_tally *tally)
{
    return tally->all.n_good > 0 ? (double)tally->n_within_sigma / (double)tally->all.n_good : NAN;
}

/* Counts of JSON_STEP bins each, with blanks between; what is left of the last bin comes last. */
static json_t *bins_json(const uint32_t bins[SHEF_RUN_ERROR_BINS])
{
    char text[(SHEF_RUN_ERROR_BINS / JSON_STEP + 1) * MAX_DIGITS];
    size_t length = 0;

    for (int first = 0; first < SHEF_RUN_ERROR_BINS; first += JSON_STEP) {
        uint64_t sum = 0;

        for (int i = first; i < first + JSON_STEP && i < SHEF_RUN_ERROR_BINS; i++)
            sum += bins[i];
        length += (size_t)snprintf(text + length, sizeof text - length,
                                   first > 0 ? " %" PRIu64 : "%" PRIu64, sum);
    }
    return json_string(text);
}

static json_t *part_json(const struct shef_run_part *part)
{
    const struct shef_run_figures figures = shef_run_part_figures(part);

    return json_pack("{s:I, s:I, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}",
                     "pixels", (json_int_t)part->n_scored, "found", (json_int_t)part->n_found,
                     "bad_1", (json_int_t)part->n_bad_1, "bad_2", (json_int_t)part->n_bad_2,
                     "sizes", bins_json(part->size), "signed_sizes", bins_json(part->signed_size),
                     "bad_1_percent", shef_number_json(100 * figures.bad_1), "bad_2_percent",
                     shef_number_json(100 * figures.bad_2), "epe_px",
                     shef_number_json(figures.epe_px), "depth_error_percent",
                     shef_number_json(100 * figures.depth_error), "bias_percent",
                     shef_number_json(100 * figures.bias), "mean_bias_of_good_percent",
                     shef_number_json(100 * figures.mean_bias), "coverage_percent",
                     shef_number_json(100 * figures.coverage), "bin_percent",
                     shef_number_json(100 * JSON_STEP * SHEF_RUN_ERROR_BIN));
}

static json_t *confidence_json(const struct shef_run_tally *tally)
{
    json_t *bins = json_array();

    for (int i = 0; i < SHEF_RUN_N_CONFIDENCE; i++) {
        const double n = (double)tally->confidence[i].n;

        json_array_append_new(
            bins, json_pack("{s:I, s:o, s:o}", "pixels", (json_int_t)tally->confidence[i].n,
                            "promised", shef_number_json(tally->confidence[i].sum_confidence / n),
                            "kept", shef_number_json((double)tally->confidence[i].n_good / n)));
    }
    return bins;
}

json_t *shef_run_tally_json(const struct shef_run_tally *tally)
{
    json_t *directions = json_object();

    for (int i = 0; i < SHEF_RUN_N_DIRECTIONS; i++)
        if (tally->by_direction[i].n_scored > 0)
            json_object_set_new(directions, shef_run_direction_name((enum shef_run_direction)i),
                                part_json(&tally->by_direction[i]));
    return json_pack(
        "{s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "frames", (json_int_t)tally->n_frames, "all",
        part_json(&tally->all), "confident_75", part_json(&tally->confident), "away_from_jumps",
        part_json(&tally->away), "directions", directions, "confidence", confidence_json(tally),
        "confidence_error", shef_number_json(shef_run_calibration_error(tally)),
        "within_sigma_of_good_percent", shef_number_json(100 * shef_run_within_sigma(tally)));
}
