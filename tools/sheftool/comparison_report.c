/* The comparison as Markdown for people and as JSON for programs. */
#include <math.h>
#include <stdio.h>

#include "sheftool/comparison.h"
#include "sheftool/machine.h"
#include "sheftool/report_parts.h"

/* Of the row whose method includes the authors' filter. */
static double filter_ms(const struct shef_comparison *comparison)
{
    for (int i = 0; i < SHEF_N_ROWS; i++)
        if (comparison->rows[i].plan->filter_timed)
            return comparison->rows[i].filter.median_ms;
    return NAN;
}

static double frame_ms(const struct shef_row *row)
{
    return row->frame.median_ms + row->filter.median_ms;
}

/* Prints "| 3.14 / 6.10 " with as many values; one that is unknown is "-". */
static void print_list(const double *values, const int *decimals, int n, FILE *out)
{
    for (int i = 0; i < n; i++)
        if (isfinite(values[i]))
            fprintf(out, "%s%.*f ", i == 0 ? "| " : "/ ", decimals[i], values[i]);
        else
            fprintf(out, "%s- ", i == 0 ? "| " : "/ ");
}

/* Prints "| 3.14 ", or "| - " for what is unknown. */
static void print_cell(double value, int decimals, FILE *out)
{
    print_list(&value, &decimals, 1, out);
}

/* Prints RMSE and bad-p, and the depth error too if wanted. */
static void print_short(const struct shef_figures *figures, bool with_depth, FILE *out)
{
    const double values[] = { figures->rmse_px, 100 * figures->bad[SHEF_N_BAD - 1],
                              figures->depth_median_cm };
    const int decimals[] = { 2, 2, 1 };

    print_list(values, decimals, with_depth ? 3 : 2, out);
}

static void print_cited(const struct shef_cited_row *row, FILE *out)
{
    fprintf(out, "| %s ", row->name);
    print_cell(row->rmse_px, 2, out);
    print_cell(row->bad_p_percent, 2, out);
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        print_cell(row->delta[i], 4, out);
    fprintf(out, "| - | - | - ");
    print_cell(row->ms_per_frame, 0, out);
    fprintf(out, "| %s |\n", row->conditions);
}

static void print_measured(struct shef_row *row, FILE *out)
{
    if (!row->present) {
        fprintf(out, "| %s | - | - | - | - | - | - | - | - | - | %s |\n", row->plan->name,
                row->why);
        return;
    }
    const struct shef_figures figures = shef_evaluation_overall(&row->evaluation);

    fprintf(out, "| %s ", row->plan->name);
    print_cell(figures.rmse_px, 2, out);
    print_cell(100 * figures.bad[SHEF_N_BAD - 1], 2, out);
    for (int i = 0; i < SHEF_N_DELTAS; i++)
        print_cell(figures.delta[i], 4, out);
    print_cell(100 * figures.coverage, 1, out);
    print_cell(figures.epe_px, 2, out);
    print_cell(figures.depth_median_cm, 1, out);
    print_cell(frame_ms(row), 2, out);
    fprintf(out, "| %s |\n", row->plan->conditions);
}

