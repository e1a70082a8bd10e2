/* sheftool match: disparity and confidence maps of edge pairs. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/pfm.h"
#include "pipeline/field_file.h"
#include "sheftool/command.h"
#include "sheftool/isa_option.h"
#include "sheftool/machine.h"
#include "sheftool/match_summary.h"
#include "sheftool/matching.h"
#include "sheftool/output_folder.h"
#include "sheftool/picture.h"
#include "sheftool/report_parts.h"

struct settings {
    const char *frame_edges;
    const char *event_edges;
    const char *out;
    const char *pairs;
    const char *align;
    const char *bias;
    int32_t mode;
    int32_t isa;
    int64_t n_threads;
    int64_t max_disparity_px;
    bool dense;
    bool pictures;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("frame-edges", struct settings, frame_edges, "DIR",
                    "edge maps N.png of the frame camera (left, the reference), values 0 and 255"),
    SHEF_OPT_NEEDED("event-edges", struct settings, event_edges, "DIR",
                    "edge maps N.png of the event camera, the same numbers and size"),
    SHEF_OPT_NEEDED("out", struct settings, out, "DIR", "folder for the results"),
    SHEF_OPT_CHOICE("mode", struct settings, mode, SHEF_MATCHER_CHOICES, "robust",
                    "the matcher, see above"),
    SHEF_OPT_FLAG("dense", struct settings, dense,
                  "estimates at every pixel instead of at frame edges"),
    SHEF_OPT_TEXT("align", struct settings, align, "auto|none|FILE", NULL,
                  "vertical residual between the maps: measured from past pairs of this call, "
                  "not corrected, or read from a file of `align fit` (default: auto for robust, "
                  "none for the others)"),
    SHEF_OPT_TEXT("bias", struct settings, bias, "FILE", NULL,
                  "subtract the disparity bias in this file of `bias fit`"),
    SHEF_OPT_INT("threads", struct settings, n_threads, "1", 1, 64, NULL,
                 "worker threads; the results are the same for every number"),
    SHEF_OPT_INT("max-disparity", struct settings, max_disparity_px, "80", 16, 256, "px",
                 "largest disparity searched, below the width"),
    SHEF_OPT_ISA(struct settings, isa,
                 "instruction set of the kernels; the results are the same for each"),
    SHEF_OPT_TEXT("pairs", struct settings, pairs, "LIST", NULL,
                  "match these numbers only, such as 1-16,50"),
    SHEF_OPT_FLAG("pictures", struct settings, pictures,
                  "also write N.colour.png: 0 px (blue, far) to --max-disparity (yellow, near), "
                  "black none"),
    SHEF_OPT_END,
};

/* What is open during one run. */
struct job {
    const struct settings *settings;
    struct shef_dataset dataset;
    struct shef_matcher_settings how;
    struct shef_matching matching;
    struct shef_output_folder folder;
    struct shef_match_summary summary;
    json_t *pairs; /* what is known of each pair */
};

static enum shef_err read_fields(const struct settings *settings, struct shef_matcher_settings *how,
                                 struct shef_error *err)
{
    const bool robust = shef_matchers[settings->mode]->corrects;
    enum shef_err code = SHEF_OK;

    if (!settings->align)
        how->align = robust ? SHEF_ALIGN_AUTO : SHEF_ALIGN_NONE;
    else if (strcmp(settings->align, "auto") == 0)
        how->align = SHEF_ALIGN_AUTO;
    else if (strcmp(settings->align, "none") == 0)
        how->align = SHEF_ALIGN_NONE;
    else
        how->align = SHEF_ALIGN_FIXED;
    if (how->align == SHEF_ALIGN_FIXED)
        code = shef_field_file_read(settings->align, SHEF_FIELD_KIND_ALIGN, &how->alignment, err);
    how->has_bias = settings->bias != NULL;
    if (code == SHEF_OK && settings->bias)
        code = shef_field_file_read(settings->bias, SHEF_FIELD_KIND_BIAS, &how->bias, err);
    return code;
}

static json_t *report_json(const struct shef_matched *matched)
{
    json_t *pair = json_pack("{s:I, s:f}", "number", (json_int_t)matched->number, "total_ms",
                             (double)matched->total_ns / 1e6);
    const struct shef_robust_report *report = matched->report;

    if (!report)
        return pair;
    json_object_set_new(pair, "event_edge_share", json_real(report->right_share));
    json_object_set_new(pair, "saturated", json_boolean(report->is_saturated));
    json_object_set_new(pair, "used_past", json_boolean(report->used_past));
    json_object_set_new(pair, "scene_cut", json_boolean(report->is_cut));
    json_object_set_new(pair, "vertical_residual_px", shef_field_json(&report->alignment));
    json_object_set_new(pair, "vertical_residual_spread_px",
                        json_real(report->alignment_spread_px));
    return pair;
}

static enum shef_err write_result(void *context, const struct shef_matched *matched,
                                  struct shef_error *err)
{
    struct job *job = context;
    char path[SHEF_PATH_BYTES];
    enum shef_err code =
        shef_output_folder_add(&job->folder, path, err, "%" PRId64 ".pfm", matched->number);

