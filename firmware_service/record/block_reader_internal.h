/* What the two halves of the block reader share. */
#ifndef SHEF_RECORD_BLOCK_READER_INTERNAL_H
#define SHEF_RECORD_BLOCK_READER_INTERNAL_H

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "record/block_reader.h"

#define SHEF_INDEX_WINDOW_RECORDS 64

struct shef_block_segment {
    uint32_t number;
    bool has_index;
    bool readable;
    struct shef_index_header header;
    uint64_t n_records;        /* in the index, whole ones */
    uint64_t index_tail_bytes; /* of a record that was cut */
    uint64_t data_bytes;       /* the whole file; 0: it is not there */
};

struct shef_block_reader {
    /* Set by open. */
    char folder[PATH_MAX];
    const char *ending;
    uint32_t max_block_bytes;
    struct shef_block_segment *segments;
    uint32_t n_segments;
    struct shef_block_summary summary;
    /* Where it is. */
    uint32_t at_segment;
    int index_fd; /* -1: the segment is not open */
    int data_fd;
    uint64_t at_record;   /* of the segment, the next one to look at */
    uint64_t segment_end; /* of the data that its records have vouched for so far */
    uint64_t window_start;
    uint32_t n_window;
    uint8_t window[SHEF_INDEX_WINDOW_RECORDS * SHEF_INDEX_RECORD_BYTES];
    bool has_delivered;
    uint64_t last_number; /* delivered */
    uint64_t position;
    struct shef_damage damage;
    /* Of blocks that are read out of order. */
    uint32_t other_segment;
    int other_fd; /* -1: no data file is open */
};

/* The path of one of a segment's files. */
void shef_block_reader_path(const struct shef_block_reader *reader,
                            const struct shef_block_segment *segment, const char *ending,
                            char out_path[PATH_MAX + 32]);

#endif
