#include "record/block_index.h"

#include <string.h>

#include "record/event_part.h"
#include "support/support.h"

static const struct shef_index_header header = {
    .session = { 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 255 },
    .part = SHEF_PART_FRAMES,
    .segment = 123456,
    .front_bytes = 345,
    .front_crc32c = 0xfedcba98,
    .opened = { INT64_C(-1234567890123456789) },
    .opened_utc_ns = INT64_C(1772366400123456789),
    .info = { 9, 8, 7, [63] = 6 },
};

static const struct shef_block_record record = {
    .offset = UINT64_C(0x123456789abcdef0),
    .n_bytes = 131072,
    .crc32c = 0xdeadbeef,
    .number = UINT64_C(0xfedcba9876543210),
    .arrived = { INT64_C(987654321987654321) },
    .first_us = -5,
    .last_us = INT64_C(1) << 40,
    .n_items = 32768,
    .n_triggers = 7,
    .n_lost_before = 0xffffffff,
    .state = { 1, [63] = 2 },
};

static void test_headers_and_records_come_back(void)
{
    struct shef_index_header header_back;
    struct shef_block_record record_back;
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

    memset(&header_back, 0, sizeof header_back);
    shef_index_header_encode(&header, bytes);
    TEST_ASSERT_TRUE(shef_index_header_decode(bytes, &header_back));
    TEST_ASSERT_EQUAL_MEMORY(header.session, header_back.session, SHEF_SESSION_BYTES);
    TEST_ASSERT_EQUAL_MEMORY(header.info, header_back.info, SHEF_PART_INFO_BYTES);
    TEST_ASSERT_EQUAL(header.part, header_back.part);
    TEST_ASSERT_EQUAL_UINT32(header.segment, header_back.segment);
    TEST_ASSERT_EQUAL_UINT32(header.front_bytes, header_back.front_bytes);
    TEST_ASSERT_EQUAL_HEX32(header.front_crc32c, header_back.front_crc32c);
    TEST_ASSERT_EQUAL_INT64(header.opened.ns, header_back.opened.ns);
    TEST_ASSERT_EQUAL_INT64(header.opened_utc_ns, header_back.opened_utc_ns);

    shef_block_record_encode(&record, bytes);
    TEST_ASSERT_TRUE(shef_block_record_decode(bytes, &record_back));
    TEST_ASSERT_EQUAL_UINT64(record.offset, record_back.offset);
    TEST_ASSERT_EQUAL_UINT32(record.n_bytes, record_back.n_bytes);
    TEST_ASSERT_EQUAL_HEX32(record.crc32c, record_back.crc32c);
    TEST_ASSERT_EQUAL_UINT64(record.number, record_back.number);
    TEST_ASSERT_EQUAL_INT64(record.arrived.ns, record_back.arrived.ns);
    TEST_ASSERT_EQUAL_INT64(record.first_us, record_back.first_us);
    TEST_ASSERT_EQUAL_INT64(record.last_us, record_back.last_us);
    TEST_ASSERT_EQUAL_UINT32(record.n_items, record_back.n_items);
    TEST_ASSERT_EQUAL_UINT32(record.n_triggers, record_back.n_triggers);
    TEST_ASSERT_EQUAL_UINT32(record.n_lost_before, record_back.n_lost_before);
    TEST_ASSERT_EQUAL_MEMORY(record.state, record_back.state, SHEF_BLOCK_STATE_BYTES);
}

static void test_the_layout_is_the_documented_one(void)
{
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

    shef_index_header_encode(&header, bytes);
    TEST_ASSERT_EQUAL_MEMORY("SHEFIDX1", bytes + 8, 8);
    TEST_ASSERT_EQUAL_HEX8(2, bytes[32]);
    TEST_ASSERT_EQUAL_HEX8(0x40, bytes[36]); /* 123456 = 0x1e240, little-endian */
    TEST_ASSERT_EQUAL_HEX8(0xe2, bytes[37]);
    shef_block_record_encode(&record, bytes);
    TEST_ASSERT_EQUAL_HEX8(0xef, bytes[4]);
    TEST_ASSERT_EQUAL_HEX8(0xf0, bytes[8]);
    TEST_ASSERT_EQUAL_HEX8(0x10, bytes[16]);
    TEST_ASSERT_EQUAL_HEX8(0xfb, bytes[32]); /* -5 */
    TEST_ASSERT_EQUAL_HEX8(0x02, bytes[50]); /* 131072 */
    TEST_ASSERT_EQUAL_HEX8(0x07, bytes[56]);
}

static void test_any_changed_bit_is_noticed(void)
{
    struct shef_index_header header_back;
    struct shef_block_record record_back;
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

    for (int bit = 0; bit < 8 * SHEF_INDEX_RECORD_BYTES; bit++) {
        shef_index_header_encode(&header, bytes);
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        TEST_ASSERT_FALSE(shef_index_header_decode(bytes, &header_back));
        shef_block_record_encode(&record, bytes);
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        TEST_ASSERT_FALSE(shef_block_record_decode(bytes, &record_back));
    }
    /* A hole that a file system fills with zeros after a power cut. */
    memset(bytes, 0, sizeof bytes);
    TEST_ASSERT_FALSE(shef_block_record_decode(bytes, &record_back));
    TEST_ASSERT_FALSE(shef_index_header_decode(bytes, &header_back));
}

static void test_a_part_that_is_unknown_is_refused(void)
{
    struct shef_index_header unknown = header;
    uint8_t bytes[SHEF_INDEX_RECORD_BYTES];

    unknown.part = (enum shef_part)77;
    shef_index_header_encode(&unknown, bytes);
    TEST_ASSERT_FALSE(shef_index_header_decode(bytes, &unknown));
}

static void test_impossible_formats_and_sizes_of_events_are_refused(void)
{
    const struct shef_event_part good = { SHEF_EVT3, 1280, 720 };
    const struct shef_event_part bad[] = { { SHEF_EVT_FORMATS, 640, 480 },
                                           { SHEF_EVT2, 0, 480 },
                                           { SHEF_EVT2, 640, 2049 } };
    struct shef_event_part back;
    uint8_t info[SHEF_PART_INFO_BYTES];

    shef_event_part_encode(&good, info);
    TEST_ASSERT_TRUE(shef_event_part_decode(info, &back));
    TEST_ASSERT_EQUAL(SHEF_EVT3, back.format);
    TEST_ASSERT_EQUAL_UINT32(1280, back.width_px);
    TEST_ASSERT_EQUAL_UINT32(720, back.height_px);
    for (int i = 0; i < 3; i++) {
        shef_event_part_encode(&bad[i], info);
        TEST_ASSERT_FALSE(shef_event_part_decode(info, &back));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_headers_and_records_come_back);
    RUN_TEST(test_the_layout_is_the_documented_one);
    RUN_TEST(test_any_changed_bit_is_noticed);
    RUN_TEST(test_a_part_that_is_unknown_is_refused);
    RUN_TEST(test_impossible_formats_and_sizes_of_events_are_refused);
    return UNITY_END();
}
