/* Beginning and ending recordings. */
#include "service/recorder.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/config_text.h"
#include "core/memory.h"
#include "service/recorder_internal.h"
#include "service/wiring.h"

/* How long a disk may take for what waits in the rings. */
#define CLOSE_WAIT_MS 5000

enum shef_err shef_recorder_create(struct shef_recorder **out_recorder, struct shef_graph *graph,
                                   const struct shef_source *source, struct shef_error *err)
{
    static const struct {
        const char *source;
        const char *recorder; /* the thread, and its ring */
    } names[SHEF_TAPS] = {
        { "events", "record_events" },
        { "frames", "record_frames" },
        { "poses", "record_poses" },
    };
    struct shef_recorder *recorder = shef_memory_create(1, sizeof *recorder);

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "recorder: out of memory");
    recorder->source = source;
    recorder->closed.fd = -1;
    for (int i = 0; i < SHEF_TAPS; i++) {
        struct shef_tap_state *tap = &recorder->taps[i];

        tap->in = shef_graph_producer_end(graph, names[i].recorder, names[i].source);
        tap->out = shef_graph_consumer_end(graph, names[i].recorder, names[i].recorder);
        tap->wake = shef_graph_wake(graph, names[i].recorder);
        atomic_init(&tap->phase, SHEF_TAP_OFF);
    }
    if (shef_wake_init(&recorder->closed, err) != SHEF_OK) {
        free(recorder);
        return err->code;
    }
    *out_recorder = recorder;
    return SHEF_OK;
}

void shef_recorder_destroy(struct shef_recorder *recorder)
{
    if (!recorder)
        return;
    shef_wake_deinit(&recorder->closed);
    free(recorder);
}

/* ---- begin ------------------------------------------------------------------------------ */

static enum shef_err start_events(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_event_part *part = shef_replay_part(recorder->source->events);
    const struct shef_raw_header camera = {
        .format = part->format,
        .width_px = part->width_px,
        .height_px = part->height_px,
    };
    const struct shef_event_recorder_config config = shef_event_recorder_default_config(&camera);

    return shef_event_recorder_start(&recorder->writer, &config, &recorder->events, err);
}

static enum shef_err start_frames(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_frame_recorder_config config =
        shef_frame_recorder_default_config(shef_recorded_frames_format(recorder->source->frames));

    return shef_frame_recorder_start(&recorder->writer, &config, &recorder->frames, err);
}

/* Adds a word to a list with commas between. */
static void add_word(char list[SHEF_RTDE_LIST_BYTES], const char *word)
{
    const size_t n = strlen(list);

    snprintf(list + n, SHEF_RTDE_LIST_BYTES - n, "%s%s", n > 0 ? "," : "", word);
}

static enum shef_err start_poses(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_pose_track *track = &recorder->source->poses;
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();
    char names[SHEF_RTDE_LIST_BYTES] = "";
    char types[SHEF_RTDE_LIST_BYTES] = "";

    if (track->n == 0)
        return SHEF_OK;
    for (uint32_t i = 0; i < track->recipe.n_variables; i++) {
        add_word(names, track->recipe.variables[i].name);
        add_word(types, shef_rtde_type_name(track->recipe.variables[i].type));
    }
    config.protocol_version = track->recipe.version;
    config.recipe = names;
    config.types = types;
    if (track->frequency_hz > 0)
        config.frequency_hz = track->frequency_hz;
    return shef_pose_recorder_start(&recorder->writer, &config, &recorder->poses, err);
}

static enum shef_err write_config(const struct shef_recorder *recorder,
                                  const struct shef_config *config, struct shef_error *err)
{
    char path[PATH_MAX + 32];
    FILE *file;
    bool is_written;

    snprintf(path, sizeof path, "%s/config.yaml", recorder->writer.folder);
    file = fopen(path, "we");
    if (!file)
        return shef_fail_os(err, errno, "write '%s'", path);
    shef_config_write_yaml(config, file);
    is_written = !ferror(file);
    if (fclose(file) != 0 || !is_written)
        return shef_fail_os(err, errno, "write '%s'", path);
    return SHEF_OK;
}

