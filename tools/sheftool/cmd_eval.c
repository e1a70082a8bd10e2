/* sheftool eval: figures of anybody's disparity maps against the truth. */
#include <inttypes.h>
#include <stdio.h>
#include <unistd.h>

#include "core/memory.h"
#include "sheftool/command.h"
#include "sheftool/report_parts.h"
#include "sheftool/dataset.h"
#include "sheftool/evaluation.h"
#include "sheftool/output_folder.h"
#include "sheftool/picture.h"
#include "sheftool/progress.h"
#include "sheftool/run_eval.h"

enum filter_choice { FILTER_BY_PROTOCOL, FILTER_NONE, FILTER_AUTHORS };

struct settings {
    const char *run_folder;
    const char *recording;
    const char *disparity;
    const char *truth;
    const char *frame_edges;
    const char *pairs;
    const char *pictures_dir;
    int32_t protocol;
    int32_t filter;
    double hole_px;
    double focal_px;
    double baseline_mm;
    bool json;
    bool pictures;
};

static const struct shef_option options[] = {
    SHEF_OPT_TEXT("run", struct settings, run_folder, "DIR", NULL,
                  "score a result of `run` against its recording's truth, see above"),
    SHEF_OPT_TEXT("recording", struct settings, recording, "DIR", NULL,
                  "the recording, if it is no longer where `run` found it"),
    SHEF_OPT_TEXT("disparity", struct settings, disparity, "DIR", NULL,
                  "maps to score, N.pfm in px or 16-bit N.png holding px * 256, 0 = none; "
                  "N.conf.pfm beside them is their confidence"),
    SHEF_OPT_TEXT("gt", struct settings, truth, "DIR", NULL,
                  "true disparity, N.pfm in px, 0 = none"),
    SHEF_OPT_TEXT("frame-edges", struct settings, frame_edges, "DIR", NULL,
                  "edge maps N.png of the frame camera, for coverage and the density curve; "
                  "protocol density needs them"),
    SHEF_OPT_CHOICE("protocol", struct settings, protocol, SHEF_PROTOCOL_CHOICES, "authors",
                    "what is scored, see above"),
    SHEF_OPT_CHOICE("filter", struct settings, filter, "by-protocol|none|authors", "by-protocol",
                    "the authors' outlier filter, radius 50 then 40 px, before scoring"),
    SHEF_OPT_TEXT("pairs", struct settings, pairs, "LIST", NULL,
                  "score these numbers only, such as 1-16,50"),
    SHEF_OPT_REAL("truth-hole", struct settings, hole_px, "79.9", 1, 16384, "px",
                  "truth from here on is a hole for density and dense"),
    SHEF_SCENES_RIG_OPTIONS(struct settings),
    SHEF_OPT_FLAG("json", struct settings, json, "print JSON instead of tables"),
    SHEF_OPT_FLAG("pictures", struct settings, pictures,
                  "write error pictures N.png: white right, blue too far, red too near, full "
                  "colour from 5 px on, black nothing scored"),
    SHEF_OPT_TEXT("pictures-dir", struct settings, pictures_dir, "DIR", NULL,
                  "where the pictures go (default: the disparity folder's name + \"-errors\")"),
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    if (settings->run_folder) {
        if (settings->disparity || settings->truth || settings->frame_edges || settings->pairs)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "--run names maps and truth by itself; leave --disparity, --gt, "
                             "--frame-edges and --pairs away");
        return SHEF_OK;
    }
    if (settings->recording)
        return shef_fail(err, SHEF_ERR_INVALID, "--recording needs --run");
    if (!settings->disparity || !settings->truth)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "option --%s is missing; name the maps with --disparity and the truth "
                         "with --gt, or a result of `run` with --run",
                         settings->disparity ? "gt" : "disparity");
    if (shef_protocols[settings->protocol].needs_edges && !settings->frame_edges)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "protocol %s scores pixels on frame edges; name their folder with "
                         "--frame-edges",
                         shef_protocols[settings->protocol].name);
    if (settings->pictures_dir && !settings->pictures)
        return shef_fail(err, SHEF_ERR_INVALID, "--pictures-dir needs --pictures");
    return SHEF_OK;
}

/* What is open during one evaluation. */
struct job {
    const struct settings *settings;
    struct shef_numbered_list maps;
    struct shef_numbered_list truths;
    struct shef_numbered_list edges;
    struct shef_scenes scenes;
    struct shef_edge_map frame;
    struct shef_evaluation evaluation;
    struct shef_output_folder pictures;
    struct shef_progress progress;
};

static enum shef_err need_partner(const struct shef_numbered_list *list, int64_t number,
                                  const char *folder, const char *ending, const char *map_folder,
                                  struct shef_error *err)
{
    if (shef_numbered_find(list, number))
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_NOT_FOUND,
                     "'%s/%" PRId64 "%s' is missing, the partner of map %" PRId64
                     " in '%s'; add it or leave the number out with --pairs",
                     folder, number, ending, number, map_folder);
}