static void print_main_table(struct shef_comparison *comparison, FILE *out)
{
    fprintf(out, "| method | RMSE px | bad-p %% | delta1 | delta2 | delta3 | coverage %% | EPE px "
                 "| depth error cm | ms / frame | conditions |\n"
                 "|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < SHEF_N_CITED; i++)
        print_cited(&shef_cited_rows[i], out);
    for (int i = 0; i < SHEF_N_ROWS; i++)
        print_measured(&comparison->rows[i], out);
}

static void print_scene_table(const struct shef_comparison *comparison, FILE *out)
{
    const struct shef_scenes *scenes = &comparison->dataset->scenes;

    fprintf(out, "\nPer scene, RMSE px / bad-p %% / depth error cm:\n\n| method ");
    for (int32_t i = 0; i < scenes->n; i++)
        fprintf(out, "| %s (%lld) ", scenes->at[i].name,
                (long long)comparison->rows[0].evaluation.tallies[i].n_images);
    fprintf(out, "|\n|---");
    for (int32_t i = 0; i < scenes->n; i++)
        fprintf(out, "|---");
    fprintf(out, "|\n");
    for (int r = 0; r < SHEF_N_ROWS; r++) {
        const struct shef_row *row = &comparison->rows[r];

        if (!row->present)
            continue;
        fprintf(out, "| %s ", row->plan->name);
        for (int32_t i = 0; i < scenes->n; i++) {
            const struct shef_figures figures = shef_tally_figures(&row->evaluation.tallies[i]);

            print_short(&figures, true, out);
        }
        fprintf(out, "|\n");
    }
}

static void print_density_table(struct shef_comparison *comparison, FILE *out)
{
    const int32_t all = comparison->dataset->scenes.n;

    fprintf(out, "\nFrame edges with truth, no filter, the most confident of each image first, "
                 "RMSE px / bad-p %%:\n\n| method | real density %% | 25 %% | 50 %% | 75 %% | 100 "
                 "%% |\n|---|---|---|---|---|---|\n");
    for (int r = 0; r < SHEF_N_ROWS; r++) {
        struct shef_row *row = &comparison->rows[r];

        if (!row->present || row->plan->dense)
            continue;
        shef_evaluation_sum_up(&row->evaluation);
        const struct shef_density_curve *curve = &row->evaluation.curves[all];

        fprintf(out, "| %s ", row->plan->name);
        print_cell(100 * shef_tally_figures(&curve->level[SHEF_N_LEVELS - 1]).coverage, 1, out);
        for (int i = 0; i < SHEF_N_LEVELS; i++) {
            const struct shef_figures figures = shef_tally_figures(&curve->level[i]);

            if (curve->ranked || i == SHEF_N_LEVELS - 1)
                print_short(&figures, false, out);
            else
                fprintf(out, "| - ");
        }
        fprintf(out, "|\n");
    }
}

static void print_notes(struct shef_comparison *comparison, FILE *out)
{
    const struct shef_scenes *scenes = &comparison->dataset->scenes;
    char machine[256];

    shef_machine_text(comparison->cpu_features, machine, sizeof machine);
    fprintf(
        out,
        "\n- cited: Wang 2021, tables 2 and 3, on the authors' own pairs and by their own masks.\n"
        "- edges: every estimate counts, truth holes too, columns 50 to width - 22; authors' "
        "filter: radius 50, then 40. Every pixel: truth below %.1f px only. bad-p: |error| > 5 "
        "px. Depth error: median of |Z - Z_true| with Z = b f / d, b = %.2f mm, f = %.0f px.\n"
        "- ms / frame: median, one thread, without files (%s). paper-dp includes its filter "
        "(%.2f ms); the paper's time is the authors' code on its own machine.\n"
        "- search range up to %d px for all measured rows; robust searches 2, 4 and so on and "
        "interpolates between them.\n"
        "- aligned: event maps moved down by a smooth field that was fitted on these pairs "
        "without truth: ",
        (double)comparison->rules.hole_px, 1000 * comparison->rules.rig.baseline_m,
        comparison->rules.rig.focal_px, machine, filter_ms(comparison),
        comparison->max_disparity_px);
    shef_field_print(&comparison->alignment, out);
    fprintf(out, ". Self-aligned: measured while matching, from past pairs only.\n");
    for (int i = 0; i < SHEF_N_ROWS; i++)
        if (!comparison->rows[i].plan->dense && !comparison->rows[i].plan->bias)
            fprintf(out, "- %s: %s.\n", comparison->rows[i].plan->name,
                    comparison->rows[i].plan->kind->describe);
    for (int32_t i = 0; comparison->has_bias && i < scenes->n; i++) {
        fprintf(out, "- bias of robust for %s, fitted on the other scenes: ", scenes->at[i].name);
        shef_field_print(&comparison->biases[i], out);
        fprintf(out, ".\n");
    }
}

void shef_comparison_print(struct shef_comparison *comparison, FILE *out)
{
    const struct shef_dataset *dataset = comparison->dataset;

    fprintf(out, "# Disparity on %zu %sedge pairs", dataset->pairs.n,
            dataset->scenes.is_synthetic ? "synthetic " : "");
    if (dataset->scenes.is_synthetic)
        fprintf(out, " (seed %lld)", (long long)dataset->scenes.seed);
    fprintf(out, " of %d x %d px\n\n", dataset->width_px, dataset->height_px);
    print_main_table(comparison, out);
    print_scene_table(comparison, out);
    print_density_table(comparison, out);
    print_notes(comparison, out);
}

static json_t *cited_json(const struct shef_cited_row *row)
{
    return json_pack("{s:s, s:b, s:s, s:f, s:f, s:f, s:f, s:f, s:o}", "name", row->name, "cited", 1,
                     "conditions", row->conditions, "rmse_px", row->rmse_px, "bad_p_percent",
                     row->bad_p_percent, "delta_1", row->delta[0], "delta_2", row->delta[1],
                     "delta_3", row->delta[2], "ms_per_frame", shef_number_json(row->ms_per_frame));
}

static json_t *row_json(struct shef_row *row)
{
    json_t *object;

    if (!row->present)
        return json_pack("{s:s, s:b, s:s}", "name", row->plan->name, "cited", 0, "missing",
                         row->why);
    object =
        json_pack("{s:s, s:b, s:s, s:s, s:f, s:o, s:o}", "name", row->plan->name, "cited", 0,
                  "method", row->plan->kind->describe, "conditions", row->plan->conditions,
                  "ms_per_frame", frame_ms(row), "matcher", shef_timing_summary_json(&row->frame),
                  "evaluation", shef_evaluation_json(&row->evaluation));
    if (row->plan->filter_timed)
        json_object_set_new(object, "filter", shef_timing_summary_json(&row->filter));
    return object;
}

json_t *shef_comparison_json(struct shef_comparison *comparison)
{
    const struct shef_dataset *dataset = comparison->dataset;
    json_t *rows = json_array();
    json_t *biases = json_object();

    for (int i = 0; i < SHEF_N_CITED; i++)
        json_array_append_new(rows, cited_json(&shef_cited_rows[i]));
    for (int i = 0; i < SHEF_N_ROWS; i++)
        json_array_append_new(rows, row_json(&comparison->rows[i]));
    for (int32_t i = 0; comparison->has_bias && i < dataset->scenes.n; i++)
        json_object_set_new(biases, dataset->scenes.at[i].name,
                            shef_field_json(&comparison->biases[i]));
    return json_pack("{s:I, s:i, s:i, s:i, s:o, s:o, s:f, s:o, s:o}", "pairs",
                     (json_int_t)dataset->pairs.n, "width_px", dataset->width_px, "height_px",
                     dataset->height_px, "max_disparity_px", comparison->max_disparity_px,
                     "machine", shef_machine_json(comparison->cpu_features), "vertical_residual_px",
                     shef_field_json(&comparison->alignment), "vertical_residual_spread_px",
                     comparison->alignment_spread_px, "bias_px_without_scene", biases, "rows",
                     rows);
}
