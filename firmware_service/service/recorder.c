/* Beginning recordings; recorder_end.c ends them. */
#include "service/recorder.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/config_text.h"
#include "core/memory.h"
#include "service/recorder_internal.h"
#include "service/wiring.h"

/* 21 MB and about 42 MB: with what the sources' pools can spare, as much as the rings hold. That is
 * a third of a second at 54 frames and 10 million events a second. */
#define SPARE_EVENT_BUFFERS 160
#define SPARE_FRAMES        14

enum shef_err shef_recorder_create(struct shef_recorder **out_recorder, struct shef_graph *graph,
                                   const struct shef_source *source, const struct shef_pace *pace,
                                   int64_t utc_minus_host_ns, struct shef_error *err)
{
    static const struct {
        const char *source;
        const char *recorder; /* the thread, and its ring */
    } names[SHEF_TAPS] = {
        { "events", "record_events" },
        { "frames", "record_frames" },
        { "poses", "record_poses" },
        { "frames", "record_triggers" },
    };
    struct shef_recorder *recorder = shef_memory_create(1, sizeof *recorder);

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "recorder: out of memory");
    recorder->source = source;
    recorder->pace = pace;
    recorder->utc_minus_host_ns = utc_minus_host_ns;
    recorder->closed.fd = -1;
    for (int i = 0; i < SHEF_TAPS; i++) {
        struct shef_tap_state *tap = &recorder->taps[i];

        tap->in = shef_graph_producer_end(graph, names[i].recorder, names[i].source);
        tap->out = shef_graph_consumer_end(graph, names[i].recorder, names[i].recorder);
        tap->wake = shef_graph_wake(graph, names[i].recorder);
        tap->source_wake = shef_graph_wake(graph, names[i].source);
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
    for (int i = 0; i < SHEF_TAPS; i++)
        shef_pool_destroy(recorder->taps[i].spare);
    shef_wake_deinit(&recorder->closed);
    free(recorder);
}

/* ---- begin ------------------------------------------------------------------------------ */

static enum shef_err start_events(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_event_recorder_config config =
        shef_event_recorder_default_config(&recorder->source->event_camera);

    return shef_event_recorder_start(&recorder->writer, &config, &recorder->events, err);
}

static enum shef_err start_frames(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_source *source = recorder->source;
    struct shef_frame_recorder_config config =
        shef_frame_recorder_default_config(shef_recorded_frames_format(source->frames));

    config.vendor = source->frame_camera.vendor;
    config.model = source->frame_camera.model;
    config.serial = source->frame_camera.serial;
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

static enum shef_err start_triggers(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct shef_edge_track *track = &recorder->source->edges;
    const struct shef_trigger_recorder_config config = {
        .chip = track->chip,
        .lines = track->lines,
        .n_lines = track->n_lines,
        .limits = shef_segment_limits_default(),
    };

    if (track->n == 0)
        return SHEF_OK;
    return shef_trigger_recorder_start(&recorder->writer, &config, &recorder->triggers, err);
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

enum shef_err shef_recorder_stop_part(struct shef_recorder *recorder, enum shef_tap tap,
                                      struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (tap == SHEF_TAP_EVENTS && recorder->events) {
        code = shef_event_recorder_stop(recorder->events, err);
        recorder->events = NULL;
    } else if (tap == SHEF_TAP_FRAMES && recorder->frames) {
        code = shef_frame_recorder_stop(recorder->frames, err);
        recorder->frames = NULL;
    } else if (tap == SHEF_TAP_POSES && recorder->poses) {
        code = shef_pose_recorder_stop(recorder->poses, err);
        recorder->poses = NULL;
    } else if (tap == SHEF_TAP_TRIGGERS && recorder->triggers) {
        code = shef_trigger_recorder_stop(recorder->triggers, err);
        recorder->triggers = NULL;
    }
    return code;
}

static enum shef_err start_parts(struct shef_recorder *recorder, const struct shef_config *config,
                                 struct shef_error *err)
{
    enum shef_err code = write_config(recorder, config, err);

    if (code == SHEF_OK)
        code = start_events(recorder, err);
    if (code == SHEF_OK)
        code = start_frames(recorder, err);
    if (code == SHEF_OK)
        code = start_poses(recorder, err);
    if (code == SHEF_OK)
        code = start_triggers(recorder, err);
    return code;
}

/* Memory for what the disk has not yet taken, beside what the sources can spare. */
static enum shef_err make_spare(struct shef_recorder *recorder, struct shef_error *err)
{
    const struct {
        enum shef_tap tap;
        uint32_t n;
        uint32_t n_bytes;
    } wanted[] = {
        { SHEF_TAP_EVENTS, SPARE_EVENT_BUFFERS, SHEF_EVENT_BLOCK_MAX_BYTES },
        { SHEF_TAP_FRAMES, SPARE_FRAMES, shef_recorded_frames_max_bytes(recorder->source->frames) },
    };

    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        struct shef_pool **spare = &recorder->taps[wanted[i].tap].spare;

        if (!*spare)
            *spare = shef_pool_create(wanted[i].n, wanted[i].n_bytes, err);
        if (!*spare)
            return shef_fail_context(err, "record start");
    }
    return SHEF_OK;
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
    code = make_spare(recorder, err);
    if (code != SHEF_OK)
        return code;
    code = shef_recording_writer_create(&recorder->writer, folder, &writer, err);
    if (code != SHEF_OK)
        return code;
    recorder->writer.manifest.utc_minus_host_ns = recorder->utc_minus_host_ns;
    code = start_parts(recorder, config, err);
    if (code != SHEF_OK) {
        for (int i = 0; i < SHEF_TAPS; i++)
            (void)!shef_recorder_stop_part(recorder, (enum shef_tap)i, NULL);
        shef_recording_writer_abandon(&recorder->writer);
        return code;
    }
    recorder->is_on = true;
    recorder->is_closing = false;
    recorder->stop = (struct shef_error){ 0 };
    recorder->last = (struct shef_recorder_report){ .is_on = true };
    snprintf(recorder->last.path, sizeof recorder->last.path, "%s", folder);
    for (int i = 0; i < SHEF_TAPS; i++) {
        struct shef_tap_state *tap = &recorder->taps[i];

        shef_counter_set(&tap->n_bytes, 0);
        shef_counter_set(&tap->n_lost, 0);
        shef_counter_set(&tap->n_lost_since, 0);
        shef_counter_set(&tap->n_unwritten, 0);
        atomic_store_explicit(&tap->has_failed, false, memory_order_relaxed);
        atomic_fetch_add_explicit(&tap->recording, 1, memory_order_relaxed);
        /* Release: the part's recorder, and which recording this is, are visible with the phase. */
        atomic_store_explicit(&tap->phase, SHEF_TAP_ON, memory_order_release);
    }
    return SHEF_OK;
}
