/* sheftool study: all modes side by side, against the truth of simulated recordings. */
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/recording.h"
#include "sheftool/command.h"
#include "sheftool/machine.h"
#include "sheftool/output_folder.h"
#include "sheftool/progress.h"
#include "sheftool/report_parts.h"
#include "sheftool/run_options.h"
#include "sheftool/run_score.h"

#define MOVES_M_S 0.005
#define RIGHT_DEG 10.0

struct settings {
    const char *recording;
    const char *modes;
    const char *json;
    struct shef_run_options how;
    int64_t every;
    int64_t skip;
};

static const struct shef_option options[] = {
    SHEF_OPT_WORD("RECORDING", struct settings, recording, true,
                  "a recording with truth/, or a folder of such recordings"),
    SHEF_OPT_TEXT("modes", struct settings, modes, "LIST", "all",
                  "modes to compare, separated by commas, or all"),
    SHEF_RUN_OPTIONS(struct settings, how),
    SHEF_OPT_INT("every", struct settings, every, "1", 1, 1000000, NULL,
                 "score every N-th only of the frames that have a truth"),
    SHEF_OPT_INT("skip", struct settings, skip, "0", 0, 1000000, NULL,
                 "frames at the beginning that are not scored: nothing came before them"),
    SHEF_OPT_TEXT("json", struct settings, json, "FILE", NULL, "also write everything as JSON"),
    SHEF_OPT_END,
};

/* One mode, over one recording or all. */
struct mode_result {
    struct shef_run_tally tally;
    struct shef_timings times;
    int64_t n_moving; /* frames in which the camera moved */
    int64_t n_right;  /* its direction was known to RIGHT_DEG */
};

struct study {
    const struct settings *settings;
    enum shef_depth_mode modes[SHEF_DEPTH_N_MODES];
    int32_t n_modes;
    struct mode_result *pooled; /* n_modes */
    struct mode_result *here;   /* of the recording under way */
    struct shef_run_scorer *scorer;
    struct shef_progress progress;
    int64_t n;        /* frames of the recording under way */
    int64_t n_truths; /* of them, after those skipped */
    bool is_scored;   /* the frame under way */
    json_t *recordings;
};

static enum shef_err parse_modes(const char *text, struct study *study, struct shef_error *err)
{
    char word[32];

    if (strcmp(text, "all") == 0) {
        for (int i = 0; i < SHEF_DEPTH_N_MODES; i++)
            study->modes[i] = (enum shef_depth_mode)i;
        study->n_modes = SHEF_DEPTH_N_MODES;
        return SHEF_OK;
    }
    study->n_modes = 0;
    while (*text) {
        const size_t n = strcspn(text, ",");
        int mode = 0;

        snprintf(word, sizeof word, "%.*s", (int)n, text);
        while (mode < SHEF_DEPTH_N_MODES &&
               strcmp(word, shef_depth_mode_name((enum shef_depth_mode)mode)) != 0)
            mode++;
        if (mode == SHEF_DEPTH_N_MODES || study->n_modes == SHEF_DEPTH_N_MODES)
            return shef_fail(
                err, SHEF_ERR_INVALID,
                "--modes: '%s' is no mode, or too many; modes are " SHEF_DEPTH_MODE_CHOICES, word);
        study->modes[study->n_modes++] = (enum shef_depth_mode)mode;
        text += n + (text[n] == ',');
    }
    return SHEF_OK;
}

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct study study;
    const enum shef_err code = parse_modes(settings->modes, &study, err);

    return code == SHEF_OK ? shef_run_options_check(&settings->how, err) : code;
}

/* Whether the direction used agrees with the true one, in the picture. */
static void count_direction(struct mode_result *result, const double truth[3],
                            const double direction[3])
{
    const double speed = hypot(truth[0], truth[1]);
    const double length = hypot(direction[0], direction[1]);

    if (speed < MOVES_M_S)
        return;
    result->n_moving++;
    if (length > 0 && truth[0] * direction[0] + truth[1] * direction[1] >=
                          cos(RIGHT_DEG * M_PI / 180) * speed * length)
        result->n_right++;
}

/* Not every frame need have a truth; --every counts those that have one. */
static enum shef_err load_truth(struct study *study, uint64_t number, struct shef_error *err)
{
    const struct settings *settings = study->settings;
    enum shef_err code;

    study->is_scored = false;
    if (study->n <= settings->skip)
        return SHEF_OK;
    code = shef_run_scorer_load(study->scorer, number, err);
    if (code == SHEF_OK)
        study->is_scored = study->n_truths++ % settings->every == 0;
    return code == SHEF_ERR_NOT_FOUND ? SHEF_OK : code;
}

