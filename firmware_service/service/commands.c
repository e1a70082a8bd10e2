/* What people may tell the service to do; docs/control.md describes it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control/command.h"
#include "control/request.h"
#include "core/base64.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "core/png_io.h"
#include "core/words.h"
#include "service/kernels.h"
#include "service/picture.h"
#include "service/recording_list.h"
#include "service/service_internal.h"
#include "service/wiring.h"

static enum shef_err answer_status(void *context, const json_t *arguments, json_t *answer,
                                   struct shef_error *err)
{
    (void)arguments;
    (void)err;
    shef_status_fill(context, answer);
    return SHEF_OK;
}

static enum shef_err answer_top(void *context, const json_t *arguments, json_t *answer,
                                struct shef_error *err)
{
    (void)arguments;
    (void)err;
    shef_top_fill(context, answer);
    return SHEF_OK;
}

static enum shef_err merge(json_t *answer, json_t *from, struct shef_error *err)
{
    if (!from)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "answer: out of memory");
    json_object_update(answer, from);
    json_decref(from);
    return SHEF_OK;
}

static enum shef_err answer_kernels(void *context, const json_t *arguments, json_t *answer,
                                    struct shef_error *err)
{
    (void)context;
    (void)arguments;
    return merge(answer, shef_kernels_to_json(shef_cpu_features()), err);
}

/* Without a source the tables are made for showing only. */
static enum shef_err answer_graph(void *context, const json_t *arguments, json_t *answer,
                                  struct shef_error *err)
{
    const struct shef_service *service = context;
    struct shef_graph *graph;
    enum shef_err code;

    (void)arguments;
    if (service->playback)
        return merge(answer, shef_graph_to_json(shef_playback_graph(service->playback)), err);
    code = shef_wiring_create(&service->config, &graph, err);
    if (code != SHEF_OK)
        return code;
    code = merge(answer, shef_graph_to_json(graph), err);
    shef_graph_destroy(graph);
    return code;
}

static enum shef_err fail_mode(const char *name, struct shef_error *err)
{
    char hint[SHEF_WORDS_HINT_BYTES];

    shef_words_hint(SHEF_DEPTH_MODE_CHOICES, name, hint);
    return shef_fail(err, SHEF_ERR_INVALID, "mode '%s' is none of %s%s", name,
                     SHEF_DEPTH_MODE_CHOICES, hint);
}

static enum shef_err answer_mode(void *context, const json_t *arguments, json_t *answer,
                                 struct shef_error *err)
{
    struct shef_service *service = context;
    json_t *modes;
    char name[SHEF_CONFIG_NAME_BYTES];

    if (json_object_get(arguments, "name")) {
        enum shef_err code = shef_control_text(arguments, "name", name, sizeof name, err);

        if (code != SHEF_OK)
            return code;
        if (shef_live_mode_of(name) == SHEF_DEPTH_N_MODES)
            return fail_mode(name, err);
        snprintf(service->config.depth.mode, sizeof service->config.depth.mode, "%s", name);
        shef_live_apply(&service->live, &service->config);
    }
    modes = json_array();
    for (int i = 0; i < SHEF_DEPTH_N_MODES; i++)
        json_array_append_new(modes, json_string(shef_depth_mode_name((enum shef_depth_mode)i)));
    json_object_set_new(answer, "mode", json_string(service->config.depth.mode));
    json_object_set_new(answer, "modes", modes);
    return SHEF_OK;
}

/* ---- snapshot --------------------------------------------------------------------------- */

static enum shef_err encode(const struct shef_result *result, json_t *answer,
                            struct shef_error *err)
{
    struct shef_image_rgb8 picture;
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    char *text = NULL;
    enum shef_err code = shef_picture_of_result(result, &picture, err);

    if (code != SHEF_OK)
        return code;
    code = shef_png_encode_rgb8(picture, &bytes, &n_bytes, err);
    if (code == SHEF_OK) {
        text = shef_base64_encode(bytes, n_bytes);
        if (!text)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "snapshot: out of memory");
    }
    if (code == SHEF_OK) {
        json_object_set_new(answer, "png_base64", json_string(text));
        json_object_set_new(answer, "width_px", json_integer(picture.width_px));
        json_object_set_new(answer, "height_px", json_integer(picture.height_px));
        json_object_set_new(answer, "seq", json_integer((json_int_t)result->seq));
        json_object_set_new(
            answer, "red_m",
            json_real(result->f_px * result->baseline_m / (double)result->max_disparity_px));
    }
    free(text);
    free(bytes);
    shef_image_destroy_rgb8(&picture);
    return code;
}

static enum shef_err answer_snapshot(void *context, const json_t *arguments, json_t *answer,
                                     struct shef_error *err)
{
    const struct shef_service *service = context;
    struct shef_result *result = service->playback ? shef_playback_newest(service->playback) : NULL;
    enum shef_err code;

    (void)arguments;
    if (!result)
        return shef_fail(err, SHEF_ERR_EMPTY,
                         service->playback ? "snapshot: there is no result yet"
                                           : "snapshot: nothing is playing; start with 'play'");
    code = encode(result, answer, err);
    shef_result_give(result);
    return code;
}

