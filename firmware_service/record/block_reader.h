/* Reads one part of a recording back, block by block.
 *
 * Only what the index vouches for comes out: a block whose checksum, record or file is damaged is
 * left out and counted, and the next one says that it does not follow. Nothing is believed about
 * order or size of files beyond that. Blocks on disk; after open() nothing is allocated.
 * Thread: one per reader. */
#ifndef SHEF_RECORD_BLOCK_READER_H
#define SHEF_RECORD_BLOCK_READER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_block_reader;

/* What is not as it was recorded. Grows while blocks are read. */
struct shef_damage {
    uint64_t n_missing_blocks;   /* numbers that did not come, for whatever reason */
    uint64_t n_bad_blocks;       /* their bytes do not match their checksum */
    uint64_t n_cut_blocks;       /* their data file ends before them or is not there */
    uint64_t n_bad_records;      /* of an index: checksum, order or size is impossible */
    uint64_t n_loose_bytes;      /* of data files, that no record vouches for */
    uint32_t n_bad_segments;     /* their index is missing or its header is damaged */
    uint32_t n_lost_segments;    /* gaps in the numbers of files */
    uint32_t n_strange_segments; /* of another recording, or of another format */
    uint64_t n_lost_buffers;     /* not damage: lost while recording, before they were blocks */
};

/* What can be said before blocks are read. */
struct shef_block_summary {
    struct shef_index_header header; /* of the first readable segment; the others agree */
    uint32_t n_segments;             /* readable ones */
    uint64_t n_records;              /* in their indexes */
    uint64_t n_bytes;                /* of their data files, fronts not counted */
    bool has_blocks;                 /* of the next: */
    struct shef_block_record first;  /* the first and the last intact record */
    struct shef_block_record last;
};

struct shef_block {
    struct shef_block_record record;
    uint32_t segment;
    bool follows; /* nothing is missing between the block before and this one */
};

/* Lists the segments and reads the fronts of their indexes.
 *   folder           of the part: "REC/events"
 *   ending           of data files: ".raw"; kept
 *   max_block_bytes  larger blocks count as damaged
 * SHEF_ERR_EMPTY: there is no segment, nothing was ever recorded here; no sentence.
 * SHEF_ERR_FORMAT: there are segments, but no index of them can be read.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_block_reader_open(const char *folder, enum shef_part part,
                                                     const char *ending, uint32_t max_block_bytes,
                                                     struct shef_block_reader **out_reader,
                                                     struct shef_error *err);

const struct shef_block_summary *shef_block_reader_summary(const struct shef_block_reader *reader);

/* The text at the front of the data files, from the first one in which it is intact.
 * SHEF_ERR_FORMAT: there is none, or none that fits. */
SHEF_MUST_CHECK enum shef_err shef_block_reader_front(struct shef_block_reader *reader,
                                                      uint8_t *room, uint32_t room_bytes,
                                                      uint32_t *out_n_bytes,
                                                      struct shef_error *err);

/* Reads the next intact block.
 *   room  max_block_bytes for it; NULL: its bytes are not read, only that they are there is
 *         checked
 * SHEF_ERR_EMPTY: there are no more. SHEF_ERR_IO: reading failed. */
SHEF_MUST_CHECK enum shef_err shef_block_reader_next(struct shef_block_reader *reader,
                                                     uint8_t *room, struct shef_block *out_block,
                                                     struct shef_error *err);

/* Makes next() start again with the first block. Damage goes on counting. */
void shef_block_reader_rewind(struct shef_block_reader *reader);

/* Reads the bytes of a block that next() has found, in any order.
 *   room  max_block_bytes for it
 * SHEF_ERR_FORMAT: it is damaged; counted. SHEF_ERR_IO and other errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_block_reader_read(struct shef_block_reader *reader,
                                                     const struct shef_block *block, uint8_t *room,
                                                     struct shef_error *err);

/* What was found so far; complete once next() has said SHEF_ERR_EMPTY. */
const struct shef_damage *shef_block_reader_damage(const struct shef_block_reader *reader);

/* Bytes of data files that are behind the reader, fronts not counted. */
uint64_t shef_block_reader_position(const struct shef_block_reader *reader);

/* NULL is allowed. */
void shef_block_reader_close(struct shef_block_reader *reader);

#ifdef __cplusplus
}
#endif

#endif