static void stop_parts(struct shef_recorder *recorder, enum shef_err *code, struct shef_error *err)
{
    struct shef_error own;
    enum shef_err codes[SHEF_TAPS] = { SHEF_OK, SHEF_OK, SHEF_OK };

    for (int i = 0; i < SHEF_TAPS; i++) {
        if (i == SHEF_TAP_EVENTS && recorder->events)
            codes[i] = shef_event_recorder_stop(recorder->events, &own);
        if (i == SHEF_TAP_FRAMES && recorder->frames)
            codes[i] = shef_frame_recorder_stop(recorder->frames, &own);
        if (i == SHEF_TAP_POSES && recorder->poses)
            codes[i] = shef_pose_recorder_stop(recorder->poses, &own);
        if (codes[i] != SHEF_OK && *code == SHEF_OK) {
            *code = codes[i];
            *err = own;
        }
    }
    recorder->events = NULL;
    recorder->frames = NULL;
    recorder->poses = NULL;
}

enum shef_err shef_recorder_begin(struct shef_recorder *recorder, const char *folder,
                                  const struct shef_config *config, struct shef_error *err)
{
    const struct shef_recording_writer_config writer = {
        .software = "shefd",
        .calibration_path = recorder->source->calibration_path,
    };
    enum shef_err code;

    if (recorder->is_on)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record start: '%s' is being recorded already; end it with 'record stop'",
                         recorder->last.path);
    code = shef_recording_writer_create(&recorder->writer, folder, &writer, err);
    if (code != SHEF_OK)
        return code;
    code = write_config(recorder, config, err);
    if (code == SHEF_OK)
        code = start_events(recorder, err);
    if (code == SHEF_OK)
        code = start_frames(recorder, err);
    if (code == SHEF_OK)
        code = start_poses(recorder, err);
    if (code != SHEF_OK) {
        enum shef_err ignored = code;

        stop_parts(recorder, &ignored, err);
        shef_recording_writer_abandon(&recorder->writer);
        return code;
    }
    recorder->is_on = true;
    recorder->last = (struct shef_recorder_report){ .is_on = true };
    snprintf(recorder->last.path, sizeof recorder->last.path, "%s", folder);
    for (int i = 0; i < SHEF_TAPS; i++) {
        struct shef_tap_state *tap = &recorder->taps[i];

        shef_counter_set(&tap->n_bytes, 0);
        shef_counter_set(&tap->n_lost, 0);
        atomic_store_explicit(&tap->has_failed, false, memory_order_relaxed);
        /* Release: the part's recorder is visible with the phase. */
        atomic_store_explicit(&tap->phase, SHEF_TAP_ON, memory_order_release);
    }
    return SHEF_OK;
}

/* ---- end -------------------------------------------------------------------------------- */

static bool is_closed(const struct shef_recorder *recorder)
{
    for (int i = 0; i < SHEF_TAPS; i++)
        /* Acquire: what the thread wrote to the part's recorder is visible. */
        if (atomic_load_explicit(&recorder->taps[i].phase, memory_order_acquire) != SHEF_TAP_OFF)
            return false;
    return true;
}

static void ask_to_close(struct shef_recorder *recorder)
{
    for (int i = 0; i < SHEF_TAPS; i++) {
        int on = SHEF_TAP_ON;

        (void)atomic_compare_exchange_strong(&recorder->taps[i].phase, &on, SHEF_TAP_CLOSING);
        shef_wake_signal(recorder->taps[i].wake);
    }
}

static uint64_t sum(const struct shef_recorder *recorder, bool of_bytes)
{
    uint64_t n = 0;

    for (int i = 0; i < SHEF_TAPS; i++)
        n += shef_counter_get(of_bytes ? &recorder->taps[i].n_bytes : &recorder->taps[i].n_lost);
    return n;
}