static enum shef_err use_frame(void *context, const struct shef_run_frame *frame,
                               struct shef_error *err)
{
    struct study *study = context;
    struct mode_result *result = &study->here[frame->mode];
    const bool has_dense = !(frame->report->flags & SHEF_DEPTH_NO_CONFIDENCE);
    const struct shef_run_estimate estimate = {
        .disparity = has_dense ? frame->output->dense_disparity : frame->output->disparity,
        .confidence = has_dense ? frame->output->dense_confidence : frame->output->confidence,
        .sigma_m = frame->output->sigma_m,
    };
    int64_t total_ns = 0;
    enum shef_err code = SHEF_OK;

    if (frame->mode == 0) {
        shef_progress_step(&study->progress, ++study->n);
        code = load_truth(study, frame->frame->info.number, err);
    }
    if (!study->is_scored)
        return code;
    if (code == SHEF_OK)
        code = shef_run_scorer_add(study->scorer, &estimate, &result->tally, err);
    for (int i = 0; i < SHEF_DEPTH_N_STAGES; i++)
        total_ns += frame->report->stage_ns[i];
    if (code == SHEF_OK)
        code = shef_timings_add(&result->times, total_ns);
    count_direction(result, shef_run_scorer_velocity(study->scorer), frame->report->direction);
    return code;
}

static void print_head(const char *title)
{
    printf("%s\n%-10s %6s %6s %7s %6s %7s %7s %7s %6s %6s %6s %6s %6s\n", title, "mode", "bad-1",
           "bad-2", "depth", "bias", "75%bad1", "75%dep", "awaybad", "cover", "conf", "sigma",
           "dir", "ms");
}

static void print_result(const char *name, struct mode_result *result)
{
    const struct shef_run_figures all = shef_run_part_figures(&result->tally.all);
    const struct shef_run_figures sure = shef_run_part_figures(&result->tally.confident);
    const struct shef_run_figures away = shef_run_part_figures(&result->tally.away);
    const struct shef_timing_summary times = shef_timings_summary(&result->times);

    const struct {
        double value;
        int width;
        int decimals;
        bool is_signed;
    } cells[] = {
        { 100 * all.bad_1, 7, 2, false },
        { 100 * all.bad_2, 7, 2, false },
        { 100 * all.depth_error, 8, 2, false },
        { 100 * all.bias, 7, 2, true },
        { 100 * sure.bad_1, 8, 2, false },
        { 100 * sure.depth_error, 8, 2, false },
        { 100 * away.bad_1, 8, 2, false },
        { 100 * all.coverage, 7, 1, false },
        { shef_run_calibration_error(&result->tally), 7, 3, false },
        { 100 * shef_run_within_sigma(&result->tally), 7, 1, false },
        { 100.0 * (double)result->n_right / (double)result->n_moving, 7, 1, false },
        { times.median_ms, 7, 2, false },
    };

    printf("%-10s", name);
    for (size_t i = 0; i < sizeof cells / sizeof cells[0]; i++)
        shef_number_print(cells[i].value, cells[i].width, cells[i].decimals, cells[i].is_signed,
                          stdout);
    printf("\n");
}

static void print_directions(const char *name, const struct mode_result *result)
{
    printf("%-10s bias, per cent of depth:", name);
    for (int i = 0; i < SHEF_RUN_STILL; i++) {
        const struct shef_run_figures figures =
            shef_run_part_figures(&result->tally.by_direction[i]);

        printf("  %s ", shef_run_direction_name((enum shef_run_direction)i));
        shef_number_print(100 * figures.bias, 0, 2, true, stdout);
    }
    printf("\n");
}

static json_t *results_json(const struct study *study, struct mode_result *results)
{
    json_t *root = json_object();

    for (int32_t i = 0; i < study->n_modes; i++) {
        const struct shef_timing_summary times = shef_timings_summary(&results[i].times);
        json_t *mode = shef_run_tally_json(&results[i].tally);

        json_object_set_new(mode, "time", shef_timing_summary_json(&times));
        json_object_set_new(mode, "frames_with_motion", json_integer(results[i].n_moving));
        json_object_set_new(mode, "direction_within_10_deg", json_integer(results[i].n_right));
        json_object_set_new(root, shef_depth_mode_name(study->modes[i]), mode);
    }
    return root;
}

static void print_results(const struct study *study, const char *title, struct mode_result *results)
{
    print_head(title);
    for (int32_t i = 0; i < study->n_modes; i++)
        print_result(shef_depth_mode_name(study->modes[i]), &results[i]);
    print_directions(shef_depth_mode_name(study->modes[study->n_modes - 1]),
                     &results[study->n_modes - 1]);
    printf("\n");
    fflush(stdout);
}

static enum shef_err merge(struct study *study, struct shef_error *err)
{
    for (int32_t i = 0; i < study->n_modes; i++) {
        struct mode_result *from = &study->here[i];
        struct mode_result *into = &study->pooled[i];

        shef_run_tally_merge(&into->tally, &from->tally);
        into->n_moving += from->n_moving;
        into->n_right += from->n_right;
        for (size_t k = 0; k < from->times.n; k++)
            if (shef_timings_add(&into->times, from->times.ns[k]) != SHEF_OK)
                return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
        shef_timings_free(&from->times);
        memset(from, 0, sizeof *from);
    }
    return SHEF_OK;
}

