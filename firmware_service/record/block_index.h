/* The index of a recorded segment: what stands in NNNNNN.idx beside its data file.
 *
 * One header and then one record per block, 128 bytes each, little-endian, each with a checksum
 * of its own, so that damage to one costs one block. A data file holds what the device sent and
 * nothing else besides a text at its front; everything that is needed to read a block on its own
 * is in its record. docs/recording.md has the tables. Pure functions. Thread: any. */
#ifndef SHEF_RECORD_BLOCK_INDEX_H
#define SHEF_RECORD_BLOCK_INDEX_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_INDEX_RECORD_BYTES 128
#define SHEF_SESSION_BYTES      16
#define SHEF_BLOCK_STATE_BYTES  64
#define SHEF_PART_INFO_BYTES    64

/* The parts of a recording that consist of segments. The numbers are those in the files. */
enum shef_part {
    SHEF_PART_EVENTS = 1,
    SHEF_PART_FRAMES = 2,
    SHEF_PART_POSES = 3,
    SHEF_PART_TRIGGERS = 4,
};

/* What the front of an index says. */
struct shef_index_header {
    uint8_t session[SHEF_SESSION_BYTES]; /* the recording's, so that strangers are noticed */
    enum shef_part part;
    uint32_t segment;                   /* its number, from 0 */
    uint32_t front_bytes;               /* of text before the first block of the data file */
    uint32_t front_crc32c;              /* of that text */
    shef_host_time opened;              /* when the segment was begun */
    int64_t opened_utc_ns;              /* the same by the calendar, since 1970 */
    uint8_t info[SHEF_PART_INFO_BYTES]; /* the part's own: for events its format and size */
};

/* What one record says about one block: a sensor buffer as it came, a frame, a pose packet. */
struct shef_block_record {
    uint64_t offset; /* in the data file */
    uint32_t n_bytes;
    uint32_t crc32c; /* of these bytes */
    uint64_t number; /* in its part, counted over all segments from 0 */
    shef_host_time arrived;
    int64_t first_us; /* the part's own clock at the block's start and end; events: event time */
    int64_t last_us;
    uint32_t n_items;       /* events */
    uint32_t n_triggers;    /* events: external triggers */
    uint32_t n_lost_before; /* blocks that were known to be lost between the last one and this */
    uint8_t state[SHEF_BLOCK_STATE_BYTES]; /* events: the decoder's before the block */
};

void shef_index_header_encode(const struct shef_index_header *header,
                              uint8_t out_bytes[SHEF_INDEX_RECORD_BYTES]);

/* Returns false if the checksum, the version or a field is wrong. */
bool shef_index_header_decode(const uint8_t bytes[SHEF_INDEX_RECORD_BYTES],
                              struct shef_index_header *out_header);

void shef_block_record_encode(const struct shef_block_record *record,
                              uint8_t out_bytes[SHEF_INDEX_RECORD_BYTES]);

/* Returns false if the checksum is wrong. */
bool shef_block_record_decode(const uint8_t bytes[SHEF_INDEX_RECORD_BYTES],
                              struct shef_block_record *out_record);

#ifdef __cplusplus
}
#endif

#endif
