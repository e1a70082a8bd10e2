#include "sheftool/matching.h"

#include "sheftool/command.h"
#include "sheftool/progress.h"
#include "sheftool/report_parts.h"

static enum shef_err allocate(struct shef_matching *matching, struct shef_error *err)
{
    const int32_t w = matching->settings.width_px;
    const int32_t h = matching->settings.height_px;
    enum shef_err code = shef_edge_map_create(&matching->frame, SHEF_EDGE_UNSIGNED, w, h, err);

    if (code == SHEF_OK)
        code = shef_edge_map_create(&matching->event, SHEF_EDGE_UNSIGNED, w, h, err);
    if (code == SHEF_OK)
        code = shef_edge_map_create(&matching->aligned, SHEF_EDGE_UNSIGNED, w, h, err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(&matching->output.disparity, w, h, err);
    if (code == SHEF_OK && matching->kind->has_confidence)
        code = shef_image_create_f32(&matching->output.confidence, w, h, err);
    return code;
}

static enum shef_err check_field(const struct shef_smooth_field *field, const char *what,
                                 const struct shef_dataset *dataset, struct shef_error *err)
{
    if (field->width_px == dataset->width_px && field->height_px == dataset->height_px)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "the %s file is for maps of %d x %d px, but these are %d x %d px; fit one on "
                     "such maps",
                     what, field->width_px, field->height_px, dataset->width_px,
                     dataset->height_px);
}

static enum shef_err check_settings(const struct shef_matcher_settings *settings,
                                    const struct shef_matcher_kind *kind,
                                    const struct shef_dataset *dataset, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (settings->align == SHEF_ALIGN_AUTO && !kind->corrects)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "%s cannot align itself; fit a file with `sheftool align fit` and give "
                         "it as --align FILE",
                         kind->name);
    if (settings->align == SHEF_ALIGN_FIXED)
        code = check_field(&settings->alignment, "alignment", dataset, err);
    if (code == SHEF_OK && settings->has_bias)
        code = check_field(&settings->bias, "bias", dataset, err);
    return code;
}

enum shef_err shef_matching_create(struct shef_matching *out_matching,
                                   const struct shef_dataset *dataset,
                                   const struct shef_matcher_kind *kind,
                                   const struct shef_matcher_settings *settings,
                                   struct shef_error *err)
{
    struct shef_matching matching = { .dataset = dataset, .kind = kind, .settings = *settings };

    matching.settings.width_px = dataset->width_px;
    matching.settings.height_px = dataset->height_px;
    enum shef_err code = check_settings(settings, kind, dataset, err);

    if (code == SHEF_OK)
        code = allocate(&matching, err);
    if (code == SHEF_OK) {
        matching.matcher = kind->create(&matching.settings, err);
        code = matching.matcher ? SHEF_OK : err->code;
    }
    if (code != SHEF_OK) {
        shef_matching_destroy(&matching);
        return code;
    }
    *out_matching = matching;
    return SHEF_OK;
}

void shef_matching_destroy(struct shef_matching *matching)
{
    if (matching->matcher)
        matching->kind->destroy(matching->matcher);
    shef_edge_map_destroy(&matching->frame);
    shef_edge_map_destroy(&matching->event);
    shef_edge_map_destroy(&matching->aligned);
    shef_image_destroy_f32(&matching->output.disparity);
    shef_image_destroy_f32(&matching->output.confidence);
    for (int i = 0; i < SHEF_MATCHER_MAX_STAGES; i++)
        shef_timings_free(&matching->stages[i]);
    shef_timings_free(&matching->total);
    shef_timings_free(&matching->cpu);
    *matching = (struct shef_matching){ .dataset = NULL };
}

static enum shef_err keep_times(struct shef_matching *matching, int64_t total_ns, int64_t cpu_ns,
                                struct shef_error *err)
{
    enum shef_err code = shef_timings_add(&matching->total, total_ns);

    if (code == SHEF_OK)
        code = shef_timings_add(&matching->cpu, cpu_ns);
    for (int i = 0; code == SHEF_OK && matching->kind->stage_name(i); i++)
        code = shef_timings_add(&matching->stages[i], matching->output.stage_ns[i]);
    return code == SHEF_OK ? SHEF_OK : shef_fail(err, code, "timings: out of memory");
}

