/* Real recordings against what other people's decoders make of them. */
#include <stdio.h>
#include <string.h>

#include "codecs/raw_header.h"
#include "streams.h"

static struct stream stream;
static struct decoded decoded;

void tearDown(void)
{
    stream_free(&stream);
    decoded_free(&decoded);
}

/* Reads a file of the folder `events` whole. */
static void load(const char *name)
{
    char path[1024];
    uint8_t bytes[65536];
    size_t n;
    FILE *file;

    snprintf(path, sizeof path, "%s/%s", shef_test_data("events"), name);
    file = fopen(path, "rb");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    while ((n = fread(bytes, 1, sizeof bytes, file)) > 0)
        stream_put(&stream, bytes, n);
    fclose(file);
}

/* The decoding that the loaded RAW file's header asks for; its events start at *out_at. */
static struct decoding decoding_of_header(size_t *out_at)
{
    struct shef_raw_header header;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_raw_header_parse(stream.bytes, stream.n_bytes, &header, &err), err.text);
    *out_at = header.n_bytes;
    return (struct decoding){ .format = header.format,
                              .width_px = header.width_px,
                              .height_px = header.height_px };
}

/* FNV-1a over t, x, y, p of every event, as 8, 2, 2 and 1 little-endian bytes. */
static uint64_t fingerprint(const struct decoded *events)
{
    uint64_t hash = 0xcbf29ce484222325;

    for (size_t i = 0; i < events->n_events; i++) {
        const struct timed_event *event = &events->events[i];
        const uint8_t on = event->on;
        uint8_t bytes[13];

        memcpy(bytes, &event->t_us, 8);
        memcpy(bytes + 8, &event->x_px, 2);
        memcpy(bytes + 10, &event->y_px, 2);
        memcpy(bytes + 12, &on, 1);
        for (size_t j = 0; j < sizeof bytes; j++)
            hash = (hash ^ bytes[j]) * 0x100000001b3;
    }
    return hash;
}

/* expelliarmus 1.1.12 and faery 0.7.1 both read these events, bit for bit. */
static void test_the_evt2_recording_decodes_as_elsewhere(void)
{
    size_t at;

    SHEF_TEST_NEEDS_DATA("events");
    load("evt2_sample.raw");
    const struct decoding decoding = decoding_of_header(&at);

    TEST_ASSERT_EQUAL(SHEF_EVT2, decoding.format);
    TEST_ASSERT_EQUAL_UINT32(640, decoding.width_px);
    TEST_ASSERT_EQUAL_UINT32(480, decoding.height_px);
    decoded = decode_all(decoding, stream.bytes + at, stream.n_bytes - at);
    TEST_ASSERT_EQUAL_UINT64(539481, decoded.n_events);
    TEST_ASSERT_EQUAL_INT64(1317888, decoded.events[0].t_us);
    TEST_ASSERT_EQUAL_INT64(1367888, decoded.events[539480].t_us);
    TEST_ASSERT_EQUAL_HEX64(0x9175d2b66b0894cf, fingerprint(&decoded));
    expect_no_violations(&decoded.stats);
}

/* The array beside the recording comes from another decoder. Its times count every small step
 * back as a wrap of 4096 us, so they are right modulo 4096 only. */
static void test_the_evt3_recording_decodes_as_the_array_beside_it(void)
{
    const size_t n_events = 219596;
    const size_t record_bytes = 16;
    size_t at;

    SHEF_TEST_NEEDS_DATA("events");
    load("evt3_sample.raw");
    const struct decoding decoding = decoding_of_header(&at);

    decoded = decode_all(decoding, stream.bytes + at, stream.n_bytes - at);
    TEST_ASSERT_EQUAL_UINT64(n_events, decoded.n_events);

    stream.n_bytes = 0;
    load("evt3_sample.npy");
    const uint8_t *records = stream.bytes + stream.n_bytes - n_events * record_bytes;

    for (size_t i = 0; i < n_events; i++, records += record_bytes) {
        const struct timed_event event = decoded.events[i];
        int64_t t_us;
        uint16_t xy[2];

        memcpy(&t_us, records, sizeof t_us);
        memcpy(xy, records + 8, sizeof xy);
        TEST_ASSERT_EQUAL_UINT16(xy[0], event.x_px);
        TEST_ASSERT_EQUAL_UINT16(xy[1], event.y_px);
        TEST_ASSERT_EQUAL_UINT8(records[12], event.on);
        TEST_ASSERT_EQUAL_INT64(t_us & 4095, event.t_us & 4095);
        TEST_ASSERT_TRUE(event.t_us >= 11718656 && event.t_us <= 11727457);
    }
    /* The sensor's own small steps back: nine of 3 to 11 us. */
    TEST_ASSERT_EQUAL_UINT64(9, decoded.stats.n_violations[SHEF_EVT_TIME_BACK]);
    decoded.stats.n_violations[SHEF_EVT_TIME_BACK] = 0;
    expect_no_violations(&decoded.stats);
}

static void test_recordings_decode_the_same_for_every_way_of_slicing(void)
{
    static const char *const names[] = { "evt2_sample.raw", "evt3_sample.raw" };
    static const size_t slices[] = { 1, 2, 3, 5, 7, 64, 1000, 16384, 131072 };
    struct shef_test_random random;

    SHEF_TEST_NEEDS_DATA("events");
    random = shef_test_random_start();
    for (size_t name = 0; name < 2; name++) {
        size_t at;

        tearDown();
        load(names[name]);
        struct decoding decoding = decoding_of_header(&at);

        decoded = decode_all(decoding, stream.bytes + at, stream.n_bytes - at);
        for (size_t i = 0; i < sizeof slices / sizeof slices[0]; i++) {
            decoding.slice_bytes = slices[i];
            decoding.random = i > 4 ? &random : NULL;
            decoding.batch_events = i % 2 ? 300 : 20000;
            decoding.isa = i % 3 ? NULL : "c";
            struct decoded sliced = decode_all(decoding, stream.bytes + at, stream.n_bytes - at);

            expect_same(&decoded, &sliced);
            decoded_free(&sliced);
        }
    }
}

static void test_recordings_come_back_from_every_format(void)
{
    static const char *const names[] = { "evt2_sample.raw", "evt3_sample.raw" };

    SHEF_TEST_NEEDS_DATA("events");
    for (size_t name = 0; name < 2; name++) {
        size_t at;

        tearDown();
        load(names[name]);
        struct decoding decoding = decoding_of_header(&at);

        decoded = decode_all(decoding, stream.bytes + at, stream.n_bytes - at);
        for (int format = 0; format < SHEF_EVT_FORMATS; format++)
            for (int ticks = 0; ticks < 2; ticks++) {
                struct shef_evt_encoder encoder;
                struct stream encoded;
                struct decoded again;

                decoding.format = (enum shef_evt_format)format;
                shef_evt_encoder_init(&encoder, decoding.format, (enum shef_evt_ticks)ticks,
                                      decoding.width_px, decoding.height_px);
                encoded = encode_all(&encoder, &decoded, 5000);
                again = decode_all(decoding, encoded.bytes, encoded.n_bytes);
                expect_same_events(&decoded, &again);
                decoded_free(&again);
                stream_free(&encoded);
            }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_evt2_recording_decodes_as_elsewhere);
    RUN_TEST(test_the_evt3_recording_decodes_as_the_array_beside_it);
    RUN_TEST(test_recordings_decode_the_same_for_every_way_of_slicing);
    RUN_TEST(test_recordings_come_back_from_every_format);
    return UNITY_END();
}