static enum shef_err open_folders(struct job *job, struct shef_error *err)
{
    const struct settings *settings = job->settings;
    char parent[SHEF_PATH_BYTES];
    enum shef_err code = shef_numbered_list_read(&job->maps, settings->disparity,
                                                 (const char *const[2]){ ".pfm", ".png" }, err);

    if (code == SHEF_OK && settings->pairs)
        code = shef_numbered_pick(&job->maps, settings->pairs, err);
    if (code == SHEF_OK)
        code = shef_numbered_list_read(&job->truths, settings->truth,
                                       (const char *const[2]){ ".pfm", NULL }, err);
    if (code == SHEF_OK && settings->frame_edges)
        code = shef_numbered_list_read(&job->edges, settings->frame_edges,
                                       (const char *const[2]){ ".png", NULL }, err);
    for (size_t i = 0; code == SHEF_OK && i < job->maps.n; i++) {
        code = need_partner(&job->truths, job->maps.at[i].number, settings->truth, ".pfm",
                            settings->disparity, err);
        if (code == SHEF_OK && settings->frame_edges)
            code = need_partner(&job->edges, job->maps.at[i].number, settings->frame_edges, ".png",
                                settings->disparity, err);
    }
    if (code == SHEF_OK) {
        shef_folder_above(settings->truth, parent);
        code = shef_scenes_find(&job->scenes, parent, &job->maps, err);
    }
    return code;
}

/* One map and everything beside it. */
struct inputs {
    struct shef_image_f32 disparity;
    struct shef_image_f32 confidence; /* data NULL: none */
    struct shef_image_f32 truth;
};

static void free_inputs(struct inputs *inputs)
{
    shef_image_destroy_f32(&inputs->disparity);
    shef_image_destroy_f32(&inputs->confidence);
    shef_image_destroy_f32(&inputs->truth);
}

static enum shef_err load_map(const struct settings *settings, const struct shef_numbered *map,
                              struct inputs *inputs, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code;

    snprintf(path, sizeof path, "%s/%s.pfm", settings->disparity, map->stem);
    if (access(path, F_OK) != 0)
        snprintf(path, sizeof path, "%s/%s.png", settings->disparity, map->stem);
    code = shef_disparity_read(path, &inputs->disparity, err);
    snprintf(path, sizeof path, "%s/%s.conf.pfm", settings->disparity, map->stem);
    if (code == SHEF_OK && access(path, F_OK) == 0) {
        code = shef_confidence_read(path, &inputs->confidence, err);
        if (code == SHEF_OK)
            code = shef_check_size(path, inputs->confidence.width_px, inputs->confidence.height_px,
                                   inputs->disparity.width_px, inputs->disparity.height_px, err);
    }
    return code;
}

static enum shef_err load_truth(const struct job *job, int64_t number, struct inputs *inputs,
                                struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code;

    snprintf(path, sizeof path, "%s/%s.pfm", job->settings->truth,
             shef_numbered_find(&job->truths, number)->stem);
    code = shef_disparity_read(path, &inputs->truth, err);
    if (code == SHEF_OK)
        code = shef_check_size(path, inputs->truth.width_px, inputs->truth.height_px,
                               inputs->disparity.width_px, inputs->disparity.height_px, err);
    return code;
}

static enum shef_err load_edges(struct job *job, int64_t number, const struct inputs *inputs,
                                struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];

    if (job->frame.width_px != inputs->disparity.width_px ||
        job->frame.height_px != inputs->disparity.height_px) {
        shef_edge_map_destroy(&job->frame);
        const enum shef_err code =
            shef_edge_map_create(&job->frame, SHEF_EDGE_UNSIGNED, inputs->disparity.width_px,
                                 inputs->disparity.height_px, err);

        if (code != SHEF_OK)
            return code;
    }
    snprintf(path, sizeof path, "%s/%s.png", job->settings->frame_edges,
             shef_numbered_find(&job->edges, number)->stem);
    return shef_edge_map_read(path, &job->frame, err);
}

static enum shef_err draw_errors(struct job *job, int64_t number, struct shef_image_f32 scored,
                                 struct shef_image_f32 truth, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    const struct shef_map_drawing drawing = { scored, truth, 80 };
    const enum shef_err code =
        shef_output_folder_add(&job->pictures, path, err, "%" PRId64 ".png", number);

    return code == SHEF_OK ? shef_picture_write_map(&drawing, path, err) : code;
}

static enum shef_err score(struct job *job, const struct shef_numbered *map, struct shef_error *err)
{
    struct inputs inputs = { .disparity = { 0 } };
    struct shef_image_f32 scored;
    const bool with_edges = job->settings->frame_edges != NULL;
    enum shef_err code = load_map(job->settings, map, &inputs, err);

    if (code == SHEF_OK)
        code = load_truth(job, map->number, &inputs, err);
    if (code == SHEF_OK && with_edges)
        code = load_edges(job, map->number, &inputs, err);
    if (code == SHEF_OK) {
        const struct shef_scored_map view = {
            .disparity = inputs.disparity,
            .confidence = inputs.confidence,
            .truth = inputs.truth,
            .frame_edges = with_edges ? &job->frame : NULL,
        };

        code = shef_evaluation_add(&job->evaluation, map->number, &view, &scored, err);
    }
    if (code == SHEF_OK && job->settings->pictures)
        code = draw_errors(job, map->number, scored, inputs.truth, err);
    free_inputs(&inputs);
    return code;
}