/* The result where the event camera saw nothing: no estimate, whatever a prior would say. */
static void clear_output(struct shef_match_output *output)
{
    for (int32_t y = 0; y < output->disparity.height_px; y++)
        for (int32_t x = 0; x < output->disparity.width_px; x++)
            shef_row_f32(output->disparity, y)[x] = 0;
    for (int32_t y = 0; y < output->confidence.height_px; y++)
        for (int32_t x = 0; x < output->confidence.width_px; x++)
            shef_row_f32(output->confidence, y)[x] = 0;
    output->report = (struct shef_robust_report){ .right_share = 0 };
}

/* Matches one pair, with the corrections that the matcher does not make itself around it. */
static enum shef_err match_one(struct shef_matching *matching, size_t index, int64_t *out_total_ns,
                               struct shef_error *err)
{
    const struct shef_matcher_settings *settings = &matching->settings;
    const bool around = !matching->kind->corrects;
    const struct shef_edge_map *event = &matching->event;
    enum shef_err code =
        shef_dataset_load_edges(matching->dataset, index, &matching->frame, &matching->event, err);

    if (code != SHEF_OK)
        return code;
    if (shef_edge_map_count(event) == 0) {
        clear_output(&matching->output);
        *out_total_ns = 0;
        return SHEF_OK;
    }
    if (around && settings->align == SHEF_ALIGN_FIXED) {
        shef_edge_map_align(event, &settings->alignment, &matching->aligned);
        event = &matching->aligned;
    }

    const int64_t start_ns = shef_monotonic_ns();
    const int64_t start_cpu_ns = shef_stopwatch_cpu_ns();

    code = matching->kind->match(matching->matcher, &matching->frame, event,
                                 matching->dataset->pairs.at[index].number, &matching->output, err);
    const int64_t cpu_ns = shef_stopwatch_cpu_ns() - start_cpu_ns;

    *out_total_ns = shef_monotonic_ns() - start_ns;
    if (code == SHEF_OK && around && settings->has_bias)
        shef_subtract_bias(matching->output.disparity, &settings->bias);
    return code == SHEF_OK ? keep_times(matching, *out_total_ns, cpu_ns, err) : code;
}

enum shef_err shef_matching_run(struct shef_matching *matching, const char *what,
                                shef_matched_fn *receive, void *context, struct shef_error *err)
{
    const size_t n_pairs = matching->dataset->pairs.n;
    struct shef_progress progress;
    enum shef_err code = SHEF_OK;

    shef_progress_begin(&progress, what, (int64_t)n_pairs);
    for (size_t i = 0; code == SHEF_OK && i < n_pairs; i++) {
        int64_t total_ns = 0;

        code = shef_interrupted() ? shef_fail_interrupted(err)
                                  : match_one(matching, i, &total_ns, err);
        if (code == SHEF_OK) {
            const struct shef_matched matched = {
                .index = i,
                .number = matching->dataset->pairs.at[i].number,
                .frame = &matching->frame,
                .event = &matching->event,
                .disparity = matching->output.disparity,
                .confidence = matching->output.confidence,
                .report = matching->kind->corrects ? &matching->output.report : NULL,
                .total_ns = total_ns,
            };

            code = receive(context, &matched, err);
        }
        shef_progress_step(&progress, (int64_t)i + 1);
    }
    shef_progress_end(&progress);
    return code;
}

static json_t *summary_json(struct shef_timings *timings)
{
    const struct shef_timing_summary summary = shef_timings_summary(timings);

    return shef_timing_summary_json(&summary);
}

json_t *shef_matching_timing_json(struct shef_matching *matching)
{
    json_t *stages = json_object();

    for (int i = 0; matching->kind->stage_name(i); i++)
        json_object_set_new(stages, matching->kind->stage_name(i),
                            summary_json(&matching->stages[i]));
    return json_pack("{s:o, s:o, s:o}", "stages", stages, "total", summary_json(&matching->total),
                     "cpu_of_calling_thread", summary_json(&matching->cpu));
}
