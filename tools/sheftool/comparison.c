#include "sheftool/comparison.h"

#include <math.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "sheftool/fitting.h"

const struct shef_cited_row shef_cited_rows[SHEF_N_CITED] = {
    /* Wang 2021, tables 2 and 3. The time is the authors' published code on one frame. */
    { "paper D_s (cited)", "edges, no filter", 17.24, 40.08, { 0.6967, 0.7641, 0.8530 }, NAN },
    { "paper D_p (cited)", "edges, their filter", 8.38, 17.76, { 0.9157, 0.9334, 0.9527 }, 28945 },
    { "paper D_c (cited)",
      "dense, network with intensities",
      8.99,
      31.71,
      { 0.8598, 0.9564, 0.9791 },
      NAN },
};

const struct shef_row_plan shef_row_plans[SHEF_N_ROWS] = {
    { .name = "paper-ds",
      .conditions = "edges, no filter; not aligned",
      .kind = &shef_matcher_paper_ds,
      .protocol = SHEF_AUTHORS },
    { .name = "paper-dp",
      .conditions = "edges, authors' filter; not aligned",
      .kind = &shef_matcher_paper_dp,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .filter_timed = true },
    { .name = "OpenCV StereoBM",
      .conditions = "edges, authors' filter; aligned",
      .kind = &shef_matcher_stereobm,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_FIXED,
      .gives_bias = true },
    { .name = "OpenCV StereoBM + bias",
      .conditions =
          "edges, authors' filter; aligned; 6 numbers fitted with truth on its own estimates "
          "of the other scenes",
      .kind = &shef_matcher_stereobm,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_FIXED,
      .bias = true },
    { .name = "OpenCV StereoSGBM",
      .conditions = "edges, authors' filter; aligned",
      .kind = &shef_matcher_stereosgbm,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_FIXED,
      .gives_bias = true },
    { .name = "OpenCV StereoSGBM + bias",
      .conditions =
          "edges, authors' filter; aligned; 6 numbers fitted with truth on its own estimates "
          "of the other scenes",
      .kind = &shef_matcher_stereosgbm,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_FIXED,
      .bias = true },
    { .name = "robust",
      .conditions = "edges, authors' filter; self-aligned",
      .kind = &shef_matcher_robust,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_AUTO,
      .gives_bias = true },
    { .name = "robust + bias",
      .conditions = "edges, authors' filter; self-aligned; 6 numbers fitted with truth on its own "
                    "estimates of the other scenes",
      .kind = &shef_matcher_robust,
      .protocol = SHEF_AUTHORS,
      .filter = true,
      .align = SHEF_ALIGN_AUTO,
      .bias = true },
    { .name = "robust dense",
      .conditions = "every pixel; self-aligned",
      .kind = &shef_matcher_robust,
      .protocol = SHEF_DENSE,
      .dense = true,
      .align = SHEF_ALIGN_AUTO },
    { .name = "robust dense + bias",
      .conditions = "every pixel; self-aligned; the same 6 numbers",
      .kind = &shef_matcher_robust,
      .protocol = SHEF_DENSE,
      .dense = true,
      .align = SHEF_ALIGN_AUTO,
      .bias = true },
};

/* One row while it runs. */
struct run {
    struct shef_comparison *comparison;
    struct shef_row *row;
    struct shef_bias_collection *collection; /* NULL: this row gives no bias samples */
};

static enum shef_err keep_sample(struct run *run, int32_t scene, struct shef_image_f32 scored,
                                 struct shef_error *err)
{
    struct shef_image_f32 *sample = &run->row->samples[scene];
    const enum shef_err code =
        shef_image_create_f32(sample, scored.width_px, scored.height_px, err);

    if (code == SHEF_OK)
        shef_image_copy_f32(scored, *sample);
    return code;
}

static enum shef_err score(void *context, const struct shef_matched *matched,
                           struct shef_error *err)
{
    struct run *run = context;
    struct shef_comparison *comparison = run->comparison;
    const int32_t scene = shef_scenes_of(&comparison->dataset->scenes, matched->number);
    struct shef_image_f32 truth;
    struct shef_image_f32 scored;
    enum shef_err code = SHEF_OK;

    if (run->collection)
        code = shef_bias_collect(run->collection, comparison->dataset, matched, err);
    if (run->row->plan->bias)
        shef_subtract_bias(matched->disparity, &comparison->biases[scene]);
    if (code == SHEF_OK)
        code = shef_dataset_load_truth(comparison->dataset, matched->index, &truth, err);
    if (code != SHEF_OK)
        return code;

    const struct shef_scored_map map = {
        .disparity = matched->disparity,
        .confidence = matched->confidence,
        .truth = truth,
        .frame_edges = matched->frame,
    };

    code = shef_evaluation_add(&run->row->evaluation, matched->number, &map, &scored, err);
    if (code == SHEF_OK && matched->index == comparison->sample_index[scene])
        code = keep_sample(run, scene, scored, err);
    shef_image_destroy_f32(&truth);
    return code;
}