static enum shef_err score_all(struct job *job, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    shef_progress_begin(&job->progress, "scoring", (int64_t)job->maps.n);
    for (size_t i = 0; code == SHEF_OK && i < job->maps.n; i++) {
        code = shef_interrupted() ? shef_fail_interrupted(err) : score(job, &job->maps.at[i], err);
        shef_progress_step(&job->progress, (int64_t)i + 1);
    }
    shef_progress_end(&job->progress);
    return code;
}

static enum shef_err report(struct job *job, struct shef_error *err)
{
    json_t *root = shef_evaluation_json(&job->evaluation);
    enum shef_err code = SHEF_OK;

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "report: out of memory");
    if (job->settings->pictures)
        code = shef_output_folder_commit(&job->pictures, root, err);
    if (code == SHEF_OK && job->settings->json) {
        shef_report_print_json(root, 9);
    } else if (code == SHEF_OK) {
        shef_evaluation_print(&job->evaluation, stdout);
        if (job->settings->pictures)
            printf("\nError pictures: %s\n", job->pictures.final);
    }
    json_decref(root);
    return code;
}

static enum shef_err score_run(const struct settings *settings, struct shef_error *err)
{
    return shef_run_eval(&(struct shef_run_eval_settings){ .run = settings->run_folder,
                                                           .recording = settings->recording,
                                                           .json = settings->json,
                                                           .pictures = settings->pictures,
                                                           .pictures_dir = settings->pictures_dir },
                         err);
}

static enum shef_err score_maps(const struct settings *settings, struct shef_error *err)
{
    struct job job = { .settings = settings };
    struct shef_evaluation_settings how = {
        .protocol = (enum shef_protocol_index)settings->protocol,
        .filter =
            settings->filter == FILTER_AUTHORS ||
            (settings->filter == FILTER_BY_PROTOCOL && shef_protocols[settings->protocol].filters),
        .has_edges = settings->frame_edges != NULL,
        .rules.hole_px = (float)settings->hole_px,
    };
    enum shef_err code = open_folders(&job, err);

    how.rules.rig.focal_px = shef_scenes_focal_px(&job.scenes, settings->focal_px);
    how.rules.rig.baseline_m = shef_scenes_baseline_mm(&job.scenes, settings->baseline_mm) / 1000;
    if (code == SHEF_OK)
        code = shef_evaluation_create(&job.evaluation, &how, &job.scenes, err);
    if (code == SHEF_OK && settings->pictures)
        code = shef_output_folder_open_errors(&job.pictures, settings->pictures_dir,
                                              settings->disparity, err);
    if (code == SHEF_OK)
        code = score_all(&job, err);
    if (code == SHEF_OK)
        code = report(&job, err);
    shef_output_folder_discard(&job.pictures);
    shef_evaluation_destroy(&job.evaluation);
    shef_edge_map_destroy(&job.frame);
    shef_numbered_list_free(&job.maps);
    shef_numbered_list_free(&job.truths);
    shef_numbered_list_free(&job.edges);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    return settings->run_folder ? score_run(settings, err) : score_maps(settings, err);
}

const struct shef_command shef_command_eval = {
    .name = "eval",
    .summary = "score disparity maps against the truth",
    .description =
        "Scores N.pfm or N.png maps against gt/N.pfm and prints, per scene and overall: RMSE (mean\n"
        "over images), bad-p (share with |error| > 5 px), delta 1..3 (share within a factor of\n"
        "1.25^i), EPE (mean |error|), bad-1/2/3, coverage, median depth error; the density curve;\n"
        "and how well confidences keep what they promise. All but the RMSE are pooled over pixels.\n"
        "\n"
        "Protocols, all in columns 50 to width - 22:\n"
        "  authors  every estimate counts, truth holes included, after the authors'\n"
        "           outlier filter; coverage = share of frame-edge pixels with a\n"
        "           surviving estimate\n"
        "  density  pixels on frame edges with truth below --truth-hole; no filter\n"
        "  dense    every pixel with truth below --truth-hole; no filter\n"
        "\n"
        "Scenes: scenes.json beside the gt folder names them; else numbers up to 147 are taken for\n"
        "the authors' (1-49 complex boxes, 50-98 picnic, 99-147 simple boxes); else all are one.\n"
        "\n"
        "With --run: the result of a simulated recording. Scored are, of each frame, the pixels of\n"
        "the strongest 25 % Sobel gradient where the truth is valid and the event camera sees the\n"
        "same place; one without an estimate is bad. bad-1, bad-2: |error| > 1, 2 px of f 555 px.\n"
        "depth: median of |Z - Z_true| / Z_true; bias: median with its sign, + is too far. Also for\n"
        "each frame's most confident 75 %, more than 5 px from depth jumps (0.5 px of disparity\n"
        "between neighbours), and by the direction of motion.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
