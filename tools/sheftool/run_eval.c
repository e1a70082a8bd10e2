#include "sheftool/run_eval.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/memory.h"
#include "core/png_io.h"
#include "sheftool/command.h"
#include "sheftool/dataset.h"
#include "sheftool/output_folder.h"
#include "sheftool/picture.h"
#include "sheftool/progress.h"
#include "sheftool/report_parts.h"
#include "sheftool/run_score.h"

/* Error pictures take full colour at 5 px of f 1301 px: 2.1 px of f 555 px. */
#define PICTURE_F_PX 1301.0

struct job {
    const struct shef_run_eval_settings *settings;
    json_t *run; /* run.json */
    const char *recording;
    double f_px;
    struct shef_calibration calibration;
    struct shef_numbered_list maps;
    struct shef_run_scorer *scorer;
    struct shef_run_tally pooled;
    struct shef_run_tally one; /* frame */
    json_t *frames;
    struct shef_output_folder pictures;
    int64_t n_without_truth;
};

static enum shef_err read_run(struct job *job, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    json_error_t reason;
    const char *kind = NULL;
    const char *calibration = "";
    const char *profile = NULL;

    snprintf(path, sizeof path, "%s/run.json", job->settings->run);
    if (access(path, R_OK) != 0)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s' has no run.json; name a folder that `sheftool run` wrote",
                         job->settings->run);
    job->run = json_load_file(path, 0, &reason);
    if (!job->run)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %d: %s", path, reason.line, reason.text);
    if (json_unpack(job->run, "{s:s, s:s, s:s, s:s, s:{s:F}}", "kind", &kind, "recording",
                    &job->recording, "profile", &profile, "calibration_file", &calibration,
                    "geometry", "f_px", &job->f_px) != 0 ||
        strcmp(kind, "run") != 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s' is not from `sheftool run`", path);
    if (job->settings->recording)
        job->recording = job->settings->recording;
    if (calibration[0] == '\0') {
        snprintf(path, sizeof path, "%s/calibration.yaml", job->recording);
        calibration = path;
    }
    if (access(job->recording, R_OK) != 0)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s' was made from '%s', which is not there; name it with --recording",
                         job->settings->run, job->recording);

    enum shef_err code = shef_calibration_read(calibration, &job->calibration, err);

    if (code == SHEF_OK)
        code = shef_run_scorer_open(&job->scorer, job->recording, &job->calibration, profile, err);
    return code;
}

struct maps {
    struct shef_image_f32 disparity;
    struct shef_image_f32 confidence;
    struct shef_image_f32 sigma_m;
};

static void free_maps(struct maps *maps)
{
    shef_image_destroy_f32(&maps->disparity);
    shef_image_destroy_f32(&maps->confidence);
    shef_image_destroy_f32(&maps->sigma_m);
}

static enum shef_err read_sigma(const char *path, const struct maps *maps,
                                struct shef_image_f32 *out_sigma_m, struct shef_error *err)
{
    struct shef_image_u16 millimetres;
    enum shef_err code = shef_png_read_u16(path, &millimetres, err);

    if (code != SHEF_OK)
        return code;
    code = shef_check_size(path, millimetres.width_px, millimetres.height_px,
                           maps->disparity.width_px, maps->disparity.height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(out_sigma_m, millimetres.width_px, millimetres.height_px, err);
    for (int32_t y = 0; code == SHEF_OK && y < millimetres.height_px; y++)
        for (int32_t x = 0; x < millimetres.width_px; x++)
            shef_row_f32(*out_sigma_m, y)[x] = (float)shef_row_u16(millimetres, y)[x] / 1000;
    shef_image_destroy_u16(&millimetres);
    return code;
}

static enum shef_err read_maps(const struct job *job, const struct shef_numbered *map,
                               struct maps *maps, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code;

    snprintf(path, sizeof path, "%s/disparity/%s.pfm", job->settings->run, map->stem);
    code = shef_disparity_read(path, &maps->disparity, err);
    snprintf(path, sizeof path, "%s/disparity/%s.conf.pfm", job->settings->run, map->stem);
    if (code == SHEF_OK && access(path, F_OK) == 0) {
        code = shef_confidence_read(path, &maps->confidence, err);
        if (code == SHEF_OK)
            code = shef_check_size(path, maps->confidence.width_px, maps->confidence.height_px,
                                   maps->disparity.width_px, maps->disparity.height_px, err);
    }
    snprintf(path, sizeof path, "%s/sigma/%s.png", job->settings->run, map->stem);
    if (code == SHEF_OK && access(path, F_OK) == 0)
        code = read_sigma(path, maps, &maps->sigma_m, err);
    return code;
}

static enum shef_err write_picture(struct job *job, const struct shef_numbered *map,
                                   struct shef_error *err)
{
    const struct shef_image_f32 truth = shef_run_scorer_truth(job->scorer);
    const struct shef_image_f32 estimate = shef_run_scorer_estimate(job->scorer);
    const float scale = (float)(PICTURE_F_PX / job->f_px);
    struct shef_image_rgb8 picture;
    char path[SHEF_PATH_BYTES];
    enum shef_err code = shef_image_create_rgb8(&picture, truth.width_px, truth.height_px, err);

