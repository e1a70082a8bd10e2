/* sheftool table: the whole comparison in one go. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/file.h"
#include "sheftool/command.h"
#include "sheftool/comparison.h"
#include "sheftool/output_folder.h"

struct settings {
    const char *data;
    const char *out;
    const char *pairs;
    int64_t max_disparity_px;
    double hole_px;
    double focal_px;
    double baseline_mm;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("data", struct settings, data, "DIR",
                    "folder with frame_edge/N.png, event_edge/N.png and gt/N.pfm"),
    SHEF_OPT_TEXT("out", struct settings, out, "DIR", NULL,
                  "folder for table.md, table.json and table.png (default: print only)"),
    SHEF_OPT_TEXT("pairs", struct settings, pairs, "LIST", NULL,
                  "compare on these numbers only, such as 1-16,50"),
    SHEF_OPT_INT("max-disparity", struct settings, max_disparity_px, "80", 16, 256, "px",
                 "largest disparity searched by every method, below the width"),
    SHEF_OPT_REAL("truth-hole", struct settings, hole_px, "79.9", 1, 16384, "px",
                  "truth from here on is a hole for the dense and density figures"),
    SHEF_SCENES_RIG_OPTIONS(struct settings),
    SHEF_OPT_END,
};

static enum shef_err write_markdown(struct shef_comparison *comparison, const char *path,
                                    struct shef_error *err)
{
    char *text = NULL;
    size_t n_bytes = 0;
    FILE *memory = open_memstream(&text, &n_bytes);
    enum shef_err code;

    if (!memory)
        return shef_fail_os(err, errno, "write the table");
    shef_comparison_print(comparison, memory);
    if (fclose(memory) != 0)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "write the table: out of memory");
    else
        code = shef_file_replace(path, text, n_bytes, err);
    free(text);
    return code;
}

static enum shef_err write_results(struct shef_comparison *comparison,
                                   struct shef_output_folder *folder, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code = shef_output_folder_add(folder, path, err, "table.md");

    if (code == SHEF_OK)
        code = write_markdown(comparison, path, err);
    if (code == SHEF_OK)
        code = shef_output_folder_add(folder, path, err, "table.png");
    if (code == SHEF_OK)
        code = shef_comparison_draw(comparison, path, err);
    if (code == SHEF_OK) {
        json_t *root = shef_comparison_json(comparison);

        code = root ? shef_output_folder_commit(folder, root, err)
                    : shef_fail(err, SHEF_ERR_NO_MEMORY, "write the table: out of memory");
        json_decref(root);
    }
    return code;
}

static enum shef_err compare(const struct settings *settings, const struct shef_dataset *dataset,
                             struct shef_output_folder *folder, struct shef_error *err)
{
    const struct shef_score_rules rules = {
        { shef_scenes_focal_px(&dataset->scenes, settings->focal_px),
          shef_scenes_baseline_mm(&dataset->scenes, settings->baseline_mm) / 1000 },
        (float)settings->hole_px,
    };
    struct shef_comparison comparison;
    enum shef_err code =
        shef_comparison_run(&comparison, dataset, &rules, (int32_t)settings->max_disparity_px, err);

    if (code != SHEF_OK)
        return code;
    if (settings->out)
        code = write_results(&comparison, folder, err);
    if (code == SHEF_OK) {
        shef_comparison_print(&comparison, stdout);
        if (settings->out)
            printf("\nTable, JSON and picture: %s/table.md, table.json, table.png\n",
                   folder->final);
    }
    shef_comparison_destroy(&comparison);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_output_folder folder = { .index = NULL };
    struct shef_dataset dataset;
    enum shef_err code = shef_dataset_open_folder(&dataset, settings->data, settings->pairs, err);

    if (code != SHEF_OK)
        return code;
    if (!dataset.truth[0])
        code = shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s' has no folder gt; a comparison needs the truth", settings->data);
    if (code == SHEF_OK && settings->out)
        code = shef_output_folder_open(&folder, settings->out, "table.json", err);
    if (code == SHEF_OK)
        code = compare(settings, &dataset, &folder, err);
    shef_output_folder_discard(&folder);
    shef_dataset_close(&dataset);
    return code;
}

const struct shef_command shef_command_table = {
    .name = "table",
    .summary = "compare all methods on one data folder",
    .description =
        "Matches every pair of a data folder with every method, on one thread, and prints one\n"
        "table in Markdown: the paper's rows (cited), our reproduction of them, the robust matcher\n"
        "and OpenCV's StereoBM and StereoSGBM on the same maps, each without and with a bias fitted\n"
        "on its own estimates of the other scenes, the dense read-out; accuracy in px and as depth error in cm,\n"
        "coverage, ms per frame; then per scene, and by confidence. With --out also as JSON, with\n"
        "all figures of `eval` for each row, and as one picture of samples and their errors.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
