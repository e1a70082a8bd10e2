#include "record/event_recorder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "codecs/evt_word.h"
#include "core/cpu.h"
#include "record/block_writer.h"
#include "record/event_part.h"

struct shef_event_recorder {
    struct shef_recording_writer *recording;
    struct shef_block_writer blocks;
    struct shef_evt_decoder decoder;
    bool has_first; /* event or trigger */
    char front[SHEF_RAW_HEADER_BYTES];
    struct shef_event scratch[SHEF_BATCH_EVENTS]; /* events that are only counted */
};

struct shef_event_recorder_config shef_event_recorder_default_config(
    const struct shef_raw_header *camera)
{
    return (struct shef_event_recorder_config){
        .camera = *camera,
        .features = shef_cpu_features(),
        .segment_bytes = UINT64_C(512) << 20,
        .segment_ns = 60 * SHEF_NS_PER_S,
        .sync_ns = SHEF_NS_PER_S,
    };
}

static enum shef_err open_blocks(struct shef_event_recorder *recorder,
                                 const struct shef_event_recorder_config *config,
                                 struct shef_error *err)
{
    const struct shef_raw_header *camera = &config->camera;
    const struct shef_manifest *manifest = &recorder->recording->manifest;
    const struct shef_event_part part = { camera->format, camera->width_px, camera->height_px };
    char path[SHEF_PART_PATH_BYTES];
    struct shef_block_writer_config blocks = {
        .folder = path,
        .ending = SHEF_EVENT_ENDING,
        .part = SHEF_PART_EVENTS,
        .front = recorder->front,
        .front_bytes = (uint32_t)shef_raw_header_write(camera, SHEF_RAW_NEW, recorder->front),
        .utc_minus_host_ns = manifest->utc_minus_host_ns,
        .segment_bytes = config->segment_bytes,
        .segment_ns = config->segment_ns,
        .sync_ns = config->sync_ns,
    };
    const enum shef_err code =
        shef_recording_writer_add_part(recorder->recording, SHEF_EVENT_FOLDER, path, err);

    if (code != SHEF_OK)
        return code;
    memcpy(blocks.session, manifest->session, SHEF_SESSION_BYTES);
    shef_event_part_encode(&part, blocks.info);
    return shef_block_writer_open(&recorder->blocks, &blocks, err);
}

enum shef_err shef_event_recorder_start(struct shef_recording_writer *recording,
                                        const struct shef_event_recorder_config *config,
                                        struct shef_event_recorder **out_recorder,
                                        struct shef_error *err)
{
    struct shef_event_recorder *recorder = calloc(1, sizeof *recorder);

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record to '%s': out of memory",
                         recording->folder);
    recorder->recording = recording;
    shef_evt_init(&recorder->decoder, config->camera.format, config->camera.width_px,
                  config->camera.height_px, config->near_us, config->features);
    recording->manifest.events = (struct shef_manifest_events){
        .is_present = true,
        .camera = config->camera,
    };

    enum shef_err code = open_blocks(recorder, config, err);

    if (code == SHEF_OK)
        code = shef_recording_writer_update(recording, err);
    if (code != SHEF_OK) {
        free(recorder);
        return code;
    }
    *out_recorder = recorder;
    return SHEF_OK;
}

/* Notes the first times in a batch, of the block and of the recording. */
static void note_first(struct shef_event_recorder *recorder, const struct shef_event_batch *batch,
                       struct shef_block_record *record, bool *block_has_first)
{
    int64_t first_us;

    if (batch->n_triggers > 0 && batch->triggers[0].n_before == 0)
        first_us = batch->triggers[0].t_us;
    else if (batch->n_events > 0)
        first_us = shef_event_batch_time_us(batch, 0);
    else
        return;
    if (!*block_has_first)
        record->first_us = first_us;
    *block_has_first = true;
    if (!recorder->has_first)
        recorder->recording->manifest.events.first_us = first_us;
    recorder->has_first = true;
}

/* Decodes a block and fills in what its record says about it. */
static void survey(struct shef_event_recorder *recorder, const uint8_t *bytes, uint32_t n_bytes,
                   struct shef_block_record *record)
{
    struct shef_evt_decoder *decoder = &recorder->decoder;
    struct shef_event_batch batch = { .events = recorder->scratch, .capacity = SHEF_BATCH_EVENTS };
    const struct shef_evt_stats before = decoder->stats;
    bool has_first = false;

    shef_evt_save(decoder, record->state);
    for (size_t at = 0; at < n_bytes;) {
        shef_event_batch_clear(&batch);
        at += shef_evt_decode(decoder, bytes + at, n_bytes - at, &batch);
        note_first(recorder, &batch, record, &has_first);
    }
    record->last_us = shef_evt_reached_us(decoder);
    if (!has_first)
        record->first_us = record->last_us;
    record->n_items = (uint32_t)(decoder->stats.n_events - before.n_events);
    record->n_triggers = (uint32_t)(decoder->stats.n_triggers - before.n_triggers);
}

