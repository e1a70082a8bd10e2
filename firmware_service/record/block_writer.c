#include "record/block_writer.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc32c.h"

/* A stream whose buffers never end with a word still gets its segments ended, at this many times
 * their size. */
#define CUT_ANYWAY 2

/* The disk is set to work on so much at a time, or all of a second's data would wait for the moment
 * when they have to be there. */
#define EARLY_BYTES (UINT64_C(4) << 20)

/* Returns 0 or errno. */
static int write_all(int fd, const void *bytes, size_t n_bytes)
{
    const uint8_t *at = bytes;

    while (n_bytes > 0) {
        const ssize_t n_written = write(fd, at, n_bytes);

        if (n_written < 0 && errno == EINTR)
            continue;
        if (n_written < 0)
            return errno;
        at += n_written;
        n_bytes -= (size_t)n_written;
    }
    return 0;
}

static enum shef_err fail(struct shef_block_writer *writer, int os_errno, const char *path,
                          struct shef_error *err)
{
    writer->has_failed = true;
    return shef_fail_os(err, os_errno,
                        "record to '%s' (the %llu blocks before, %llu bytes, are kept)", path,
                        (unsigned long long)writer->n_blocks, (unsigned long long)writer->n_bytes);
}

enum shef_err shef_block_writer_open(struct shef_block_writer *writer,
                                     const struct shef_block_writer_config *config,
                                     struct shef_error *err)
{
    assert(config->segment_bytes >= 1 && config->segment_ns >= 1 && config->sync_ns >= 0);
    *writer = (struct shef_block_writer){ .config = *config, .data_fd = -1, .index_fd = -1 };
    writer->config.folder = writer->folder;
    if (snprintf(writer->folder, sizeof writer->folder, "%s", config->folder) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "record to '%s': the path is too long",
                         config->folder);
    return SHEF_OK;
}

/* Closes both files. Returns 0 or the first errno. */
static int close_files(struct shef_block_writer *writer)
{
    int failure = 0;

    if (writer->data_fd >= 0 && close(writer->data_fd) != 0)
        failure = errno;
    if (writer->index_fd >= 0 && close(writer->index_fd) != 0 && failure == 0)
        failure = errno;
    writer->data_fd = -1;
    writer->index_fd = -1;
    return failure;
}

/* Makes both files durable, the data before what vouches for them, as long as they have names. */
static enum shef_err sync_files(struct shef_block_writer *writer, struct shef_error *err)
{
    struct stat info;

    if (fdatasync(writer->data_fd) != 0 || fdatasync(writer->index_fd) != 0)
        return fail(writer, errno, writer->data_path, err);
    if (fstat(writer->data_fd, &info) == 0 && info.st_nlink > 0)
        return SHEF_OK;
    writer->has_failed = true;
    return shef_fail(
        err, SHEF_ERR_GONE,
        "record to '%s': somebody has deleted this file while it was written, and what "
        "was in it is lost",
        writer->data_path);
}

/* Lets the disk begin with what has been written, without waiting for it. */
static void write_back(struct shef_block_writer *writer)
{
    const uint64_t n_bytes = writer->data_bytes - writer->early_bytes;

    if (n_bytes < EARLY_BYTES)
        return;
    /* A file system that cannot does it all at the next sync. */
    (void)sync_file_range(writer->data_fd, (off_t)writer->early_bytes, (off_t)n_bytes,
                          SYNC_FILE_RANGE_WRITE);
    writer->early_bytes = writer->data_bytes;
}

static enum shef_err end_segment(struct shef_block_writer *writer, struct shef_error *err)
{
    if (writer->data_fd < 0)
        return SHEF_OK;

    const enum shef_err code = sync_files(writer, err);
    const int failure = close_files(writer);

    return code != SHEF_OK || failure == 0 ? code : fail(writer, failure, writer->data_path, err);
}