    if (code == SHEF_OK)
        code = shef_pfm_write(path, matched->disparity, err);
    if (code == SHEF_OK && matched->confidence.data) {
        code = shef_output_folder_add(&job->folder, path, err, "%" PRId64 ".conf.pfm",
                                      matched->number);
        if (code == SHEF_OK)
            code = shef_pfm_write(path, matched->confidence, err);
    }
    if (code == SHEF_OK && job->settings->pictures) {
        const struct shef_map_drawing drawing = {
            .disparity = matched->disparity,
            .top_px = (float)job->how.max_disparity_px,
        };

        code = shef_output_folder_add(&job->folder, path, err, "%" PRId64 ".colour.png",
                                      matched->number);
        if (code == SHEF_OK)
            code = shef_picture_write_map(&drawing, path, err);
    }
    json_array_append_new(job->pairs, report_json(matched));
    shef_match_summary_add(&job->summary, matched);
    return code;
}

static json_t *timing_json(struct job *job)
{
    static const char *const align_names[] = { "none", "auto", "file" };
    const struct shef_matcher_kind *kind = job->matching.kind;
    json_t *root = json_pack(
        "{s:s, s:s, s:o, s:i, s:i, s:i, s:i, s:b, s:s, s:b, s:o}", "mode", kind->name, "method",
        kind->describe, "machine", shef_machine_json(job->how.cpu_features), "threads",
        (int)job->settings->n_threads, "width_px", job->dataset.width_px, "height_px",
        job->dataset.height_px, "max_disparity_px", job->how.max_disparity_px, "dense",
        job->how.dense, "align", align_names[job->how.align], "bias", job->how.has_bias, "timing",
        shef_matching_timing_json(&job->matching));

    if (kind->memory_bytes)
        json_object_set_new(root, "memory_bytes",
                            json_integer((json_int_t)kind->memory_bytes(job->matching.matcher)));
    json_object_set(root, "pairs", job->pairs);
    return root;
}

static enum shef_err match_and_write(struct job *job, struct shef_error *err)
{
    enum shef_err code = shef_matching_run(&job->matching, "matching", write_result, job, err);

    if (code != SHEF_OK)
        return code;

    json_t *root = timing_json(job);

    code = shef_output_folder_commit(&job->folder, root, err);
    json_decref(root);
    if (code == SHEF_OK) {
        const struct shef_timing_summary total = shef_timings_summary(&job->matching.total);

        const size_t n_pairs = job->dataset.pairs.n;

        printf("%zu pair%s matched with %s: %s\nper pair: median %.2f ms, p95 %.2f ms, min %.2f "
               "ms\n",
               n_pairs, n_pairs == 1 ? "" : "s", job->matching.kind->name, job->folder.final,
               total.median_ms, total.p95_ms, total.min_ms);
        shef_match_summary_print(&job->summary, stdout);
        shef_match_summary_warn(&job->summary, stderr);
    }
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct job job = { .settings = settings, .pairs = json_array() };
    const struct shef_dataset_place place = { settings->frame_edges, settings->event_edges, NULL,
                                              settings->pairs };
    enum shef_err code = shef_dataset_open(&job.dataset, &place, err);

    job.how.max_disparity_px = (int32_t)settings->max_disparity_px;
    job.how.dense = settings->dense;
    if (code == SHEF_OK)
        code = read_fields(settings, &job.how, err);
    if (code == SHEF_OK)
        code = shef_isa_option(settings->isa, &job.how.cpu_features, err);
    if (code == SHEF_OK && settings->n_threads > 1) {
        job.how.workers = shef_workers_create((int32_t)settings->n_threads, err);
        code = job.how.workers ? SHEF_OK : err->code;
    }
    if (code == SHEF_OK)
        code = shef_matching_create(&job.matching, &job.dataset, shef_matchers[settings->mode],
                                    &job.how, err);
    if (code == SHEF_OK)
        code = shef_output_folder_open(&job.folder, settings->out, "timing.json", err);
    if (code == SHEF_OK)
        code = match_and_write(&job, err);
    shef_output_folder_discard(&job.folder);
    shef_matching_destroy(&job.matching);
    shef_workers_destroy(job.how.workers);
    shef_dataset_close(&job.dataset);
    json_decref(job.pairs);
    return code;
}

const struct shef_command shef_command_match = {
    .name = "match",
    .summary = "disparity and confidence maps of edge pairs",
    .description =
        "Matches N.png of two folders and writes, into a folder that appears whole or not at all:\n"
        "  N.pfm        disparity in px, 0 = none; left(x, y) matches right(x - d, y)\n"
        "  N.conf.pfm   confidence 0..1: the probability of |error| <= 3 px after the\n"
        "               declared bias, see `bias fit`; without it errors are larger\n"
        "               (mode robust)\n"
        "  timing.json  milliseconds per stage (median, p95, min), machine, what each\n"
        "               pair was like\n"
        "\n"
        "The authors' outlier filter is never applied: that is a step of `eval`.\n"
        "\n"
        "Modes:\n"
        "  robust             normalised correlation, semi-global; pairs are matched in\n"
        "                     the order of their numbers and carry over to the next\n"
        "                     number only\n"
        "  paper-ds, -dp      the paper's window correlation (D_s) and its pyramid (D_p)\n"
        "  opencv-stereobm,   OpenCV's matchers on the same maps, to compare with\n"
        "  opencv-stereosgbm",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
