/* Opening a part: which segments there are and which belong together. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "record/block_reader_internal.h"

#define NUMBER_DIGITS 6

void shef_block_reader_path(const struct shef_block_reader *reader,
                            const struct shef_block_segment *segment, const char *ending,
                            char out_path[PATH_MAX + 32])
{
    snprintf(out_path, PATH_MAX + 32, "%s/%06u%s", reader->folder, segment->number, ending);
}

/* Whether name is six digits and the ending. */
static bool is_segment_name(const char *name, const char *ending, uint32_t *out_number)
{
    uint32_t number = 0;

    for (int i = 0; i < NUMBER_DIGITS; i++) {
        if (name[i] < '0' || name[i] > '9')
            return false;
        number = number * 10 + (uint32_t)(name[i] - '0');
    }
    *out_number = number;
    return strcmp(name + NUMBER_DIGITS, ending) == 0;
}

static int compare_segments(const void *a, const void *b)
{
    const struct shef_block_segment *one = a;
    const struct shef_block_segment *other = b;

    if (one->number != other->number)
        return one->number < other->number ? -1 : 1;
    /* The index first. */
    return (int)other->has_index - (int)one->has_index;
}

/* Adds an entry for a file; a segment of two files gets two, merged later. */
static bool add_segment(struct shef_block_reader *reader, uint32_t number, bool is_index)
{
    struct shef_block_segment *grown =
        reallocarray(reader->segments, reader->n_segments + 1, sizeof *grown);

    if (!grown)
        return false;
    reader->segments = grown;
    grown[reader->n_segments++] =
        (struct shef_block_segment){ .number = number, .has_index = is_index };
    return true;
}

static enum shef_err list_segments(struct shef_block_reader *reader, struct shef_error *err)
{
    DIR *dir = opendir(reader->folder);
    bool has_memory = true;
    uint32_t n_kept = 0;

    if (!dir)
        return shef_fail_os(err, errno, "open the recorded part '%s'", reader->folder);
    for (const struct dirent *entry; has_memory && (entry = readdir(dir));) {
        uint32_t number;

        if (is_segment_name(entry->d_name, ".idx", &number))
            has_memory = add_segment(reader, number, true);
        else if (is_segment_name(entry->d_name, reader->ending, &number))
            has_memory = add_segment(reader, number, false);
    }
    closedir(dir);
    if (!has_memory)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", reader->folder);
    if (reader->n_segments == 0)
        return SHEF_ERR_EMPTY;
    qsort(reader->segments, reader->n_segments, sizeof *reader->segments, compare_segments);
    for (uint32_t i = 0; i < reader->n_segments; i++)
        if (i == 0 || reader->segments[i].number != reader->segments[n_kept - 1].number)
            reader->segments[n_kept++] = reader->segments[i];
    reader->n_segments = n_kept;
    return SHEF_OK;
}

/* Looks at a segment's files. What cannot be read leaves it unreadable. */
static enum shef_err inspect(struct shef_block_reader *reader, struct shef_block_segment *segment,
                             enum shef_part part, struct shef_error *err)
{
    char path[PATH_MAX + 32];
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];
    struct stat info;

    shef_block_reader_path(reader, segment, reader->ending, path);
    if (stat(path, &info) == 0 && S_ISREG(info.st_mode))
        segment->data_bytes = (uint64_t)info.st_size;
    if (!segment->has_index)
        return SHEF_OK;
    shef_block_reader_path(reader, segment, ".idx", path);

    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

    if (fd < 0)
        return shef_fail_os(err, errno, "open '%s'", path);

    const ssize_t n_read = shef_file_read_at(fd, bytes, sizeof bytes, 0);
    const int failure = n_read < 0 || fstat(fd, &info) != 0 ? errno : 0;

    close(fd);
    if (failure != 0)
        return shef_fail_os(err, failure, "read '%s'", path);
    if (n_read < SHEF_INDEX_RECORD_BYTES || !shef_index_header_decode(bytes, &segment->header) ||
        segment->header.part != part || segment->header.segment != segment->number)
        return SHEF_OK;

    const uint64_t n_record_bytes = (uint64_t)info.st_size - SHEF_INDEX_RECORD_BYTES;

    segment->readable = true;
    segment->n_records = n_record_bytes / SHEF_INDEX_RECORD_BYTES;
    segment->index_tail_bytes = n_record_bytes % SHEF_INDEX_RECORD_BYTES;
    return SHEF_OK;
}