    if (code != SHEF_OK)
        return code;
    for (int32_t y = 0; y < truth.height_px; y++) {
        const float *right = shef_row_f32(truth, y);
        const float *found = shef_row_f32(estimate, y);

        for (int32_t x = 0; x < truth.width_px; x++)
            if (right[x] > 0 && found[x] > 0)
                shef_row_rgb8(picture, y)[x] = shef_colour_of_error(scale * (found[x] - right[x]));
    }
    code = shef_output_folder_add(&job->pictures, path, err, "%s.png", map->stem);
    if (code == SHEF_OK)
        code = shef_png_write_rgb8(path, picture, err);
    shef_image_destroy_rgb8(&picture);
    return code;
}

static json_t *frame_json(const struct job *job, int64_t number)
{
    const struct shef_run_figures all = shef_run_part_figures(&job->one.all);
    const struct shef_run_figures sure = shef_run_part_figures(&job->one.confident);
    const double *v = shef_run_scorer_velocity(job->scorer);

    return json_pack(
        "{s:I, s:s, s:[o, o, o], s:I, s:o, s:o, s:o, s:o, s:o, s:o}", "number", (json_int_t)number,
        "direction", shef_run_direction_name(shef_run_scorer_direction(job->scorer)),
        "velocity_m_s", shef_number_json(v[0]), shef_number_json(v[1]), shef_number_json(v[2]),
        "pixels", (json_int_t)job->one.all.n_scored, "bad_1_percent",
        shef_number_json(100 * all.bad_1), "bad_2_percent", shef_number_json(100 * all.bad_2),
        "depth_error_percent", shef_number_json(100 * all.depth_error), "bias_percent",
        shef_number_json(100 * all.bias), "coverage_percent", shef_number_json(100 * all.coverage),
        "confident_75_bad_1_percent", shef_number_json(100 * sure.bad_1));
}

static enum shef_err score(struct job *job, const struct shef_numbered *map, struct shef_error *err)
{
    struct maps maps = { 0 };
    enum shef_err code = shef_run_scorer_load(job->scorer, (uint64_t)map->number, err);

    if (code == SHEF_ERR_NOT_FOUND) {
        job->n_without_truth++;
        return SHEF_OK;
    }
    if (code == SHEF_OK)
        code = read_maps(job, map, &maps, err);
    if (code == SHEF_OK) {
        const struct shef_run_estimate estimate = { maps.disparity, maps.confidence, maps.sigma_m };

        memset(&job->one, 0, sizeof job->one);
        code = shef_run_scorer_add(job->scorer, &estimate, &job->one, err);
    }
    if (code == SHEF_OK && job->one.all.n_scored > 0) {
        shef_run_tally_merge(&job->pooled, &job->one);
        json_array_append_new(job->frames, frame_json(job, map->number));
    }
    if (code == SHEF_OK && job->settings->pictures)
        code = write_picture(job, map, err);
    free_maps(&maps);
    return code;
}

static enum shef_err score_all(struct job *job, struct shef_error *err)
{
    struct shef_progress progress;
    char folder[SHEF_PATH_BYTES];
    enum shef_err code;

