/* sheftool align fit, bias fit: the smooth fields that `match` takes as files. */
#include <stdio.h>
#include <sys/stat.h>

#include "core/cpu.h"
#include "pipeline/field_file.h"
#include "sheftool/command.h"
#include "sheftool/fitting.h"
#include "sheftool/report_parts.h"

struct settings {
    const char *data;
    const char *frame_edges;
    const char *event_edges;
    const char *truth;
    const char *pairs;
    const char *out;
    const char *align;
    int64_t max_disparity_px;
    double hole_px;
};

#define INPUT_OPTIONS                                                                              \
    SHEF_OPT_TEXT("data", struct settings, data, "DIR", NULL,                                      \
                  "folder with frame_edge, event_edge and gt"),                                    \
        SHEF_OPT_TEXT("frame-edges", struct settings, frame_edges, "DIR", NULL,                    \
                      "edge maps of the frame camera, instead of --data"),                         \
        SHEF_OPT_TEXT("event-edges", struct settings, event_edges, "DIR", NULL,                    \
                      "edge maps of the event camera, instead of --data")

static const struct shef_option align_options[] = {
    INPUT_OPTIONS,
    SHEF_OPT_NEEDED("out", struct settings, out, "FILE", "JSON file to write"),
    SHEF_OPT_TEXT("pairs", struct settings, pairs, "LIST", NULL,
                  "fit on these numbers only, such as 1-16,50 (default: all)"),
    SHEF_OPT_INT("max-disparity", struct settings, max_disparity_px, "80", 16, 256, "px",
                 "largest disparity searched, below the width"),
    SHEF_OPT_END,
};

static const struct shef_option bias_options[] = {
    INPUT_OPTIONS,
    SHEF_OPT_TEXT("gt", struct settings, truth, "DIR", NULL,
                  "true disparity N.pfm, instead of --data"),
    SHEF_OPT_NEEDED("pairs", struct settings, pairs, "LIST",
                    "the pairs to fit on, such as 1-16,50; leave out those to be scored"),
    SHEF_OPT_NEEDED("out", struct settings, out, "FILE", "JSON file to write"),
    SHEF_OPT_TEXT("align", struct settings, align, "FILE", NULL,
                  "alignment file of `align fit` (default: measured from past pairs)"),
    SHEF_OPT_INT("max-disparity", struct settings, max_disparity_px, "80", 16, 256, "px",
                 "largest disparity searched, below the width"),
    SHEF_OPT_REAL("truth-hole", struct settings, hole_px, "79.9", 1, 16384, "px",
                  "truth from here on is a hole"),
    SHEF_OPT_END,
};

static enum shef_err check_inputs(const struct settings *settings, bool with_truth,
                                  struct shef_error *err)
{
    const bool apart =
        settings->frame_edges && settings->event_edges && (settings->truth || !with_truth);
    const bool any_apart = settings->frame_edges || settings->event_edges || settings->truth;

    if (settings->data ? !any_apart : apart)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "give either --data, or --frame-edges%s --event-edges%s",
                     with_truth ? "," : " and", with_truth ? " and --gt" : "");
}

static enum shef_err check_align(const void *settings, struct shef_error *err)
{
    return check_inputs(settings, false, err);
}

static enum shef_err check_bias(const void *settings, struct shef_error *err)
{
    return check_inputs(settings, true, err);
}

static enum shef_err open_data(const struct settings *settings, struct shef_dataset *dataset,
                               struct shef_error *err)
{
    const struct shef_dataset_place place = { settings->frame_edges, settings->event_edges,
                                              settings->truth, settings->pairs };

    if (settings->data)
        return shef_dataset_open_folder(dataset, settings->data, settings->pairs, err);
    return shef_dataset_open(dataset, &place, err);
}

/* Refuses to overwrite a file that is not an earlier field of the same kind. Looked at before the
 * work starts. Pipes and devices are written to as they are. */
static enum shef_err check_place(const char *path, const char *kind, struct shef_error *err)
{
    struct shef_smooth_field earlier;
    struct stat info;