/* Finds the segments that belong together and counts the others. */
static enum shef_err agree(struct shef_block_reader *reader, struct shef_error *err)
{
    struct shef_block_summary *summary = &reader->summary;
    struct shef_damage *damage = &reader->damage;

    for (uint32_t i = 0; i < reader->n_segments; i++) {
        struct shef_block_segment *segment = &reader->segments[i];
        const uint32_t expected = i == 0 ? 0 : reader->segments[i - 1].number + 1;

        damage->n_lost_segments += segment->number - expected;
        if (!segment->readable) {
            damage->n_bad_segments++;
            damage->n_loose_bytes += segment->data_bytes;
            continue;
        }
        if (summary->n_segments == 0) {
            summary->header = segment->header;
        } else if (memcmp(segment->header.session, summary->header.session, SHEF_SESSION_BYTES) !=
                       0 ||
                   memcmp(segment->header.info, summary->header.info, SHEF_PART_INFO_BYTES) != 0) {
            segment->readable = false;
            damage->n_strange_segments++;
            continue;
        }
        summary->n_segments++;
        summary->n_records += segment->n_records;
        damage->n_bad_records += segment->index_tail_bytes > 0;
        if (segment->data_bytes > segment->header.front_bytes)
            summary->n_bytes += segment->data_bytes - segment->header.front_bytes;
    }
    if (summary->n_segments > 0)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_FORMAT,
                     "none of the %u segments in '%s' has a readable index; the data files can be "
                     "read one by one",
                     reader->n_segments, reader->folder);
}

/* Finds the first (step 1) or last (step -1) intact record of a segment. */
static bool find_record(const struct shef_block_reader *reader,
                        const struct shef_block_segment *segment, int step,
                        struct shef_block_record *out_record)
{
    char path[PATH_MAX + 32];
    bool found = false;

    shef_block_reader_path(reader, segment, ".idx", path);

    const int fd = open(path, O_RDONLY | O_CLOEXEC);

    for (uint64_t i = 0; fd >= 0 && !found && i < segment->n_records; i++) {
        const uint64_t record = step > 0 ? i : segment->n_records - 1 - i;
        uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

        found =
            shef_file_read_at(fd, bytes, sizeof bytes, (record + 1) * SHEF_INDEX_RECORD_BYTES) ==
                SHEF_INDEX_RECORD_BYTES &&
            shef_block_record_decode(bytes, out_record);
    }
    if (fd >= 0)
        close(fd);
    return found;
}

static void find_ends(struct shef_block_reader *reader)
{
    struct shef_block_summary *summary = &reader->summary;

    for (uint32_t i = 0; i < reader->n_segments && !summary->has_blocks; i++)
        if (reader->segments[i].readable)
            summary->has_blocks = find_record(reader, &reader->segments[i], 1, &summary->first);
    for (uint32_t i = reader->n_segments; summary->has_blocks && i > 0; i--)
        if (reader->segments[i - 1].readable &&
            find_record(reader, &reader->segments[i - 1], -1, &summary->last))
            break;
}

enum shef_err shef_block_reader_open(const char *folder, enum shef_part part, const char *ending,
                                     uint32_t max_block_bytes,
                                     struct shef_block_reader **out_reader, struct shef_error *err)
{
    struct shef_block_reader *reader = calloc(1, sizeof *reader);

    if (!reader)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", folder);
    reader->ending = ending;
    reader->max_block_bytes = max_block_bytes;
    reader->index_fd = -1;
    reader->data_fd = -1;
    reader->other_fd = -1;

    enum shef_err code = SHEF_OK;

    if (snprintf(reader->folder, sizeof reader->folder, "%s", folder) >= PATH_MAX)
        code = shef_fail(err, SHEF_ERR_INVALID, "open '%s': the path is too long", folder);
    if (code == SHEF_OK)
        code = list_segments(reader, err);
    for (uint32_t i = 0; code == SHEF_OK && i < reader->n_segments; i++)
        code = inspect(reader, &reader->segments[i], part, err);
    if (code == SHEF_OK)
        code = agree(reader, err);
    if (code != SHEF_OK) {
        shef_block_reader_close(reader);
        return code;
    }
    find_ends(reader);
    *out_reader = reader;
    return SHEF_OK;
}