static void note_loss(struct shef_event_recorder *recorder, uint32_t n_lost)
{
    struct shef_manifest_events *events = &recorder->recording->manifest.events;

    if (n_lost == 0)
        return;
    events->n_lost_buffers += n_lost;
    if (events->n_gaps < SHEF_MANIFEST_MAX_GAPS)
        events->gaps[events->n_gaps++] =
            (struct shef_manifest_gap){ shef_evt_reached_us(&recorder->decoder), n_lost };
}

static void note_failure(struct shef_event_recorder *recorder, const struct shef_error *failure,
                         struct shef_error *err)
{
    shef_recording_writer_judge(recorder->recording, SHEF_VERDICT_STOPPED, failure->text);
    if (err)
        *err = *failure;
}

/* What is on the disk by now. */
static void note_counts(struct shef_event_recorder *recorder)
{
    struct shef_manifest_events *events = &recorder->recording->manifest.events;

    events->n_segments = recorder->blocks.n_segments;
    events->n_blocks = recorder->blocks.n_blocks;
    events->last_us = shef_evt_reached_us(&recorder->decoder);
    events->stats = recorder->decoder.stats;
}

enum shef_err shef_event_recorder_restart(struct shef_event_recorder *recorder,
                                          const uint8_t state[SHEF_EVT_STATE_BYTES],
                                          int64_t shift_us, struct shef_error *err)
{
    uint8_t shifted[SHEF_EVT_STATE_BYTES];
    struct shef_error failure;
    enum shef_err code;

    shef_evt_finish(&recorder->decoder);
    memcpy(shifted, state, sizeof shifted);
    shef_evt_state_shift(shifted, shift_us);
    /* A state that is none: decoding finds its own way. */
    (void)!shef_evt_restore(&recorder->decoder, shifted, NULL);
    code = shef_block_writer_split(&recorder->blocks, &failure);
    if (code != SHEF_OK)
        note_failure(recorder, &failure, err);
    return code;
}

enum shef_err shef_event_recorder_write(struct shef_event_recorder *recorder, const uint8_t *bytes,
                                        uint32_t n_bytes, shef_host_time arrived,
                                        uint32_t n_lost_before, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    note_loss(recorder, n_lost_before);
    for (uint32_t at = 0; code == SHEF_OK && at < n_bytes;) {
        const uint32_t n_left = n_bytes - at;
        const uint32_t n =
            n_left < SHEF_EVENT_BLOCK_MAX_BYTES ? n_left : SHEF_EVENT_BLOCK_MAX_BYTES;
        const bool begins_cleanly = recorder->decoder.n_carried == 0;
        struct shef_block_record record = {
            .arrived = arrived,
            .n_lost_before = at == 0 ? n_lost_before : 0,
        };
        struct shef_error failure;

        survey(recorder, bytes + at, n, &record);
        code = shef_block_writer_append(&recorder->blocks, bytes + at, n, &record, begins_cleanly,
                                        &failure);
        if (code == SHEF_OK)
            note_counts(recorder);
        else
            note_failure(recorder, &failure, err);
        at += n;
    }
    return code;
}

/* Adds "N WHAT" to a sentence, if there are any. */
static void add_loss(char *reason, size_t n_bytes, uint64_t n, const char *what)
{
    const size_t used = strlen(reason);

    if (n > 0)
        snprintf(reason + used, n_bytes - used, "%s%llu times %s", used > 0 ? ", " : "",
                 (unsigned long long)n, what);
}

static void judge(struct shef_event_recorder *recorder)
{
    const struct shef_manifest_events *events = &recorder->recording->manifest.events;
    const struct shef_evt_stats *stats = &events->stats;
    char reason[SHEF_ERROR_TEXT_BYTES] = "";

    if (events->n_lost_buffers > 0)
        snprintf(reason, sizeof reason, "%llu sensor buffers were lost before they were recorded",
                 (unsigned long long)events->n_lost_buffers);
    add_loss(reason, sizeof reason, stats->n_violations[SHEF_EVT_TIME_GAP],
             "the sensor's time jumped over lost data");
    add_loss(reason, sizeof reason, stats->n_resyncs, "its words lost their alignment");
    shef_recording_writer_judge(recorder->recording,
                                *reason ? SHEF_VERDICT_GAPS : SHEF_VERDICT_CLEAN, reason);
}

enum shef_err shef_event_recorder_stop(struct shef_event_recorder *recorder, struct shef_error *err)
{
    struct shef_error failure;

    if (!recorder->blocks.has_failed) {
        shef_evt_finish(&recorder->decoder);
        note_counts(recorder);
    }

    const enum shef_err code = shef_block_writer_close(&recorder->blocks, &failure);

    if (code != SHEF_OK)
        note_failure(recorder, &failure, err);
    judge(recorder);
    free(recorder);
    return code;
}
