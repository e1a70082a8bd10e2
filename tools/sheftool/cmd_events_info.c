/* sheftool events info: what is in a file or a recording, and whether it is whole. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "core/cpu.h"
#include "sheftool/command.h"
#include "sheftool/report_parts.h"
#include "sheftool/events_report.h"
#include "sheftool/progress.h"

struct settings {
    const char *path;
    bool json;
    const char *picture;
    bool verify;
    double pause_ms;
    double hot_limit_per_s;
};

/* Small, so that a place where data were lost is known to a millisecond or so. */
#define BATCH_EVENTS 4096

static const struct shef_option options[] = {
    SHEF_OPT_WORD("SOURCE", struct settings, path, true,
                  "a RAW file, a DAT file, or the folder of a recording"),
    SHEF_OPT_FLAG("json", struct settings, json, "print JSON instead of text"),
    SHEF_OPT_TEXT("picture", struct settings, picture, "FILE.png", NULL,
                  "draw the rate over time and where events came from"),
    SHEF_OPT_FLAG("verify", struct settings, verify,
                  "also compare a recording's files with their SHA-256"),
    SHEF_OPT_REAL("pause", struct settings, pause_ms, "10", 0.1, 1e9, "ms",
                  "a silence from this length on is counted as a pause"),
    SHEF_OPT_REAL(
        "hot", struct settings, hot_limit_per_s, "2700", 1, 1e6, "events/s",
        "pixels above this rate over the whole time, and far above their neighbours, are hot"),
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const char *picture = ((const struct settings *)opaque)->picture;
    const size_t n = picture ? strlen(picture) : 0;

    if (picture && (n < 5 || strcasecmp(picture + n - 4, ".png") != 0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "--picture %s: the picture is a PNG; give it a name that ends in .png",
                         picture);
    return SHEF_OK;
}

static enum shef_err survey_all(struct shef_events_source *source, struct shef_survey *survey,
                                struct shef_error *err)
{
    static struct shef_event events[BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = BATCH_EVENTS };
    struct shef_progress progress;
    uint64_t n_jumps = 0;
    enum shef_err code;

    shef_progress_begin(&progress, "reading", 1000);
    while ((code = shef_events_source_next(source, &batch, err)) == SHEF_OK) {
        const struct shef_evt_stats stats = shef_events_source_stats(source);
        const uint64_t n_new_jumps = stats.n_violations[SHEF_EVT_TIME_GAP] - n_jumps;

        n_jumps += n_new_jumps;
        code = shef_survey_add(survey, &batch, n_new_jumps, err);
        if (code != SHEF_OK)
            break;
        shef_progress_step(&progress, (int64_t)(1000 * shef_events_source_progress(source)));
    }
    shef_progress_end(&progress);
    return code == SHEF_ERR_EMPTY ? SHEF_OK : code;
}

/* Of the check of a recording, for shef_recording_verify(). */
struct check {
    struct shef_progress progress;
    uint64_t n_bytes;
};

static bool go_on(void *context, uint64_t n_bytes)
{
    struct check *check = context;

    check->n_bytes += n_bytes;
    shef_progress_step(&check->progress, (int64_t)check->n_bytes);
    return !shef_interrupted();
}

static enum shef_err verify(const char *path, struct shef_verify_report *report,
                            struct shef_error *err)
{
    struct check check = { .n_bytes = 0 };

    shef_progress_begin(&check.progress, "checking", (int64_t)shef_recording_verify_size(path));

    const enum shef_err code = shef_recording_verify(path, go_on, &check, report, err);

    shef_progress_end(&check.progress);
    return shef_interrupted() ? shef_fail_interrupted(err) : code;
}

static enum shef_err publish(const struct settings *settings,
                             const struct shef_events_report *report, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (settings->picture)
        code = shef_events_report_draw(report, settings->picture, err);
    if (code != SHEF_OK)
        return code;
    if (!settings->json) {
        shef_events_report_print(report, stdout);
        shef_events_source_print_notes(report->source);
        return SHEF_OK;
    }

    json_t *root = shef_events_report_json(report);

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "'%s': out of memory", settings->path);
    shef_report_print_json(root, 9);
    json_decref(root);
    return SHEF_OK;
}

static enum shef_err report_on(const struct settings *settings, struct shef_events_source *source,
                               struct shef_survey *survey, struct shef_error *err)
{
    struct shef_survey_hot_pixel *hot = calloc(SHEF_SURVEY_HOT_PIXELS, sizeof *hot);
    struct shef_verify_report *verified = calloc(1, sizeof *verified);
    enum shef_err code = SHEF_OK;

    if (!hot || !verified)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "'%s': out of memory", settings->path);
    if (code == SHEF_OK)
        code = survey_all(source, survey, err);
    if (code == SHEF_OK && settings->verify)
        code = verify(settings->path, verified, err);
    if (code == SHEF_OK) {
        const struct shef_events_report report = {
            .path = settings->path,
            .source = source,
            .survey = survey,
            .stats = shef_events_source_stats(source),
            .hot_limit_per_s = settings->hot_limit_per_s,
            .n_hot = shef_survey_hot_pixels(survey, settings->hot_limit_per_s, hot),
            .hot = hot,
            .verify = settings->verify ? verified : NULL,
        };

        code = publish(settings, &report, err);
        if (code == SHEF_OK && settings->verify && verified->n_problems > 0)
            code = shef_fail(err, SHEF_ERR_FORMAT, "'%s' is not as it was recorded: %s%s",
                             settings->path, verified->problems[0],
                             verified->n_problems > 1 ? ", and more" : "");
    }
    free(hot);
    free(verified);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_events_source *source;
    struct shef_survey *survey = calloc(1, sizeof *survey);
    enum shef_err code = SHEF_OK;

    if (!survey)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "'%s': out of memory", settings->path);
    code = shef_events_source_open(settings->path, shef_cpu_features(), &source, err);
    if (code != SHEF_OK) {
        free(survey);
        return code;
    }

    const struct shef_events_info *info = shef_events_source_info(source);

    if (settings->verify && info->kind != SHEF_EVENTS_RECORDING)
        code =
            shef_fail(err, SHEF_ERR_INVALID,
                      "--verify: '%s' is a file; only recordings keep checksums", settings->path);
    if (code == SHEF_OK)
        code = shef_survey_create(survey, info->size_known ? info->width_px : 0,
                                  info->size_known ? info->height_px : 0,
                                  (int64_t)(1000 * settings->pause_ms), err);
    if (code == SHEF_OK)
        code = report_on(settings, source, survey, err);
    shef_survey_destroy(survey);
    free(survey);
    shef_events_source_close(source);
    return code;
}

const struct shef_command shef_command_events_info = {
    .name = "events info",
    .summary = "what is in an event file or recording",
    .description =
        "Reads all events and reports camera, duration, rate over time, triggers, lost data and\n"
        "pauses, violations of the format by class, and hot pixels. What a damaged or cut file\n"
        "still holds is read; notes on standard error say what is wrong with it.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
