#include "record/frame_recorder.h"

#include <lz4.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/memory.h"

struct shef_frame_recorder {
    struct shef_part_recorder part;
    uint8_t *room; /* for its LZ4 block; NULL: frames stay raw */
    int room_bytes;
    bool has_last;
    uint64_t last_number; /* the camera's */
    uint64_t n_incomplete;
};

struct shef_frame_recorder_config shef_frame_recorder_default_config(
    const struct shef_frame_part *format)
{
    return (struct shef_frame_recorder_config){
        .format = *format,
        .limits = shef_segment_limits_default(),
    };
}

static void add_text(struct shef_front_text *front, const char *key, const char *value)
{
    /* A text that is too long says nothing that reading needs. */
    if (value && *value)
        (void)shef_front_text_add(front, key, value);
}

static void write_front(struct shef_frame_recorder *recorder,
                        const struct shef_frame_recorder_config *config)
{
    struct shef_front_text *front = &recorder->part.front;

    shef_front_text_begin(front, "shef-frames");
    add_text(front, "vendor", config->vendor);
    add_text(front, "model", config->model);
    add_text(front, "serial", config->serial);
    shef_front_text_end(front);
}

static void describe(struct shef_frame_recorder *recorder,
                     const struct shef_frame_recorder_config *config)
{
    const struct shef_frame_part *format = &config->format;
    struct shef_manifest_part *counts = recorder->part.counts;

    snprintf(counts->source, sizeof counts->source, "%.40s %.60s %.40s, %u x %u px, format 0x%08x",
             config->vendor ? config->vendor : "a camera", config->model ? config->model : "",
             config->serial ? config->serial : "", format->width_px, format->height_px,
             format->pixel_format);
}

/* Checks the format and makes room for its frames. */
static enum shef_err prepare(struct shef_frame_recorder *recorder,
                             const struct shef_frame_recorder_config *config,
                             struct shef_error *err)
{
    uint8_t info[SHEF_PART_INFO_BYTES];
    struct shef_frame_part same;

    shef_frame_part_encode(&config->format, info);
    if (!shef_frame_part_decode(info, &same))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record frames of %u x %u px in format 0x%08x: sides must be 1 to %d px "
                         "and the format a code of PFNC",
                         config->format.width_px, config->format.height_px,
                         config->format.pixel_format, SHEF_FRAME_MAX_SIDE_PX);
    if (!config->with_lz4)
        return SHEF_OK;
    recorder->room_bytes = LZ4_compressBound(SHEF_FRAME_MAX_BYTES);
    recorder->room = shef_memory_create((size_t)recorder->room_bytes, 1);
    return recorder->room ? SHEF_OK
                          : shef_fail(err, SHEF_ERR_NO_MEMORY, "record frames: out of memory");
}

static void free_recorder(struct shef_frame_recorder *recorder)
{
    free(recorder->room);
    free(recorder);
}

enum shef_err shef_frame_recorder_start(struct shef_recording_writer *recording,
                                        const struct shef_frame_recorder_config *config,
                                        struct shef_frame_recorder **out_recorder,
                                        struct shef_error *err)
{
    struct shef_frame_recorder *recorder = calloc(1, sizeof *recorder);
    uint8_t info[SHEF_PART_INFO_BYTES];
    enum shef_err code;

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record to '%s': out of memory",
                         recording->folder);
    write_front(recorder, config);
    code = prepare(recorder, config, err);
    shef_frame_part_encode(&config->format, info);
    if (code == SHEF_OK)
        code = shef_part_recorder_start(&recorder->part, recording, SHEF_PART_FRAMES, info,
                                        &config->limits, err);
    if (code != SHEF_OK) {
        free_recorder(recorder);
        return code;
    }
    describe(recorder, config);
    *out_recorder = recorder;
    return SHEF_OK;
}

/* How many frames are missing before this one: what the caller knows, or what the camera's count
 * says if that is more. A count that steps back has begun anew. */
static uint32_t count_lost(const struct shef_frame_recorder *recorder,
                           const struct shef_frame_info *info, uint32_t n_lost_before)
{
    if (!recorder->has_last || info->number <= recorder->last_number)
        return n_lost_before;

    const uint64_t n_skipped = info->number - recorder->last_number - 1;

    if (n_skipped <= n_lost_before)
        return n_lost_before;
    return n_skipped < UINT32_MAX ? (uint32_t)n_skipped : UINT32_MAX;
}

enum shef_err shef_frame_recorder_write(struct shef_frame_recorder *recorder,
                                        const struct shef_frame_info *info, const void *pixels,
                                        uint32_t n_lost_before, struct shef_error *err)
{
    const uint32_t n_bytes = shef_frame_bytes(info);
    struct shef_block_record record = {
        .arrived = info->arrived,
        .first_us = info->time.ns / SHEF_NS_PER_US,
        .last_us = info->time.ns / SHEF_NS_PER_US,
        .n_items = 1,
        .n_lost_before = count_lost(recorder, info, n_lost_before),
    };
    int n_coded = 0;

    if (n_bytes == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record frame %llu of %u x %u px, rows of %u bytes, format 0x%08x: no "
                         "such frame can be",
                         (unsigned long long)info->number, info->width_px, info->height_px,
                         info->row_bytes, info->pixel_format);
    if (recorder->room)
        n_coded = LZ4_compress_default(pixels, (char *)recorder->room, (int)n_bytes,
                                       recorder->room_bytes);

    const bool is_smaller = n_coded > 0 && (uint32_t)n_coded < n_bytes;

    shef_frame_state_encode(info, is_smaller ? SHEF_FRAME_LZ4 : SHEF_FRAME_RAW, record.state);
    recorder->has_last = true;
    recorder->last_number = info->number;
    recorder->n_incomplete += info->status != 0;
    return shef_part_recorder_write(&recorder->part, is_smaller ? recorder->room : pixels,
                                    is_smaller ? (uint32_t)n_coded : n_bytes, &record, err);
}

enum shef_err shef_frame_recorder_stop(struct shef_frame_recorder *recorder, struct shef_error *err)
{
    const uint64_t n_lost = recorder->part.counts->n_lost;
    char reason[160] = "";

    if (n_lost > 0 && recorder->n_incomplete > 0)
        snprintf(reason, sizeof reason,
                 "%llu frames were lost before they were recorded and %llu are incomplete",
                 (unsigned long long)n_lost, (unsigned long long)recorder->n_incomplete);
    else if (n_lost > 0)
        snprintf(reason, sizeof reason, "%llu frames were lost before they were recorded",
                 (unsigned long long)n_lost);
    else if (recorder->n_incomplete > 0)
        snprintf(reason, sizeof reason, "%llu frames are incomplete",
                 (unsigned long long)recorder->n_incomplete);

    const enum shef_err code = shef_part_recorder_stop(&recorder->part, reason, err);

    free_recorder(recorder);
    return code;
}