/* Returns the descriptor of a new file, or -1 with errno. */
static int create_file(char *out_path, size_t n_path, const struct shef_block_writer *writer,
                       const char *ending)
{
    snprintf(out_path, n_path, "%s/%06u%s", writer->folder, writer->n_segments, ending);
    return open(out_path, O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
}

/* Writes what stands before the first block. Returns 0 or errno. */
static int write_fronts(struct shef_block_writer *writer, shef_host_time now)
{
    const struct shef_block_writer_config *config = &writer->config;
    struct shef_index_header header = {
        .part = config->part,
        .segment = writer->n_segments,
        .front_bytes = config->front_bytes,
        .front_crc32c = shef_crc32c(0, config->front, config->front_bytes),
        .opened = now,
        .opened_utc_ns = now.ns + config->utc_minus_host_ns,
    };
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

    memcpy(header.session, config->session, SHEF_SESSION_BYTES);
    memcpy(header.info, config->info, SHEF_PART_INFO_BYTES);
    shef_index_header_encode(&header, bytes);

    const int failure = write_all(writer->data_fd, config->front, config->front_bytes);

    return failure == 0 ? write_all(writer->index_fd, bytes, sizeof bytes) : failure;
}

static enum shef_err begin_segment(struct shef_block_writer *writer, shef_host_time now,
                                   struct shef_error *err)
{
    const char *const ending = writer->config.ending;
    int failure = 0;

    if (writer->n_segments >= SHEF_MAX_SEGMENTS)
        return fail(writer, EFBIG, writer->folder, err);
    writer->data_fd = create_file(writer->data_path, sizeof writer->data_path, writer, ending);
    if (writer->data_fd < 0)
        return fail(writer, errno, writer->data_path, err);
    writer->index_fd = create_file(writer->index_path, sizeof writer->index_path, writer, ".idx");
    if (writer->index_fd < 0) {
        failure = errno;
        unlink(writer->data_path);
        close_files(writer);
        return fail(writer, failure, writer->index_path, err);
    }
    failure = write_fronts(writer, now);
    if (failure != 0) {
        unlink(writer->data_path);
        unlink(writer->index_path);
        close_files(writer);
        return fail(writer, failure, writer->data_path, err);
    }
    writer->data_bytes = writer->config.front_bytes;
    writer->index_bytes = SHEF_INDEX_RECORD_BYTES;
    writer->early_bytes = writer->data_bytes;
    writer->opened = now;
    writer->synced = now;
    writer->n_segments++;
    return SHEF_OK;
}

static bool is_segment_full(const struct shef_block_writer *writer, shef_host_time now,
                            bool begins_cleanly)
{
    const uint64_t n_bytes = writer->data_bytes - writer->config.front_bytes;
    const int64_t age_ns = shef_host_time_since(now, writer->opened);
    const uint64_t factor = begins_cleanly ? 1 : CUT_ANYWAY;

    return n_bytes / factor >= writer->config.segment_bytes ||
           age_ns / (int64_t)factor >= writer->config.segment_ns;
}

/* Takes back what an unfinished block has left, so that files end with a complete one. */
static void cut_back(struct shef_block_writer *writer)
{
    /* What cannot be cut is not vouched for by the index and will not be read. */
    if (ftruncate(writer->data_fd, (off_t)writer->data_bytes) != 0 ||
        ftruncate(writer->index_fd, (off_t)writer->index_bytes) != 0)
        return;
}

enum shef_err shef_block_writer_append(struct shef_block_writer *writer, const void *bytes,
                                       uint32_t n_bytes, const struct shef_block_record *record,
                                       bool begins_cleanly, struct shef_error *err)
{
    struct shef_block_record full = *record;
    uint8_t index_bytes[SHEF_INDEX_RECORD_BYTES];
    enum shef_err code = SHEF_OK;

    assert(!writer->has_failed && n_bytes > 0);
    if (writer->data_fd >= 0 && is_segment_full(writer, record->arrived, begins_cleanly))
        code = end_segment(writer, err);
    if (code == SHEF_OK && writer->data_fd < 0)
        code = begin_segment(writer, record->arrived, err);
    if (code != SHEF_OK)
        return code;

    full.offset = writer->data_bytes;
    full.n_bytes = n_bytes;
    full.crc32c = shef_crc32c(0, bytes, n_bytes);
    full.number = writer->n_blocks;
    shef_block_record_encode(&full, index_bytes);

    int failure = write_all(writer->data_fd, bytes, n_bytes);

    if (failure == 0)
        failure = write_all(writer->index_fd, index_bytes, sizeof index_bytes);
    if (failure != 0) {
        cut_back(writer);
        return fail(writer, failure, writer->data_path, err);
    }
    writer->data_bytes += n_bytes;
    writer->index_bytes += sizeof index_bytes;
    writer->n_blocks++;
    writer->n_bytes += n_bytes;

    const int64_t unsynced_ns = shef_host_time_since(record->arrived, writer->synced);

    if (writer->config.sync_ns > 0 && unsynced_ns >= writer->config.sync_ns) {
        writer->synced = record->arrived;
        return sync_files(writer, err);
    }
    write_back(writer);
    return SHEF_OK;
}

enum shef_err shef_block_writer_split(struct shef_block_writer *writer, struct shef_error *err)
{
    assert(!writer->has_failed);
    return end_segment(writer, err);
}

enum shef_err shef_block_writer_close(struct shef_block_writer *writer, struct shef_error *err)
{
    if (writer->has_failed) {
        /* The failure was reported when it happened. */
        close_files(writer);
        return SHEF_OK;
    }
    return end_segment(writer, err);
}