    snprintf(folder, sizeof folder, "%s/disparity", job->settings->run);
    code = shef_numbered_list_read(&job->maps, folder, (const char *const[2]){ ".pfm", NULL }, err);
    shef_progress_begin(&progress, "scoring", (int64_t)job->maps.n);
    for (size_t i = 0; i < job->maps.n && code == SHEF_OK; i++) {
        code = shef_interrupted() ? shef_fail_interrupted(err) : score(job, &job->maps.at[i], err);
        shef_progress_step(&progress, (int64_t)i + 1);
    }
    shef_progress_end(&progress);
    if (code == SHEF_OK && job->pooled.n_frames == 0)
        code = shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "not one map in '%s' has a truth in '%s'; both go by the camera's frame "
                         "numbers",
                         folder, job->recording);
    return code;
}

static void print_part(const char *name, const struct shef_run_part *part)
{
    const struct shef_run_figures figures = shef_run_part_figures(part);

    if (part->n_scored == 0)
        return;
    printf("%-22s %9" PRId64, name, part->n_scored);
    shef_number_print(100 * figures.bad_1, 8, 2, false, stdout);
    shef_number_print(100 * figures.bad_2, 8, 2, false, stdout);
    shef_number_print(figures.epe_px, 8, 2, false, stdout);
    shef_number_print(100 * figures.depth_error, 9, 2, false, stdout);
    shef_number_print(100 * figures.bias, 8, 2, true, stdout);
    shef_number_print(100 * figures.coverage, 10, 1, false, stdout);
    printf("\n");
}

static void print_all(const struct job *job)
{
    const struct shef_run_tally *pooled = &job->pooled;

    printf("%" PRId64 " frames of %s\n", pooled->n_frames, job->recording);
    printf("%-22s %9s %7s %7s %7s %8s %7s %9s\n", "", "pixels", "bad-1 %", "bad-2 %", "EPE px",
           "depth %", "bias %", "coverage %");
    print_part("all", &pooled->all);
    print_part("most confident 75 %", &pooled->confident);
    print_part("away from depth jumps", &pooled->away);
    for (int i = 0; i < SHEF_RUN_N_DIRECTIONS; i++) {
        char name[32];

        snprintf(name, sizeof name, "moving %s",
                 shef_run_direction_name((enum shef_run_direction)i));
        print_part(name, &pooled->by_direction[i]);
    }
    printf("confidence: mean error ");
    shef_number_print(shef_run_calibration_error(pooled), 0, 3, false, stdout);
    printf("; depths within one sigma, of those within 1 px: ");
    shef_number_print(100 * shef_run_within_sigma(pooled), 0, 1, false, stdout);
    printf(" %%\n");
    if (job->n_without_truth > 0)
        printf("%" PRId64 " frames have no truth and were left out\n", job->n_without_truth);
}

static enum shef_err report(struct job *job, struct shef_error *err)
{
    json_t *root = shef_run_tally_json(&job->pooled);
    enum shef_err code = SHEF_OK;

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "report: out of memory");
    json_object_set_new(root, "recording", json_string(job->recording));
    json_object_set(root, "mode", json_object_get(job->run, "mode"));
    json_object_set(root, "per_frame", job->frames);
    if (job->settings->pictures)
        code = shef_output_folder_commit(&job->pictures, root, err);
    if (code == SHEF_OK && job->settings->json) {
        shef_report_print_json(root, 9);
    } else if (code == SHEF_OK) {
        print_all(job);
        if (job->settings->pictures)
            printf("Error pictures: %s\n", job->pictures.final);
    }
    json_decref(root);
    return code;
}

enum shef_err shef_run_eval(const struct shef_run_eval_settings *settings, struct shef_error *err)
{
    struct job *job = calloc(1, sizeof *job);
    enum shef_err code;

    if (!job)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    job->settings = settings;
    job->frames = json_array();
    code = read_run(job, err);
    if (code == SHEF_OK && settings->pictures)
        code = shef_output_folder_open_errors(&job->pictures, settings->pictures_dir, settings->run,
                                              err);
    if (code == SHEF_OK)
        code = score_all(job, err);
    if (code == SHEF_OK)
        code = report(job, err);
    shef_output_folder_discard(&job->pictures);
    shef_run_scorer_close(job->scorer);
    shef_numbered_list_free(&job->maps);
    json_decref(job->frames);
    json_decref(job->run);
    free(job);
    return code;
}
