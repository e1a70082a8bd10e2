#include "record/recorded_frames.h"

#include <assert.h>
#include <lz4.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "record/part_reader.h"

/* A frame by its index record. */
struct entry {
    struct shef_block block;
    struct shef_frame_info info;
    enum shef_frame_coding coding;
};

struct shef_recorded_frames {
    struct shef_part_reader part;
    struct shef_frame_part format;
    struct entry *entries;
    uint32_t n_entries;
    uint32_t at; /* of next() */
    uint32_t max_bytes;
    uint32_t max_coded_bytes; /* 0: no frame is compressed */
    uint8_t *room;            /* max_bytes, made by the first read(); NULL: none yet */
    uint8_t *coded;           /* max_coded_bytes */
    char text[128];
};

static enum shef_err add_entry(struct shef_recorded_frames *frames, const struct shef_block *block,
                               uint32_t *capacity, struct shef_error *err)
{
    struct entry entry = { .block = *block };
    uint32_t n_bytes;

    if (!shef_frame_state_decode(&block->record, &entry.info, &entry.coding)) {
        shef_part_reader_note(&frames->part,
                              "frame block %llu has an impossible size or coding: "
                              "left out",
                              (unsigned long long)block->record.number);
        return SHEF_OK;
    }
    if (frames->n_entries == *capacity) {
        struct entry *grown;

        *capacity = *capacity > 0 ? *capacity * 2 : 256;
        grown = reallocarray(frames->entries, *capacity, sizeof *grown);
        if (!grown)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "list the frames: out of memory");
        frames->entries = grown;
    }
    frames->entries[frames->n_entries++] = entry;
    n_bytes = shef_frame_bytes(&entry.info);
    if (n_bytes > frames->max_bytes)
        frames->max_bytes = n_bytes;
    if (entry.coding == SHEF_FRAME_LZ4 && block->record.n_bytes > frames->max_coded_bytes)
        frames->max_coded_bytes = block->record.n_bytes;
    return SHEF_OK;
}

static enum shef_err list_frames(struct shef_recorded_frames *frames, struct shef_error *err)
{
    struct shef_block block;
    uint32_t capacity = 0;
    enum shef_err code;

    while ((code = shef_block_reader_next(frames->part.blocks, NULL, &block, err)) == SHEF_OK) {
        code = add_entry(frames, &block, &capacity, err);
        if (code != SHEF_OK)
            return code;
    }
    if (code != SHEF_ERR_EMPTY)
        return code;
    shef_part_reader_note_damage(&frames->part);
    return SHEF_OK;
}

static enum shef_err make_room(struct shef_recorded_frames *frames, struct shef_error *err)
{
    if (frames->max_coded_bytes > 0)
        frames->coded = shef_memory_create(frames->max_coded_bytes, 1);
    if (frames->max_coded_bytes > 0 && !frames->coded)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read frames of %u bytes: out of memory",
                         frames->max_bytes);
    return SHEF_OK;
}

static enum shef_err open_frames(struct shef_recorded_frames *frames, const char *path,
                                 struct shef_error *err)
{
    enum shef_err code =
        shef_part_reader_open(&frames->part, path, SHEF_PART_FRAMES, "shef-frames", err);

    if (code != SHEF_OK)
        return code;
    if (!shef_frame_part_decode(shef_block_reader_summary(frames->part.blocks)->header.info,
                                &frames->format))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "the frames of '%s' are in a form that this program does not know", path);
    code = list_frames(frames, err);
    if (code == SHEF_OK && frames->n_entries == 0)
        return shef_fail(err, SHEF_ERR_EMPTY, "the frame part of '%s' holds no readable frame",
                         path);
    return code == SHEF_OK ? make_room(frames, err) : code;
}

enum shef_err shef_recorded_frames_open(const char *path, struct shef_recorded_frames **out_frames,
                                        struct shef_error *err)
{
    struct shef_recorded_frames *frames = calloc(1, sizeof *frames);

    if (!frames)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", path);

    const enum shef_err code = open_frames(frames, path, err);

    if (code != SHEF_OK) {
        shef_recorded_frames_close(frames);
        return code;
    }
    *out_frames = frames;
    return SHEF_OK;
}

uint32_t shef_recorded_frames_count(const struct shef_recorded_frames *frames)
{
    return frames->n_entries;
}

const struct shef_frame_part *shef_recorded_frames_format(const struct shef_recorded_frames *frames)
{
    return &frames->format;
}

