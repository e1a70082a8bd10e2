/* Writes one part of a recording: segments of blocks, each with its index.
 *
 * A block goes to the data file first and to the index second; what the index does not name was
 * never recorded. So a recording that ends anywhere, by a kill, a full disk or a power cut, is
 * whole up to its last record. After an error the files are cut back to the last complete block
 * and nothing more is written. Blocks on disk; after open() nothing is allocated.
 * Thread: one per writer, not a streaming thread. */
#ifndef SHEF_RECORD_BLOCK_WRITER_H
#define SHEF_RECORD_BLOCK_WRITER_H

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_MAX_SEGMENTS 1000000 /* six digits in a name */

struct shef_block_writer_config {
    const char *folder; /* of the part, which exists: "REC/events"; not kept */
    const char *ending; /* of data files: ".raw"; kept */
    enum shef_part part;
    uint8_t session[SHEF_SESSION_BYTES];
    const void *front; /* put before the first block of every data file; kept */
    uint32_t front_bytes;
    uint8_t info[SHEF_PART_INFO_BYTES]; /* for the index */
    int64_t utc_minus_host_ns;
    uint64_t segment_bytes; /* a segment that has reached this ends with the block, 1 or more */
    int64_t segment_ns;     /* so does one that is as old as this, by arrival times; 1 or more */
    int64_t sync_ns;        /* data are forced to the disk this often; 0: at a segment's end */
};

/* Fields are the writer's own but for the counts. */
struct shef_block_writer {
    /* Set by open. */
    struct shef_block_writer_config config;
    char folder[PATH_MAX];
    /* The current segment; descriptors are -1 when there is none. */
    int data_fd;
    int index_fd;
    char data_path[PATH_MAX + 32];
    char index_path[PATH_MAX + 32];
    uint64_t data_bytes;
    uint64_t index_bytes;
    uint64_t early_bytes; /* of the data, that the disk has been set to work on */
    shef_host_time opened;
    shef_host_time synced;
    /* Counts. */
    uint32_t n_segments;
    uint64_t n_blocks;
    uint64_t n_bytes; /* of blocks */
    bool has_failed;
};

/* Prepares; the first block opens the first segment.
 * SHEF_ERR_INVALID: the folder's path is too long. */
SHEF_MUST_CHECK enum shef_err shef_block_writer_open(struct shef_block_writer *writer,
                                                     const struct shef_block_writer_config *config,
                                                     struct shef_error *err);

/* Appends a block.
 *   bytes   n_bytes, 1 or more
 *   record  arrived, first_us, last_us, n_items, n_triggers, n_lost_before and state; the writer
 *           adds the rest
 *   begins_cleanly  whether a segment may begin with this block: false in the middle of a word
 * Errors of the system; the sentence says how much was kept. SHEF_ERR_GONE: the file was deleted.
 * Then only close() may follow. */
SHEF_MUST_CHECK enum shef_err shef_block_writer_append(struct shef_block_writer *writer,
                                                       const void *bytes, uint32_t n_bytes,
                                                       const struct shef_block_record *record,
                                                       bool begins_cleanly, struct shef_error *err);

/* Ends the segment, so that the next block begins another one, whatever the limits say. Errors as
 * of append(). */
SHEF_MUST_CHECK enum shef_err shef_block_writer_split(struct shef_block_writer *writer,
                                                      struct shef_error *err);

/* Forces everything to the disk and closes. Frees what open() took, on failure too. */
SHEF_MUST_CHECK enum shef_err shef_block_writer_close(struct shef_block_writer *writer,
                                                      struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