static enum shef_err study_one(struct study *study, const char *path, struct shef_error *err)
{
    struct shef_run_settings settings = shef_run_options_settings(&study->settings->how, path);
    struct shef_run *run = NULL;
    enum shef_err code;
    const char *note;

    memcpy(settings.modes, study->modes, sizeof settings.modes);
    settings.n_modes = study->n_modes;
    code = shef_run_open(&run, &settings, err);
    if (code == SHEF_OK)
        code = shef_run_scorer_open(&study->scorer, path, shef_run_calibration(run),
                                    shef_run_profile(run), err);
    study->n = 0;
    study->n_truths = 0;
    if (code == SHEF_OK) {
        shef_progress_begin(&study->progress, path, shef_run_n_frames(run));
        code = shef_run_all(run, use_frame, study, err);
        shef_progress_end(&study->progress);
    }
    if (code == SHEF_OK && study->here[0].tally.n_frames == 0)
        code = shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s': of its %lld frames none that is to be scored has its maps in "
                         "truth/; see --skip, and render again if they are lost",
                         path, (long long)study->n);
    for (int i = 0; run && (note = shef_run_note(run, i)); i++)
        fprintf(stderr, "note: %s: %s\n", path, note);
    if (code == SHEF_OK) {
        print_results(study, path, study->here);
        json_array_append_new(study->recordings, json_pack("{s:s, s:o}", "recording", path, "modes",
                                                           results_json(study, study->here)));
        code = merge(study, err);
    }
    shef_run_scorer_close(study->scorer);
    study->scorer = NULL;
    shef_run_close(run);
    return code;
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

/* All recordings in a folder, by name. */
static enum shef_err study_folder(struct study *study, const char *folder, int *out_n,
                                  struct shef_error *err)
{
    struct dirent **entries;
    const int n = scandir(folder, &entries, is_visible, alphasort);
    enum shef_err code = SHEF_OK;

    *out_n = 0;
    for (int i = 0; i < n; i++) {
        char path[SHEF_PATH_BYTES];

        snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        if (code == SHEF_OK && shef_recording_is_at(path)) {
            code = study_one(study, path, err);
            ++*out_n;
        }
        free(entries[i]);
    }
    if (n >= 0)
        free(entries);
    if (code == SHEF_OK && *out_n == 0)
        code = shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "'%s' is no recording and has none in it; make one with shefsim render",
                         folder);
    return code;
}

static enum shef_err finish(struct study *study, int n_recordings, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (n_recordings > 1)
        print_results(study, "all recordings, pooled", study->pooled);
    printf(
        "bad, depth, bias: per cent; 75%%: the most confident; awaybad: bad-1 more than 5 px from\n"
        "depth jumps; conf: mean error of the confidence; sigma: share of good depths within one\n"
        "sigma; dir: frames whose direction of motion is known to 10 degrees; ms: a frame, median\n");
    if (!study->settings->json)
        return SHEF_OK;

    json_t *root = json_pack(
        "{s:s, s:o, s:O, s:o}", "kind", "study", "machine",
        shef_machine_json(shef_run_options_settings(&study->settings->how, "").cpu_features),
        "recordings", study->recordings, "pooled", results_json(study, study->pooled));

    code = root ? shef_write_json(study->settings->json, root, err)
                : shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    json_decref(root);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct study study = { .settings = settings, .recordings = json_array() };
    int n_recordings = 1;
    enum shef_err code = parse_modes(settings->modes, &study, err);

    study.pooled = calloc((size_t)study.n_modes, sizeof *study.pooled);
    study.here = calloc((size_t)study.n_modes, sizeof *study.here);
    if (!study.pooled || !study.here)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    if (code == SHEF_OK)
        code = shef_recording_is_at(settings->recording)
                   ? study_one(&study, settings->recording, err)
                   : study_folder(&study, settings->recording, &n_recordings, err);
    if (code == SHEF_OK)
        code = finish(&study, n_recordings, err);
    for (int32_t i = 0; i < study.n_modes && study.pooled && study.here; i++) {
        shef_timings_free(&study.pooled[i].times);
        shef_timings_free(&study.here[i].times);
    }
    free(study.pooled);
    free(study.here);
    json_decref(study.recordings);
    return code;
}

const struct shef_command shef_command_study = {
    .name = "study",
    .summary = "all modes side by side, on recordings that know the truth",
    .description =
        "Runs simulated recordings through all modes at once and scores each against the truth.\n"
        "Scored are the strongest 25 % Sobel pixels of the frame where the truth is valid and the\n"
        "event camera sees the same place; a pixel without an estimate is bad. See `eval` for the\n"
        "figures. Several recordings in a folder are also pooled.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