const char *shef_recorded_frames_text(struct shef_recorded_frames *frames, const char *key)
{
    (void)shef_front_text_get(&frames->part.front, key, 0, frames->text, sizeof frames->text);
    return frames->text;
}

uint32_t shef_recorded_frames_max_bytes(const struct shef_recorded_frames *frames)
{
    return frames->max_bytes;
}

const struct shef_frame_info *shef_recorded_frames_info(const struct shef_recorded_frames *frames,
                                                        uint32_t index)
{
    assert(index < frames->n_entries);
    return &frames->entries[index].info;
}

bool shef_recorded_frames_find(const struct shef_recorded_frames *frames, uint64_t number,
                               uint32_t *out_index)
{
    for (uint32_t i = 0; i < frames->n_entries; i++)
        if (frames->entries[i].info.number == number) {
            *out_index = i;
            return true;
        }
    return false;
}

uint64_t shef_recorded_frames_missing_before(const struct shef_recorded_frames *frames,
                                             uint32_t index)
{
    assert(index < frames->n_entries);

    const struct shef_block_record *record = &frames->entries[index].block.record;
    const uint64_t expected = index > 0 ? frames->entries[index - 1].block.record.number + 1 : 0;

    return record->number - expected + record->n_lost_before;
}

enum shef_err shef_recorded_frames_read_into(struct shef_recorded_frames *frames, uint32_t index,
                                             uint8_t *room, struct shef_recorded_frame *out_frame,
                                             struct shef_error *err)
{
    assert(index < frames->n_entries);

    const struct entry *entry = &frames->entries[index];
    const uint32_t n_bytes = shef_frame_bytes(&entry->info);
    const bool is_coded = entry->coding == SHEF_FRAME_LZ4;
    const enum shef_err code = shef_block_reader_read(frames->part.blocks, &entry->block,
                                                      is_coded ? frames->coded : room, err);

    if (code != SHEF_OK)
        return code;
    if (is_coded &&
        LZ4_decompress_safe((const char *)frames->coded, (char *)room,
                            (int)entry->block.record.n_bytes, (int)n_bytes) != (int)n_bytes)
        return shef_fail(err, SHEF_ERR_FORMAT, "frame %llu cannot be decompressed",
                         (unsigned long long)entry->info.number);
    *out_frame = (struct shef_recorded_frame){
        .info = entry->info,
        .index = index,
        .follows = index > 0 && shef_recorded_frames_missing_before(frames, index) == 0,
        .n_lost_before = entry->block.record.n_lost_before,
        .pixels = room,
    };
    return SHEF_OK;
}

enum shef_err shef_recorded_frames_read(struct shef_recorded_frames *frames, uint32_t index,
                                        struct shef_recorded_frame *out_frame,
                                        struct shef_error *err)
{
    if (!frames->room)
        frames->room = shef_memory_create(frames->max_bytes, 1);
    if (!frames->room)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read frames of %u bytes: out of memory",
                         frames->max_bytes);
    return shef_recorded_frames_read_into(frames, index, frames->room, out_frame, err);
}

enum shef_err shef_recorded_frames_next(struct shef_recorded_frames *frames,
                                        struct shef_recorded_frame *out_frame,
                                        struct shef_error *err)
{
    bool has_skipped = false;

    while (frames->at < frames->n_entries) {
        const uint32_t index = frames->at++;
        struct shef_error trouble;
        const enum shef_err code = shef_recorded_frames_read(frames, index, out_frame, &trouble);

        if (code == SHEF_OK) {
            out_frame->follows = out_frame->follows && !has_skipped;
            return SHEF_OK;
        }
        if (code != SHEF_ERR_FORMAT) {
            if (err)
                *err = trouble;
            return code;
        }
        shef_part_reader_note(&frames->part, "%s: left out", trouble.text);
        has_skipped = true;
    }
    return SHEF_ERR_EMPTY;
}

void shef_recorded_frames_seek(struct shef_recorded_frames *frames, uint32_t index)
{
    assert(index <= frames->n_entries);
    frames->at = index;
}

const struct shef_damage *shef_recorded_frames_damage(const struct shef_recorded_frames *frames)
{
    return shef_block_reader_damage(frames->part.blocks);
}

const char *shef_recorded_frames_note(const struct shef_recorded_frames *frames, int i)
{
    return shef_part_reader_get_note(&frames->part, i);
}

void shef_recorded_frames_close(struct shef_recorded_frames *frames)
{
    if (!frames)
        return;
    shef_part_reader_close(&frames->part);
    free(frames->entries);
    free(frames->room);
    free(frames->coded);
    free(frames);
}
