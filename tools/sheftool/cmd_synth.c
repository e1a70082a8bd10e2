/* sheftool synth: edge pairs with known truth for those who have no recordings. */
#include <inttypes.h>
#include <stdio.h>

#include "core/pfm.h"
#include "core/png_io.h"
#include "sheftool/command.h"
#include "sheftool/output_folder.h"
#include "sheftool/progress.h"
#include "sheftool/synth.h"

struct settings {
    const char *out;
    int64_t n_pairs;
    int64_t seed;
    int64_t width_px;
    int64_t height_px;
    double vertical_residual_px;
    double saturated_percent;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("out", struct settings, out, "DIR", "folder to make"),
    SHEF_OPT_INT("pairs", struct settings, n_pairs, "24", 1, 9999, NULL, "how many pairs"),
    SHEF_OPT_INT("seed", struct settings, seed, "1", 0, 1000000, NULL,
                 "another number makes other worlds"),
    SHEF_OPT_INT("width", struct settings, width_px, "640", 96, 4096, "px", "width of the maps"),
    SHEF_OPT_INT("height", struct settings, height_px, "480", 64, 4096, "px", "height of the maps"),
    SHEF_OPT_REAL("vertical-residual", struct settings, vertical_residual_px, "1.5", 0, 10, "px",
                  "largest vertical shift between the maps, a smooth field as on a real rig"),
    SHEF_OPT_REAL("saturated", struct settings, saturated_percent, "0", 0, 100, "%",
                  "share of the pairs whose event map is overfull"),
    SHEF_OPT_END,
};

static enum shef_err write_pair(struct shef_output_folder *folder,
                                const struct shef_synth_pair *pair, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code =
        shef_output_folder_add(folder, path, err, "frame_edge/%" PRId64 ".png", pair->number);

    if (code == SHEF_OK)
        code = shef_png_write_u8(path, pair->frame_edge, err);
    if (code == SHEF_OK)
        code =
            shef_output_folder_add(folder, path, err, "event_edge/%" PRId64 ".png", pair->number);
    if (code == SHEF_OK)
        code = shef_png_write_u8(path, pair->event_edge, err);
    if (code == SHEF_OK)
        code = shef_output_folder_add(folder, path, err, "gt/%" PRId64 ".pfm", pair->number);
    if (code == SHEF_OK)
        code = shef_pfm_write(path, pair->truth, err);
    return code;
}

static enum shef_err write_pairs(struct shef_output_folder *folder, struct shef_synth *synth,
                                 int32_t n_pairs, json_t *saturated, struct shef_error *err)
{
    static const char *const folders[] = { "frame_edge", "event_edge", "gt" };
    struct shef_progress progress;
    enum shef_err code = SHEF_OK;

    for (int i = 0; code == SHEF_OK && i < 3; i++)
        code = shef_output_folder_add_folder(folder, folders[i], err);
    shef_progress_begin(&progress, "making pairs", n_pairs);
    for (int32_t i = 0; code == SHEF_OK && i < n_pairs; i++) {
        if (shef_interrupted()) {
            code = shef_fail_interrupted(err);
            break;
        }
        const struct shef_synth_pair pair = shef_synth_make(synth, i);

        code = write_pair(folder, &pair, err);
        if (pair.saturated)
            json_array_append_new(saturated, json_integer(pair.number));
        shef_progress_step(&progress, i + 1);
    }
    shef_progress_end(&progress);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    const struct shef_synth_settings how = {
        .width_px = (int32_t)settings->width_px,
        .height_px = (int32_t)settings->height_px,
        .n_pairs = (int32_t)settings->n_pairs,
        .seed = (uint64_t)settings->seed,
        .vertical_residual_px = settings->vertical_residual_px,
        .saturated_share = settings->saturated_percent / 100,
    };
    const struct shef_scenes scenes = shef_synth_scenes(&how);
    struct shef_output_folder folder;
    struct shef_synth *synth = shef_synth_create(&how, err);

    if (!synth)
        return err->code;

    json_t *root = shef_scenes_json(&scenes);
    json_t *saturated = json_array();
    enum shef_err code = shef_output_folder_open(&folder, settings->out, "scenes.json", err);

    if (code == SHEF_OK) {
        code = write_pairs(&folder, synth, how.n_pairs, saturated, err);
        json_object_set(root, "saturated", saturated);
        json_object_set_new(root, "focal_px", json_real(SHEF_SYNTH_FOCAL_PER_WIDTH * how.width_px));
        json_object_set_new(root, "baseline_mm", json_real(1000 * SHEF_SYNTH_BASELINE_M));
        json_object_set_new(root, "made_with",
                            json_pack("{s:i, s:i, s:i, s:I, s:f, s:f}", "pairs", how.n_pairs,
                                      "width_px", how.width_px, "height_px", how.height_px, "seed",
                                      (json_int_t)how.seed, "vertical_residual_px",
                                      how.vertical_residual_px, "saturated_percent",
                                      settings->saturated_percent));
        if (code == SHEF_OK)
            code = shef_output_folder_commit(&folder, root, err);
        shef_output_folder_discard(&folder);
    }
    if (code == SHEF_OK)
        printf("%d synthetic pair%s with known truth: %s\n", how.n_pairs,
               how.n_pairs == 1 ? "" : "s", settings->out);
    json_decref(saturated);
    json_decref(root);
    shef_synth_destroy(synth);
    return code;
}

const struct shef_command shef_command_synth = {
    .name = "synth",
    .summary = "make edge pairs with known truth",
    .description =
        "Makes a data folder (frame_edge/N.png, event_edge/N.png, gt/N.pfm, scenes.json) of three\n"
        "synthetic scenes: a slanted wall, large boxes, small clutter. Both cameras see the same\n"
        "textured surfaces with exact occlusion; event edges depend on the motion, have noise and\n"
        "drop-outs. Same options, same bytes. At 640 px width the rig is the authors' (f 1301 px,\n"
        "baseline 65.44 mm); f grows with the width. scenes.json tells it to `eval` and `table`.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