    if (stat(path, &info) != 0)
        return SHEF_OK; /* new, or the writer says what is wrong with the folder */
    if (S_ISDIR(info.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' is a folder; give --out the name of a file in it", path);
    if (S_ISREG(info.st_mode) && shef_field_file_read(path, kind, &earlier, NULL) != SHEF_OK)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' exists and is not an earlier result of this command; name another "
                         "file for --out, or remove it first",
                         path);
    return SHEF_OK;
}

static void print_field(const char *what, const struct shef_smooth_field *field, const char *path)
{
    printf("%s, X and Y from -1 to 1 about the centre:\n", what);
    shef_field_print(field, stdout);
    printf("\nwritten to %s\n", path);
}

static enum shef_err run_align(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    const struct shef_matcher_settings how = {
        .max_disparity_px = (int32_t)settings->max_disparity_px,
        .cpu_features = shef_cpu_features(),
    };
    struct shef_dataset dataset = { .frame_edges = "" };
    struct shef_smooth_field field;
    double spread_px;
    enum shef_err code = check_place(settings->out, SHEF_FIELD_KIND_ALIGN, err);

    if (code == SHEF_OK)
        code = open_data(settings, &dataset, err);
    if (code == SHEF_OK)
        code = shef_fit_alignment(&dataset, &how, &field, &spread_px, err);
    if (code == SHEF_OK)
        code = shef_field_file_write(settings->out, SHEF_FIELD_KIND_ALIGN, &field, err);
    if (code == SHEF_OK) {
        print_field("vertical residual (event maps move down by it)", &field, settings->out);
        printf("%zu pair%s; the measured blocks are %.2f px from it (median)\n", dataset.pairs.n,
               dataset.pairs.n == 1 ? "" : "s", spread_px);
    }
    shef_dataset_close(&dataset);
    return code;
}

/* What a bias fit gathers. */
struct bias_job {
    const struct shef_dataset *dataset;
    struct shef_bias_collection collection;
};

static enum shef_err collect(void *context, const struct shef_matched *matched,
                             struct shef_error *err)
{
    struct bias_job *job = context;

    return shef_bias_collect(&job->collection, job->dataset, matched, err);
}

static enum shef_err match_and_fit(const struct settings *settings, struct bias_job *job,
                                   struct shef_smooth_field *out_bias, struct shef_error *err)
{
    struct shef_matcher_settings how = {
        .max_disparity_px = (int32_t)settings->max_disparity_px,
        .cpu_features = shef_cpu_features(),
        .align = settings->align ? SHEF_ALIGN_FIXED : SHEF_ALIGN_AUTO,
    };
    struct shef_matching matching = { .dataset = NULL };
    enum shef_err code = SHEF_OK;

    if (settings->align)
        code = shef_field_file_read(settings->align, SHEF_FIELD_KIND_ALIGN, &how.alignment, err);
    if (code == SHEF_OK)
        code = shef_matching_create(&matching, job->dataset, &shef_matcher_robust, &how, err);
    if (code == SHEF_OK)
        code = shef_matching_run(&matching, "matching", collect, job, err);
    if (code == SHEF_OK)
        code =
            shef_bias_fit_without(&job->collection, 1, 0, (float)settings->hole_px, out_bias, err);
    shef_matching_destroy(&matching);
    return code;
}

static enum shef_err run_bias(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_dataset dataset = { .frame_edges = "" };
    struct bias_job job = { .dataset = &dataset };
    struct shef_smooth_field bias;
    enum shef_err code = check_place(settings->out, SHEF_FIELD_KIND_BIAS, err);

    if (code == SHEF_OK)
        code = open_data(settings, &dataset, err);
    if (code == SHEF_OK && !dataset.truth[0])
        code =
            shef_fail(err, SHEF_ERR_NOT_FOUND,
                      "'%s' has no folder gt; a bias can only be fitted where the truth is known",
                      settings->data);
    if (code == SHEF_OK)
        code = match_and_fit(settings, &job, &bias, err);
    if (code == SHEF_OK)
        code = shef_field_file_write(settings->out, SHEF_FIELD_KIND_BIAS, &bias, err);
    if (code == SHEF_OK) {
        print_field("disparity bias (estimate - truth)", &bias, settings->out);
        printf("%zu pair%s\n", dataset.pairs.n, dataset.pairs.n == 1 ? "" : "s");
    }
    shef_bias_collection_free(&job.collection);
    shef_dataset_close(&dataset);
    return code;
}

const struct shef_command shef_command_align_fit = {
    .name = "align fit",
    .summary = "measure the vertical residual between maps, without truth",
    .description =
        "Matches the pairs with the robust matcher and measures, block by block, by how many pixels\n"
        "the event maps sit too high. Six numbers describe the smooth field through the blocks;\n"
        "they go into a file that `match --align FILE` takes. No truth is used.",
    .options = align_options,
    .settings_bytes = sizeof(struct settings),
    .check = check_align,
    .run = run_align,
};

const struct shef_command shef_command_bias_fit = {
    .name = "bias fit",
    .summary = "fit a disparity bias on named pairs with truth",
    .description =
        "Matches the named pairs with the robust matcher and fits estimate - truth by a smooth\n"
        "field of six numbers, written to a file that `match --bias FILE` takes. This uses truth:\n"
        "figures of maps with a bias belong in a row of their own, on pairs that were not named.",
    .options = bias_options,
    .settings_bytes = sizeof(struct settings),
    .check = check_bias,
    .run = run_bias,
};
