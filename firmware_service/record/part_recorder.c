#include "record/part_recorder.h"

#include <string.h>

#include "core/time.h"
#include "record/part_table.h"

struct shef_segment_limits shef_segment_limits_default(void)
{
    return (struct shef_segment_limits){
        .segment_bytes = UINT64_C(512) << 20,
        .segment_ns = 60 * SHEF_NS_PER_S,
        .sync_ns = SHEF_NS_PER_S,
    };
}

enum shef_err shef_part_recorder_start(struct shef_part_recorder *recorder,
                                       struct shef_recording_writer *recording, enum shef_part part,
                                       const uint8_t info[SHEF_PART_INFO_BYTES],
                                       const struct shef_segment_limits *limits,
                                       struct shef_error *err)
{
    const struct shef_part_kind *kind = shef_part_kind(part);
    const struct shef_manifest *manifest = &recording->manifest;
    char path[SHEF_PART_PATH_BYTES];
    struct shef_block_writer_config blocks = {
        .folder = path,
        .ending = kind->ending,
        .part = part,
        .front = recorder->front.bytes,
        .front_bytes = recorder->front.n_bytes,
        .utc_minus_host_ns = manifest->utc_minus_host_ns,
        .segment_bytes = limits->segment_bytes,
        .segment_ns = limits->segment_ns,
        .sync_ns = limits->sync_ns,
    };
    enum shef_err code = shef_recording_writer_add_part(recording, kind->folder, path, err);

    if (code != SHEF_OK)
        return code;
    memcpy(blocks.session, manifest->session, SHEF_SESSION_BYTES);
    memcpy(blocks.info, info, SHEF_PART_INFO_BYTES);
    recorder->recording = recording;
    recorder->counts = &recording->manifest.parts[part];
    *recorder->counts = (struct shef_manifest_part){ .is_present = true };
    code = shef_block_writer_open(&recorder->blocks, &blocks, err);
    return code == SHEF_OK ? shef_recording_writer_update(recording, err) : code;
}

static void note_failure(struct shef_part_recorder *recorder, const struct shef_error *failure,
                         struct shef_error *err)
{
    shef_recording_writer_judge(recorder->recording, SHEF_VERDICT_STOPPED, failure->text);
    if (err)
        *err = *failure;
}

enum shef_err shef_part_recorder_write(struct shef_part_recorder *recorder, const void *bytes,
                                       uint32_t n_bytes, const struct shef_block_record *record,
                                       struct shef_error *err)
{
    struct shef_manifest_part *counts = recorder->counts;
    struct shef_error failure;
    const enum shef_err code =
        shef_block_writer_append(&recorder->blocks, bytes, n_bytes, record, true, &failure);

    counts->n_lost += record->n_lost_before;
    if (code != SHEF_OK) {
        note_failure(recorder, &failure, err);
        return code;
    }
    if (counts->n_blocks == 0)
        counts->first_us = record->first_us;
    counts->last_us = record->last_us;
    counts->n_segments = recorder->blocks.n_segments;
    counts->n_blocks = recorder->blocks.n_blocks;
    counts->n_bytes = recorder->blocks.n_bytes;
    counts->n_items += record->n_items;
    return SHEF_OK;
}

enum shef_err shef_part_recorder_stop(struct shef_part_recorder *recorder, const char *reason,
                                      struct shef_error *err)
{
    struct shef_error failure;
    const enum shef_err code = shef_block_writer_close(&recorder->blocks, &failure);

    if (code != SHEF_OK)
        note_failure(recorder, &failure, err);
    shef_recording_writer_judge(recorder->recording,
                                *reason ? SHEF_VERDICT_GAPS : SHEF_VERDICT_CLEAN, reason);
    return code;
}