/* ---- play, stop ------------------------------------------------------------------------- */

static enum shef_err read_play(const json_t *arguments, struct shef_config *config,
                               struct shef_error *err)
{
    const json_t *loop = json_object_get(arguments, "loop");
    char pace[SHEF_CONFIG_NAME_BYTES];
    enum shef_err code = shef_control_text(arguments, "recording", config->source.recording,
                                           sizeof config->source.recording, err);

    if (code == SHEF_OK && config->source.recording[0] != '/')
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "play '%s': name the recording by its full path, from / on",
                         config->source.recording);
    if (code == SHEF_OK && loop && !json_is_boolean(loop))
        code = shef_fail(err, SHEF_ERR_INVALID, "play: loop must be true or false");
    if (code == SHEF_OK)
        config->source.loop = json_is_true(loop);
    if (code == SHEF_OK && json_object_get(arguments, "pace")) {
        code = shef_control_text(arguments, "pace", pace, sizeof pace, err);
        if (code == SHEF_OK)
            code = shef_config_set(config, shef_config_find("source.pace"), pace, err);
    }
    return code;
}

static enum shef_err answer_play(void *context, const json_t *arguments, json_t *answer,
                                 struct shef_error *err)
{
    struct shef_service *service = context;
    struct shef_config config = service->config;
    enum shef_err code = read_play(arguments, &config, err);

    /* What is playing goes on if this cannot be played. */
    if (code == SHEF_OK)
        code = shef_source_check(config.source.recording, config.calibration.file, err);
    if (code != SHEF_OK)
        return code;
    shef_service_end_playback(service);
    service->playing = config;
    code = shef_service_play(service, err);
    if (code == SHEF_OK)
        json_object_set_new(answer, "recording", shef_control_string(config.source.recording));
    return code;
}

static enum shef_err answer_stop(void *context, const json_t *arguments, json_t *answer,
                                 struct shef_error *err)
{
    struct shef_service *service = context;

    (void)arguments;
    (void)answer;
    if (!service->playback)
        return shef_fail(err, SHEF_ERR_INVALID, "stop: nothing is playing");
    shef_service_end_playback(service);
    return SHEF_OK;
}

/* ---- recording -------------------------------------------------------------------------- */

static enum shef_err answer_record_start(void *context, const json_t *arguments, json_t *answer,
                                         struct shef_error *err)
{
    struct shef_service *service = context;
    const bool has_name = json_object_get(arguments, "name");
    char name[SHEF_CONFIG_NAME_BYTES];
    char folder[SHEF_CONFIG_PATH_BYTES];
    enum shef_err code = SHEF_OK;

    if (has_name)
        code = shef_control_text(arguments, "name", name, sizeof name, err);
    if (code == SHEF_OK && !service->is_running)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "record start: there is no source to record; start one with 'play'");
    if (code == SHEF_OK)
        code = shef_service_record(service, has_name ? name : NULL, folder, err);
    if (code == SHEF_OK)
        json_object_set_new(answer, "path", shef_control_string(folder));
    return code;
}

/* A recording that has ended before it was asked to is answered for here, once. */
static enum shef_err answer_record_stop(void *context, const json_t *arguments, json_t *answer,
                                        struct shef_error *err)
{
    struct shef_service *service = context;
    struct shef_recorder_report report;
    const enum shef_err code = shef_service_end_recording(service, &report, err);

    (void)arguments;
    if (code != SHEF_OK)
        return code;
    json_object_set_new(answer, "path", shef_control_string(report.path));
    json_object_set_new(answer, "verdict", json_string(shef_verdict_name(report.verdict)));
    json_object_set_new(answer, "reason", shef_control_string(report.reason));
    json_object_set_new(answer, "n_bytes", json_integer((json_int_t)report.n_bytes));
    json_object_set_new(answer, "n_lost", json_integer((json_int_t)report.n_lost));
    return SHEF_OK;
}

static enum shef_err answer_record_list(void *context, const json_t *arguments, json_t *answer,
                                        struct shef_error *err)
{
    const struct shef_service *service = context;
    struct shef_recorder_report report;

    (void)arguments;
    shef_service_recording(service, &report);
    return shef_recording_list(service->config.record.folder, report.is_on ? report.path : "",
                               answer, err);
}

const struct shef_control_command shef_service_commands[] = {
    { "status", "says what the service does and how it fares", answer_status },
    { "top", "shows rates, latencies and backlog of the last second", answer_top },
    { "graph", "lists threads and rings as they are now", answer_graph },
    { "kernels", "lists the implementations picked for this processor", answer_kernels },
    { "mode", "says or sets what is matched, and how", answer_mode, "name" },
    { "snapshot", "gives a picture of the latest result", answer_snapshot },
    { "play", "plays a recording", answer_play, "recording|loop|pace" },
    { "stop", "stops playing", answer_stop },
    { "record start", "begins to record", answer_record_start, "name" },
    { "record stop", "ends the recording and gives its verdict", answer_record_stop },
    { "record list", "lists the recordings there are", answer_record_list },
};

const int shef_service_n_commands = sizeof shef_service_commands / sizeof shef_service_commands[0];