static enum shef_err run_row(struct shef_comparison *comparison, struct shef_row *row,
                             struct shef_bias_collection *collection, struct shef_error *err)
{
    const struct shef_row_plan *plan = row->plan;
    const struct shef_matcher_settings settings = {
        .max_disparity_px = comparison->max_disparity_px,
        .cpu_features = comparison->cpu_features,
        .dense = plan->dense,
        .align = plan->align,
        .alignment = comparison->alignment,
    };
    const struct shef_evaluation_settings how = { plan->protocol, plan->filter, true,
                                                  comparison->rules };
    struct run run = { comparison, row, collection };
    struct shef_matching matching = { .dataset = NULL };
    enum shef_err code =
        shef_evaluation_create(&row->evaluation, &how, &comparison->dataset->scenes, err);

    if (code == SHEF_OK)
        code = shef_matching_create(&matching, comparison->dataset, plan->kind, &settings, err);
    if (code == SHEF_OK)
        code = shef_matching_run(&matching, plan->name, score, &run, err);
    if (code == SHEF_OK) {
        row->present = true;
        row->frame = shef_timings_summary(&matching.total);
        if (plan->filter_timed)
            row->filter = shef_timings_summary(&row->evaluation.filter_times);
    }
    shef_matching_destroy(&matching);
    return code;
}

/* The bias for each scene, from the pairs of all others. */
static enum shef_err fit_biases(struct shef_comparison *comparison,
                                const struct shef_bias_collection *collection,
                                struct shef_error *err)
{
    const struct shef_scenes *scenes = &comparison->dataset->scenes;
    enum shef_err code = SHEF_OK;

    comparison->has_bias = false;
    if (scenes->n < 2)
        return SHEF_OK;
    for (int32_t i = 0; code == SHEF_OK && i < scenes->n; i++)
        code = shef_bias_fit_without(collection, scenes->at[i].first, scenes->at[i].last,
                                     comparison->rules.hole_px, &comparison->biases[i], err);
    comparison->has_bias = code == SHEF_OK;
    if (code == SHEF_ERR_EMPTY)
        return SHEF_OK; /* the rows that need it say that it is missing */
    return code;
}

/* The middle pair of each scene. */
static void choose_samples(struct shef_comparison *comparison)
{
    const struct shef_dataset *dataset = comparison->dataset;

    for (int32_t scene = 0; scene < dataset->scenes.n; scene++) {
        size_t first = 0;
        size_t n_members = 0;

        for (size_t i = 0; i < dataset->pairs.n; i++) {
            if (shef_scenes_of(&dataset->scenes, dataset->pairs.at[i].number) != scene)
                continue;
            if (n_members++ == 0)
                first = i;
        }
        /* A scene is a range of numbers, and pairs are in the order of theirs. */
        comparison->sample_index[scene] = first + n_members / 2;
    }
}

static enum shef_err run_all(struct shef_comparison *comparison, struct shef_error *err)
{
    const struct shef_matcher_settings fit = {
        .max_disparity_px = comparison->max_disparity_px,
        .cpu_features = comparison->cpu_features,
    };
    enum shef_err code = shef_fit_alignment(comparison->dataset, &fit, &comparison->alignment,
                                            &comparison->alignment_spread_px, err);

    for (int i = 0; code == SHEF_OK && i < SHEF_N_ROWS; i++) {
        struct shef_row *row = &comparison->rows[i];
        struct shef_bias_collection collection = { 0 };

        if (row->plan->bias && !comparison->has_bias) {
            snprintf(row->why, sizeof row->why,
                     "needs two scenes or more, with estimates enough to fit");
            continue;
        }
        code = run_row(comparison, row, row->plan->gives_bias ? &collection : NULL, err);
        if (code == SHEF_OK && row->plan->gives_bias)
            code = fit_biases(comparison, &collection, err);
        shef_bias_collection_free(&collection);
    }
    return code;
}

enum shef_err shef_comparison_run(struct shef_comparison *out_comparison,
                                  const struct shef_dataset *dataset,
                                  const struct shef_score_rules *rules, int32_t max_disparity_px,
                                  struct shef_error *err)
{
    struct shef_comparison comparison = {
        .dataset = dataset,
        .rules = *rules,
        .max_disparity_px = max_disparity_px,
        .cpu_features = shef_cpu_features(),
    };

    for (int i = 0; i < SHEF_N_ROWS; i++)
        comparison.rows[i].plan = &shef_row_plans[i];
    choose_samples(&comparison);

    const enum shef_err code = run_all(&comparison, err);

    if (code != SHEF_OK) {
        shef_comparison_destroy(&comparison);
        return code;
    }
    *out_comparison = comparison;
    return SHEF_OK;
}

void shef_comparison_destroy(struct shef_comparison *comparison)
{
    for (int i = 0; i < SHEF_N_ROWS; i++) {
        shef_evaluation_destroy(&comparison->rows[i].evaluation);
        for (int scene = 0; scene < SHEF_MAX_SCENES; scene++)
            shef_image_destroy_f32(&comparison->rows[i].samples[scene]);
    }
}
