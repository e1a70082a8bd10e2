#include "record/block_reader.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "core/crc32c.h"
#include "core/file.h"
#include "record/block_reader_internal.h"

const struct shef_block_summary *shef_block_reader_summary(const struct shef_block_reader *reader)
{
    return &reader->summary;
}

static void close_segment(struct shef_block_reader *reader)
{
    if (reader->index_fd >= 0)
        close(reader->index_fd);
    if (reader->data_fd >= 0)
        close(reader->data_fd);
    reader->index_fd = -1;
    reader->data_fd = -1;
}

static enum shef_err open_segment(struct shef_block_reader *reader, struct shef_error *err)
{
    const struct shef_block_segment *segment = &reader->segments[reader->at_segment];
    char path[PATH_MAX + 32];

    shef_block_reader_path(reader, segment, ".idx", path);
    reader->index_fd = open(path, O_RDONLY | O_CLOEXEC);
    if (reader->index_fd < 0)
        return shef_fail_os(err, errno, "open '%s'", path);
    if (segment->data_bytes > 0) {
        shef_block_reader_path(reader, segment, reader->ending, path);
        reader->data_fd = open(path, O_RDONLY | O_CLOEXEC);
        if (reader->data_fd < 0) {
            const int failure = errno;

            close_segment(reader);
            return shef_fail_os(err, failure, "open '%s'", path);
        }
    }
    reader->at_record = 0;
    reader->segment_end = segment->header.front_bytes;
    reader->n_window = 0;
    return SHEF_OK;
}

static void leave_segment(struct shef_block_reader *reader)
{
    const struct shef_block_segment *segment = &reader->segments[reader->at_segment];

    if (segment->data_bytes > reader->segment_end)
        reader->damage.n_loose_bytes += segment->data_bytes - reader->segment_end;
    close_segment(reader);
    reader->at_segment++;
}

/* Brings the segment's next record into the window. Returns where it lies, or NULL with a
 * sentence. */
static const uint8_t *take_record(struct shef_block_reader *reader, struct shef_error *err)
{
    if (reader->n_window == 0 || reader->at_record >= reader->window_start + reader->n_window) {
        const uint64_t n_left = reader->segments[reader->at_segment].n_records - reader->at_record;
        const size_t n_wanted =
            n_left < SHEF_INDEX_WINDOW_RECORDS ? (size_t)n_left : SHEF_INDEX_WINDOW_RECORDS;
        const ssize_t n_read =
            shef_file_read_at(reader->index_fd, reader->window, n_wanted * SHEF_INDEX_RECORD_BYTES,
                              (reader->at_record + 1) * SHEF_INDEX_RECORD_BYTES);

        if (n_read < 0 || (size_t)n_read < n_wanted * SHEF_INDEX_RECORD_BYTES) {
            (void)shef_fail_os(err, n_read < 0 ? errno : EIO,
                               "read the index of segment %u in '%s'",
                               reader->segments[reader->at_segment].number, reader->folder);
            return NULL;
        }
        reader->window_start = reader->at_record;
        reader->n_window = (uint32_t)n_wanted;
    }
    return reader->window + (reader->at_record - reader->window_start) * SHEF_INDEX_RECORD_BYTES;
}

/* Whether a record with a good checksum can be true. */
static bool is_plausible(const struct shef_block_reader *reader,
                         const struct shef_block_record *record)
{
    const struct shef_block_segment *segment = &reader->segments[reader->at_segment];

    return record->n_bytes >= 1 && record->n_bytes <= reader->max_block_bytes &&
           record->offset >= segment->header.front_bytes && record->offset <= UINT64_MAX / 2 &&
           (!reader->has_delivered || record->number > reader->last_number);
}

/* Reads the block of a record. Returns SHEF_ERR_FORMAT, without a sentence, if it is damaged. */
static enum shef_err read_block(struct shef_block_reader *reader,
                                const struct shef_block_record *record, uint8_t *room,
                                struct shef_error *err)
{
    const struct shef_block_segment *segment = &reader->segments[reader->at_segment];
    const uint64_t end = record->offset + record->n_bytes;

    if (end > reader->segment_end)
        reader->segment_end = end;
    if (end > segment->data_bytes) {
        reader->damage.n_cut_blocks++;
        return SHEF_ERR_FORMAT;
    }
    if (!room)
        return SHEF_OK;

    const ssize_t n_read =
        shef_file_read_at(reader->data_fd, room, record->n_bytes, record->offset);

    if (n_read < 0)
        return shef_fail_os(err, errno, "read segment %u in '%s'", segment->number, reader->folder);
    if ((uint32_t)n_read < record->n_bytes ||
        shef_crc32c(0, room, record->n_bytes) != record->crc32c) {
        reader->damage.n_bad_blocks++;
        return SHEF_ERR_FORMAT;
    }
    return SHEF_OK;
}

/* Looks at the next record of the open segment. SHEF_ERR_FORMAT: it was not deliverable. */
static enum shef_err try_record(struct shef_block_reader *reader, uint8_t *room,
                                struct shef_block *out_block, struct shef_error *err)
{
    struct shef_block_record record;
    const uint8_t *bytes = take_record(reader, err);

    if (!bytes)
        return SHEF_ERR_IO;
    if (!shef_block_record_decode(bytes, &record) || !is_plausible(reader, &record)) {
        reader->damage.n_bad_records++;
        reader->at_record++;
        return SHEF_ERR_FORMAT;
    }
    reader->at_record++;