/* Losses after the last item that found room are in no block: they are only said here. */
static void judge_losses(struct shef_recorder *recorder)
{
    char reason[128];
    const uint64_t n_lost = sum(recorder, false);

    if (n_lost == 0)
        return;
    snprintf(reason, sizeof reason,
             "the disk was too slow: %llu buffers, frames or poses were not written",
             (unsigned long long)n_lost);
    shef_recording_writer_judge(&recorder->writer, SHEF_VERDICT_GAPS, reason);
}

/* The threads no longer touch the parts' recorders. */
static enum shef_err close_all(struct shef_recorder *recorder, struct shef_error *err)
{
    struct shef_error closing;
    enum shef_err code = SHEF_OK;
    enum shef_err closed;

    judge_losses(recorder);
    stop_parts(recorder, &code, err);
    recorder->last.verdict = recorder->writer.manifest.verdict;
    snprintf(recorder->last.reason, sizeof recorder->last.reason, "%s",
             recorder->writer.manifest.reason);
    closed = shef_recording_writer_close(&recorder->writer, false, NULL, NULL, &closing);
    if (code == SHEF_OK && closed != SHEF_OK) {
        code = closed;
        *err = closing;
    }
    recorder->last.n_bytes = sum(recorder, true);
    recorder->last.n_lost = sum(recorder, false);
    recorder->last.is_on = false;
    recorder->is_on = false;
    return code;
}

enum shef_err shef_recorder_end(struct shef_recorder *recorder,
                                struct shef_recorder_report *out_report, struct shef_error *err)
{
    enum shef_err code;

    if (!recorder->is_on)
        return shef_fail(err, SHEF_ERR_INVALID, "record stop: nothing is being recorded");
    ask_to_close(recorder);
    while (!is_closed(recorder))
        if (!shef_wake_wait(&recorder->closed, CLOSE_WAIT_MS))
            return shef_fail(err, SHEF_ERR_TIMEOUT,
                             "record stop '%s': the disk does not take what is still to be "
                             "written; try again",
                             recorder->last.path);
    code = close_all(recorder, err);
    *out_report = recorder->last;
    return code;
}

void shef_recorder_report(const struct shef_recorder *recorder,
                          struct shef_recorder_report *out_report)
{
    *out_report = recorder->last;
    if (recorder->is_on) {
        out_report->n_bytes = sum(recorder, true);
        out_report->n_lost = sum(recorder, false);
    }
}

bool shef_recorder_has_failed(const struct shef_recorder *recorder)
{
    bool has_failed = false;

    for (int i = 0; i < SHEF_TAPS && recorder->is_on; i++)
        has_failed = has_failed || atomic_load(&recorder->taps[i].has_failed);
    return has_failed;
}

void shef_recorder_stop(struct shef_recorder *recorder)
{
    ask_to_close(recorder);
    atomic_store(&recorder->is_stopping, true);
}

void shef_recorder_finish(struct shef_recorder *recorder)
{
    struct shef_raw_packet packet;
    struct shef_recorded_frame_item frame;
    struct shef_error err;

    while (shef_link_pop(recorder->taps[SHEF_TAP_EVENTS].out, &packet) == SHEF_OK)
        shef_buffer_give(packet.buffer);
    while (shef_link_pop(recorder->taps[SHEF_TAP_FRAMES].out, &frame) == SHEF_OK)
        shef_buffer_give(frame.frame.buffer);
    for (int i = 0; i < SHEF_TAPS; i++)
        atomic_store(&recorder->taps[i].phase, SHEF_TAP_OFF);
    if (recorder->is_on && close_all(recorder, &err) != SHEF_OK)
        snprintf(recorder->last.reason, sizeof recorder->last.reason, "%s", err.text);
}
