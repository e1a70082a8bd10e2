#include "record/block_index.h"

#include <string.h>

#include "core/crc32c.h"
#include "core/little_endian.h"

/* Where fields lie. Both kinds of record begin with the checksum of the 124 bytes after it. */
enum header_field {
    HEADER_MAGIC = 8,
    HEADER_SESSION = 16,
    HEADER_PART = 32,
    HEADER_SEGMENT = 36,
    HEADER_FRONT_BYTES = 40,
    HEADER_FRONT_CRC = 44,
    HEADER_OPENED = 48,
    HEADER_OPENED_UTC = 56,
    HEADER_INFO = 64,
};

enum record_field {
    RECORD_BLOCK_CRC = 4,
    RECORD_OFFSET = 8,
    RECORD_NUMBER = 16,
    RECORD_ARRIVED = 24,
    RECORD_FIRST = 32,
    RECORD_LAST = 40,
    RECORD_BYTES = 48,
    RECORD_ITEMS = 52,
    RECORD_TRIGGERS = 56,
    RECORD_LOST = 60,
    RECORD_STATE = 64,
};

/* The last digit is the version of the layout. */
static const uint8_t magic[8] = { 'S', 'H', 'E', 'F', 'I', 'D', 'X', '1' };

static uint32_t checksum(const uint8_t *bytes)
{
    return shef_crc32c(0, bytes + 4, SHEF_INDEX_RECORD_BYTES - 4);
}

void shef_index_header_encode(const struct shef_index_header *header,
                              uint8_t out_bytes[SHEF_INDEX_RECORD_BYTES])
{
    memset(out_bytes, 0, SHEF_INDEX_RECORD_BYTES);
    memcpy(out_bytes + HEADER_MAGIC, magic, sizeof magic);
    memcpy(out_bytes + HEADER_SESSION, header->session, SHEF_SESSION_BYTES);
    shef_put_u32_le(out_bytes + HEADER_PART, header->part);
    shef_put_u32_le(out_bytes + HEADER_SEGMENT, header->segment);
    shef_put_u32_le(out_bytes + HEADER_FRONT_BYTES, header->front_bytes);
    shef_put_u32_le(out_bytes + HEADER_FRONT_CRC, header->front_crc32c);
    shef_put_u64_le(out_bytes + HEADER_OPENED, (uint64_t)header->opened.ns);
    shef_put_u64_le(out_bytes + HEADER_OPENED_UTC, (uint64_t)header->opened_utc_ns);
    memcpy(out_bytes + HEADER_INFO, header->info, SHEF_PART_INFO_BYTES);
    shef_put_u32_le(out_bytes, checksum(out_bytes));
}

bool shef_index_header_decode(const uint8_t bytes[SHEF_INDEX_RECORD_BYTES],
                              struct shef_index_header *out_header)
{
    const uint32_t part = shef_get_u32_le(bytes + HEADER_PART);

    if (shef_get_u32_le(bytes) != checksum(bytes) ||
        memcmp(bytes + HEADER_MAGIC, magic, sizeof magic) != 0 || part < SHEF_PART_EVENTS ||
        part > SHEF_PART_TRIGGERS)
        return false;
    *out_header = (struct shef_index_header){
        .part = (enum shef_part)part,
        .segment = shef_get_u32_le(bytes + HEADER_SEGMENT),
        .front_bytes = shef_get_u32_le(bytes + HEADER_FRONT_BYTES),
        .front_crc32c = shef_get_u32_le(bytes + HEADER_FRONT_CRC),
        .opened = { (int64_t)shef_get_u64_le(bytes + HEADER_OPENED) },
        .opened_utc_ns = (int64_t)shef_get_u64_le(bytes + HEADER_OPENED_UTC),
    };
    memcpy(out_header->session, bytes + HEADER_SESSION, SHEF_SESSION_BYTES);
    memcpy(out_header->info, bytes + HEADER_INFO, SHEF_PART_INFO_BYTES);
    return true;
}

void shef_block_record_encode(const struct shef_block_record *record,
                              uint8_t out_bytes[SHEF_INDEX_RECORD_BYTES])
{
    shef_put_u32_le(out_bytes + RECORD_BLOCK_CRC, record->crc32c);
    shef_put_u64_le(out_bytes + RECORD_OFFSET, record->offset);
    shef_put_u64_le(out_bytes + RECORD_NUMBER, record->number);
    shef_put_u64_le(out_bytes + RECORD_ARRIVED, (uint64_t)record->arrived.ns);
    shef_put_u64_le(out_bytes + RECORD_FIRST, (uint64_t)record->first_us);
    shef_put_u64_le(out_bytes + RECORD_LAST, (uint64_t)record->last_us);
    shef_put_u32_le(out_bytes + RECORD_BYTES, record->n_bytes);
    shef_put_u32_le(out_bytes + RECORD_ITEMS, record->n_items);
    shef_put_u32_le(out_bytes + RECORD_TRIGGERS, record->n_triggers);
    shef_put_u32_le(out_bytes + RECORD_LOST, record->n_lost_before);
    memcpy(out_bytes + RECORD_STATE, record->state, SHEF_BLOCK_STATE_BYTES);
    shef_put_u32_le(out_bytes, checksum(out_bytes));
}

bool shef_block_record_decode(const uint8_t bytes[SHEF_INDEX_RECORD_BYTES],
                              struct shef_block_record *out_record)
{
    if (shef_get_u32_le(bytes) != checksum(bytes))
        return false;
    *out_record = (struct shef_block_record){
        .offset = shef_get_u64_le(bytes + RECORD_OFFSET),
        .n_bytes = shef_get_u32_le(bytes + RECORD_BYTES),
        .crc32c = shef_get_u32_le(bytes + RECORD_BLOCK_CRC),
        .number = shef_get_u64_le(bytes + RECORD_NUMBER),
        .arrived = { (int64_t)shef_get_u64_le(bytes + RECORD_ARRIVED) },
        .first_us = (int64_t)shef_get_u64_le(bytes + RECORD_FIRST),
        .last_us = (int64_t)shef_get_u64_le(bytes + RECORD_LAST),
        .n_items = shef_get_u32_le(bytes + RECORD_ITEMS),
        .n_triggers = shef_get_u32_le(bytes + RECORD_TRIGGERS),
        .n_lost_before = shef_get_u32_le(bytes + RECORD_LOST),
    };
    memcpy(out_record->state, bytes + RECORD_STATE, SHEF_BLOCK_STATE_BYTES);
    return true;
}
