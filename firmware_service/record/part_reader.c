#include "record/part_reader.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "record/part_table.h"

static enum shef_err open_blocks(struct shef_part_reader *reader, const char *path,
                                 enum shef_part part, struct shef_error *err)
{
    const struct shef_part_kind *kind = shef_part_kind(part);
    char folder[PATH_MAX];

    if (snprintf(folder, sizeof folder, "%s/%s", path, kind->folder) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "open '%s': the path is too long", path);

    const enum shef_err code = shef_block_reader_open(folder, part, kind->ending,
                                                      kind->max_block_bytes, &reader->blocks, err);

    if (code == SHEF_ERR_NOT_FOUND)
        return shef_fail(err, code, "the recording '%s' has no %s (no folder %s in it)", path,
                         kind->name, kind->folder);
    if (code == SHEF_ERR_EMPTY)
        return shef_fail(err, code, "the %s of '%s' ended before anything was recorded", kind->name,
                         path);
    return code;
}

enum shef_err shef_part_reader_open(struct shef_part_reader *reader, const char *path,
                                    enum shef_part part, const char *front_kind,
                                    struct shef_error *err)
{
    enum shef_err code;

    memset(reader, 0, sizeof *reader);
    code = open_blocks(reader, path, part, err);
    if (code != SHEF_OK)
        return code;
    code = shef_block_reader_front(reader->blocks, (uint8_t *)reader->front.bytes,
                                   sizeof reader->front.bytes, &reader->front.n_bytes, err);
    if (code == SHEF_OK) {
        code = shef_front_text_check(&reader->front, front_kind, err);
        if (code != SHEF_OK)
            (void)shef_fail_context(err, "the %s of '%s'", shef_part_kind(part)->name, path);
    }
    if (code != SHEF_OK)
        shef_part_reader_close(reader);
    return code;
}

void shef_part_reader_note(struct shef_part_reader *reader, const char *fmt, ...)
{
    va_list args;

    if (reader->notes.n == SHEF_PART_MAX_NOTES)
        return;
    va_start(args, fmt);
    vsnprintf(reader->notes.texts[reader->notes.n++], SHEF_ERROR_TEXT_BYTES, fmt, args);
    va_end(args);
}

static void note_count(struct shef_part_reader *reader, uint64_t n, const char *what)
{
    if (n > 0)
        shef_part_reader_note(reader, "%llu %s", (unsigned long long)n, what);
}

void shef_part_reader_note_damage(struct shef_part_reader *reader)
{
    const struct shef_damage *damage = shef_block_reader_damage(reader->blocks);

    note_count(reader, damage->n_bad_blocks, "blocks do not match their checksums: left out");
    note_count(reader, damage->n_cut_blocks, "blocks lie beyond the ends of their files: left out");
    note_count(reader, damage->n_bad_records, "records of indexes are damaged: left out");
    note_count(reader, damage->n_loose_bytes, "bytes have no record in an index: left out");
    note_count(reader, damage->n_bad_segments, "segments have no readable index: left out");
    note_count(reader, damage->n_lost_segments, "segments are missing");
    note_count(reader, damage->n_strange_segments, "segments are of another recording: left out");
    note_count(reader, damage->n_missing_blocks, "blocks are missing between others");
    note_count(reader, damage->n_lost_buffers, "were lost while recording");
}

const char *shef_part_reader_get_note(const struct shef_part_reader *reader, int i)
{
    return i >= 0 && i < reader->notes.n ? reader->notes.texts[i] : NULL;
}

void shef_part_reader_close(struct shef_part_reader *reader)
{
    shef_block_reader_close(reader->blocks);
    reader->blocks = NULL;
}
