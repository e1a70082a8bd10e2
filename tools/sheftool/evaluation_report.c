/* How an evaluation is shown: tables for people, JSON for programs. */
#include <math.h>
#include <stdio.h>

#include "sheftool/evaluation.h"
#include "sheftool/report_parts.h"

json_t *shef_figures_json(const struct shef_figures *figures)
{
    json_t *object = json_object();
    char key[32];

    json_object_set_new(object, "rmse_px", shef_number_json(figures->rmse_px));
    json_object_set_new(object, "bad_p_percent",
                        shef_number_json(100 * figures->bad[SHEF_N_BAD - 1]));
    for (int i = 0; i < SHEF_N_DELTAS; i++) {
        snprintf(key, sizeof key, "delta_%d", i + 1);
        json_object_set_new(object, key, shef_number_json(figures->delta[i]));
    }
    json_object_set_new(object, "epe_px", shef_number_json(figures->epe_px));
    for (int i = 0; i < SHEF_N_BAD - 1; i++) {
        snprintf(key, sizeof key, "bad_%.0f_percent", shef_bad_px[i]);
        json_object_set_new(object, key, shef_number_json(100 * figures->bad[i]));
    }
    json_object_set_new(object, "coverage_percent", shef_number_json(100 * figures->coverage));
    json_object_set_new(object, "pixels_per_image", shef_number_json(figures->pixels_per_image));
    json_object_set_new(object, "calibration_error", shef_number_json(figures->calibration_error));
    json_object_set_new(object, "depth_median_cm", shef_number_json(figures->depth_median_cm));
    return object;
}

static json_t *tally_json(const char *name, const struct shef_tally *tally)
{
    const struct shef_figures figures = shef_tally_figures(tally);
    json_t *object = shef_figures_json(&figures);

    if (name)
        json_object_set_new(object, "name", json_string(name));
    json_object_set_new(object, "images", json_integer(tally->n_images));
    json_object_set_new(object, "images_without_estimates",
                        json_integer(tally->n_images - tally->n_images_scored));
    json_object_set_new(object, "pixels", json_integer(tally->n_scored));
    return object;
}

static json_t *curve_json(const struct shef_density_curve *curve)
{
    json_t *list = json_array();

    for (int i = curve->ranked ? 0 : SHEF_N_LEVELS - 1; i < SHEF_N_LEVELS; i++) {
        const struct shef_figures figures = shef_tally_figures(&curve->level[i]);
        json_t *level = shef_figures_json(&figures);

        json_object_set_new(level, "asked_percent", json_integer(shef_level_percent[i]));
        json_object_del(level, "depth_median_cm");
        json_object_del(level, "calibration_error");
        json_array_append_new(list, level);
    }
    return list;
}

static json_t *confidence_json(const struct shef_tally *tally)
{
    json_t *list = json_array();

    for (int i = 0; i < SHEF_N_CONFIDENCE_BINS; i++) {
        const struct shef_confidence_bin *bin = &tally->confidence[i];
        const double n = (double)bin->n;

        json_array_append_new(
            list, json_pack("{s:f, s:f, s:I, s:o, s:o}", "from", (double)i / SHEF_N_CONFIDENCE_BINS,
                            "to", (i + 1.0) / SHEF_N_CONFIDENCE_BINS, "pixels", (json_int_t)bin->n,
                            "promised", shef_number_json(bin->sum_promised / n), "kept",
                            shef_number_json((double)bin->n_hits / n)));
    }
    return list;
}

static bool has_confidence(const struct shef_tally *tally)
{
    return isfinite(shef_tally_figures(tally).calibration_error);
}

json_t *shef_evaluation_json(struct shef_evaluation *evaluation)
{
    const int32_t n_scenes = evaluation->scenes->n;
    json_t *scenes = json_array();
    json_t *root = json_pack(
        "{s:s, s:s, s:s, s:{s:f, s:f}}", "unit", "px", "protocol", evaluation->protocol->name,
        "filter", evaluation->filter ? "authors" : "none", "rig", "focal_px",
        evaluation->rules.rig.focal_px, "baseline_m", evaluation->rules.rig.baseline_m);

    shef_evaluation_sum_up(evaluation);
    json_object_set_new(root, "overall", tally_json(NULL, &evaluation->tallies[n_scenes]));
    for (int32_t i = 0; i < n_scenes; i++) {
        json_t *scene = tally_json(evaluation->scenes->at[i].name, &evaluation->tallies[i]);

        if (evaluation->has_edges)
            json_object_set_new(scene, "density_curve", curve_json(&evaluation->curves[i]));
        json_array_append_new(scenes, scene);
    }
    json_object_set_new(root, "scenes", scenes);
    if (evaluation->has_edges)
        json_object_set_new(root, "density_curve", curve_json(&evaluation->curves[n_scenes]));
    if (has_confidence(&evaluation->tallies[n_scenes]))
        json_object_set_new(root, "confidence", confidence_json(&evaluation->tallies[n_scenes]));
    return root;
}