    const enum shef_err code = read_block(reader, &record, room, err);
    const uint64_t expected = reader->has_delivered ? reader->last_number + 1 : 0;

    if (code != SHEF_OK)
        return code;
    *out_block = (struct shef_block){
        .record = record,
        .segment = reader->segments[reader->at_segment].number,
        .follows = record.number == expected && reader->has_delivered,
    };
    reader->damage.n_missing_blocks += record.number - expected;
    reader->damage.n_lost_buffers += record.n_lost_before;
    reader->position += record.n_bytes;
    reader->last_number = record.number;
    reader->has_delivered = true;
    return SHEF_OK;
}

enum shef_err shef_block_reader_next(struct shef_block_reader *reader, uint8_t *room,
                                     struct shef_block *out_block, struct shef_error *err)
{
    while (reader->at_segment < reader->n_segments) {
        const struct shef_block_segment *segment = &reader->segments[reader->at_segment];
        enum shef_err code = SHEF_OK;

        if (!segment->readable) {
            reader->at_segment++;
            continue;
        }
        if (reader->index_fd < 0)
            code = open_segment(reader, err);
        if (code == SHEF_OK && reader->at_record >= segment->n_records) {
            leave_segment(reader);
            continue;
        }
        if (code == SHEF_OK)
            code = try_record(reader, room, out_block, err);
        if (code != SHEF_ERR_FORMAT)
            return code;
    }
    return SHEF_ERR_EMPTY;
}

void shef_block_reader_rewind(struct shef_block_reader *reader)
{
    close_segment(reader);
    reader->at_segment = 0;
    reader->has_delivered = false;
    reader->position = 0;
}

/* The readable segment of a number, or NULL. */
static const struct shef_block_segment *find_segment(const struct shef_block_reader *reader,
                                                     uint32_t number)
{
    for (uint32_t i = 0; i < reader->n_segments; i++)
        if (reader->segments[i].number == number && reader->segments[i].readable)
            return &reader->segments[i];
    return NULL;
}

/* Opens a segment's data for reading out of order. */
static enum shef_err open_other(struct shef_block_reader *reader,
                                const struct shef_block_segment *segment, struct shef_error *err)
{
    char path[PATH_MAX + 32];

    if (reader->other_fd >= 0 && reader->other_segment == segment->number)
        return SHEF_OK;
    if (reader->other_fd >= 0)
        close(reader->other_fd);
    shef_block_reader_path(reader, segment, reader->ending, path);
    reader->other_segment = segment->number;
    reader->other_fd = open(path, O_RDONLY | O_CLOEXEC);
    return reader->other_fd >= 0 ? SHEF_OK : shef_fail_os(err, errno, "open '%s'", path);
}

enum shef_err shef_block_reader_read(struct shef_block_reader *reader,
                                     const struct shef_block *block, uint8_t *room,
                                     struct shef_error *err)
{
    const struct shef_block_record *record = &block->record;
    const struct shef_block_segment *segment = find_segment(reader, block->segment);
    enum shef_err code = SHEF_ERR_FORMAT;
    ssize_t n_read = 0;

    if (segment && record->n_bytes <= reader->max_block_bytes) {
        code = open_other(reader, segment, err);
        if (code != SHEF_OK)
            return code;
        n_read = shef_file_read_at(reader->other_fd, room, record->n_bytes, record->offset);
        if (n_read < 0)
            return shef_fail_os(err, errno, "read segment %u in '%s'", segment->number,
                                reader->folder);
    }
    if (code == SHEF_OK && (uint32_t)n_read == record->n_bytes &&
        shef_crc32c(0, room, record->n_bytes) == record->crc32c)
        return SHEF_OK;
    reader->damage.n_bad_blocks++;
    return shef_fail(err, SHEF_ERR_FORMAT,
                     "block %llu in segment %u of '%s' is damaged: it does not match its checksum",
                     (unsigned long long)record->number, block->segment, reader->folder);
}

enum shef_err shef_block_reader_front(struct shef_block_reader *reader, uint8_t *room,
                                      uint32_t room_bytes, uint32_t *out_n_bytes,
                                      struct shef_error *err)
{
    for (uint32_t i = 0; i < reader->n_segments; i++) {
        const struct shef_block_segment *segment = &reader->segments[i];
        const uint32_t n_bytes = segment->header.front_bytes;

        if (!segment->readable || segment->data_bytes < n_bytes || n_bytes > room_bytes ||
            open_other(reader, segment, NULL) != SHEF_OK)
            continue;
        if (shef_file_read_at(reader->other_fd, room, n_bytes, 0) == (ssize_t)n_bytes &&
            shef_crc32c(0, room, n_bytes) == segment->header.front_crc32c) {
            *out_n_bytes = n_bytes;
            return SHEF_OK;
        }
    }
    return shef_fail(err, SHEF_ERR_FORMAT,
                     "no data file in '%s' has an intact text at its front, so nothing says what "
                     "its blocks are",
                     reader->folder);
}

const struct shef_damage *shef_block_reader_damage(const struct shef_block_reader *reader)
{
    return &reader->damage;
}

uint64_t shef_block_reader_position(const struct shef_block_reader *reader)
{
    return reader->position;
}

void shef_block_reader_close(struct shef_block_reader *reader)
{
    if (!reader)
        return;
    close_segment(reader);
    if (reader->other_fd >= 0)
        close(reader->other_fd);
    free(reader->segments);
    free(reader);
}