static void print_row(const char *name, const struct shef_tally *tally, FILE *out)
{
    const struct shef_figures figures = shef_tally_figures(tally);

    fprintf(out, "%-16.16s%5lld", name, (long long)tally->n_images);
    shef_number_print(figures.rmse_px, 8, 2, false, out);
    shef_number_print(100 * figures.bad[3], 8, 2, false, out);
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        shef_number_print(figures.delta[i], 8, 4, false, out);
    shef_number_print(figures.epe_px, 8, 2, false, out);
    for (int i = 0; i < SHEF_N_BAD - 1; i++)
        shef_number_print(100 * figures.bad[i], 8, 2, false, out);
    shef_number_print(100 * figures.coverage, 8, 2, false, out);
    shef_number_print(figures.depth_median_cm, 8, 2, false, out);
    fputc('\n', out);
}

static void print_curve(const struct shef_density_curve *curve, FILE *out)
{
    fprintf(out, "\nDensity curve: frame edges with truth, no filter, the most confident of each "
                 "image first\n"
                 "asked %%  real %%    RMSE   bad-p  delta1   bad-3\n"
                 "                    px       %%               %%\n");
    for (int i = curve->ranked ? 0 : SHEF_N_LEVELS - 1; i < SHEF_N_LEVELS; i++) {
        const struct shef_figures figures = shef_tally_figures(&curve->level[i]);

        fprintf(out, "%7d", shef_level_percent[i]);
        shef_number_print(100 * figures.coverage, 8, 2, false, out);
        shef_number_print(figures.rmse_px, 8, 2, false, out);
        shef_number_print(100 * figures.bad[3], 8, 2, false, out);
        shef_number_print(figures.delta[0], 8, 4, false, out);
        shef_number_print(100 * figures.bad[2], 8, 2, false, out);
        fputc('\n', out);
    }
    if (!curve->ranked)
        fprintf(out, "(no confidence maps N.conf.pfm beside the disparity maps, so no ranking)\n");
}

static void print_confidence(const struct shef_tally *tally, FILE *out)
{
    fprintf(out,
            "\nConfidence as the probability of |error| <= %.0f px after the declared bias (maps "
            "made without --bias\nkeep less than they promise): expected calibration error %.4f\n"
            "  from    to  pixels %%  promised  kept\n",
            SHEF_CONFIDENT_PX, shef_tally_figures(tally).calibration_error);
    for (int i = 0; i < SHEF_N_CONFIDENCE_BINS; i++) {
        const struct shef_confidence_bin *bin = &tally->confidence[i];

        fprintf(out, "%6.1f%6.1f", (double)i / SHEF_N_CONFIDENCE_BINS,
                (i + 1.0) / SHEF_N_CONFIDENCE_BINS);
        shef_number_print(100 * (double)bin->n / (double)tally->n_scored, 10, 2, false, out);
        shef_number_print(bin->sum_promised / (double)bin->n, 10, 3, false, out);
        shef_number_print((double)bin->n_hits / (double)bin->n, 7, 3, false, out);
        fputc('\n', out);
    }
}

void shef_evaluation_print(struct shef_evaluation *evaluation, FILE *out)
{
    const int32_t n_scenes = evaluation->scenes->n;
    const struct shef_tally *overall = &evaluation->tallies[n_scenes];

    shef_evaluation_sum_up(evaluation);
    fprintf(out,
            "Protocol %s, %s; columns %d to width - %d;\ndepth with f = %.1f px, b = %.2f mm\n\n"
            "scene          images    RMSE   bad-p  delta1  delta2  delta3     EPE   bad-1   "
            "bad-2   bad-3   cover   depth\n"
            "                          px       %%                              px       %%      "
            " %%       %%       %%      cm\n",
            evaluation->protocol->name,
            evaluation->filter ? "the authors' outlier filter (radius 50, then 40)"
                               : "no outlier filter",
            SHEF_FIRST_COLUMN, SHEF_LAST_MARGIN_PX, evaluation->rules.rig.focal_px,
            1000 * evaluation->rules.rig.baseline_m);
    for (int32_t i = 0; i < n_scenes && n_scenes > 1; i++)
        print_row(evaluation->scenes->at[i].name, &evaluation->tallies[i], out);
    print_row("all", overall, out);
    if (overall->n_images_scored < overall->n_images)
        fprintf(out, "(%lld images have no estimate at all and no share in the RMSE)\n",
                (long long)(overall->n_images - overall->n_images_scored));
    if (evaluation->has_edges)
        print_curve(&evaluation->curves[n_scenes], out);
    if (has_confidence(overall))
        print_confidence(overall, out);
}
