#include "record/manifest.h"

#include <stdio.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

static struct shef_manifest manifest;
static struct shef_manifest back;
static struct shef_error err;

void tearDown(void)
{
    shef_manifest_free(&manifest);
    shef_manifest_free(&back);
}

static void fill(void)
{
    manifest = (struct shef_manifest){
        .session = { 0, 1, 0xab, [15] = 0xff },
        .software = "shef 1.2.3",
        .created = "2026-03-01T12:00:00.123456Z",
        .utc_minus_host_ns = INT64_C(1772366400000000123),
        .is_closed = true,
        .verdict = SHEF_VERDICT_GAPS,
        .reason = "4 sensor buffers were lost",
        .events = { .is_present = true,
                    .camera = { .format = SHEF_EVT21_LEGACY,
                                .width_px = 1280,
                                .height_px = 720,
                                .system_id = 49,
                                .serial = "00ab",
                                .sensor = "IMX636" },
                    .n_segments = 2,
                    .n_blocks = 1000,
                    .n_lost_buffers = 4,
                    .first_us = -7,
                    .last_us = INT64_C(1) << 41,
                    .stats = { .n_bytes = UINT64_C(1) << 40,
                               .n_events = 77,
                               .n_triggers = 5,
                               .n_violations = { 1, 2, 3, 4, 5, 6, 7, 8 },
                               .n_wraps = 9 },
                    .gaps = { { 123, 3 }, { 456, 1 } },
                    .n_gaps = 2 },
    };
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_add_file(&manifest, "events/000000.idx", 256));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_add_file(&manifest, "events/000000.raw", 99));
    memset(manifest.files[1].sha256, 'a', SHEF_SHA256_TEXT_BYTES - 1);
}

static void test_everything_comes_back(void)
{
    fill();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_write(shef_test_temp_folder(), &manifest, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_read(shef_test_temp_folder(), &back, &err),
                              err.text);
    TEST_ASSERT_EQUAL_MEMORY(manifest.session, back.session, SHEF_SESSION_BYTES);
    TEST_ASSERT_EQUAL_STRING(manifest.software, back.software);
    TEST_ASSERT_EQUAL_STRING(manifest.created, back.created);
    TEST_ASSERT_EQUAL_STRING(manifest.reason, back.reason);
    TEST_ASSERT_EQUAL_INT64(manifest.utc_minus_host_ns, back.utc_minus_host_ns);
    TEST_ASSERT_TRUE(back.is_closed);
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, back.verdict);
    TEST_ASSERT_TRUE(back.events.is_present);
    TEST_ASSERT_EQUAL(SHEF_EVT21_LEGACY, back.events.camera.format);
    TEST_ASSERT_EQUAL_UINT32(1280, back.events.camera.width_px);
    TEST_ASSERT_EQUAL_UINT32(720, back.events.camera.height_px);
    TEST_ASSERT_EQUAL_INT32(49, back.events.camera.system_id);
    TEST_ASSERT_EQUAL_STRING("00ab", back.events.camera.serial);
    TEST_ASSERT_EQUAL_STRING("IMX636", back.events.camera.sensor);
    TEST_ASSERT_EQUAL_STRING("", back.events.camera.date);
    TEST_ASSERT_EQUAL_UINT64(1000, back.events.n_blocks);
    TEST_ASSERT_EQUAL_UINT32(2, back.events.n_segments);
    TEST_ASSERT_EQUAL_INT64(-7, back.events.first_us);
    TEST_ASSERT_EQUAL_INT64(INT64_C(1) << 41, back.events.last_us);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 40, back.events.stats.n_bytes);
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        TEST_ASSERT_EQUAL_UINT64(i + 1, back.events.stats.n_violations[i]);
    TEST_ASSERT_EQUAL_UINT64(9, back.events.stats.n_wraps);
    TEST_ASSERT_EQUAL_UINT32(2, back.events.n_gaps);
    TEST_ASSERT_EQUAL_INT64(456, back.events.gaps[1].at_us);
    TEST_ASSERT_EQUAL_UINT32(1, back.events.gaps[1].n_lost_buffers);
    TEST_ASSERT_EQUAL_size_t(2, back.n_files);
    TEST_ASSERT_EQUAL_STRING("events/000000.raw", back.files[1].path);
    TEST_ASSERT_EQUAL_UINT64(99, back.files[1].n_bytes);
    TEST_ASSERT_EQUAL_STRING("", back.files[0].sha256);
    TEST_ASSERT_EQUAL_STRING(manifest.files[1].sha256, back.files[1].sha256);
}

static void test_names_that_are_no_utf8_do_not_stop_the_manifest(void)
{
    fill();
    snprintf(manifest.reason, sizeof manifest.reason, "record to '/tmp/\xff\xfe' failed");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_write(shef_test_temp_folder(), &manifest, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(shef_test_temp_folder(), &back, &err));
    TEST_ASSERT_EQUAL_STRING("record to '/tmp/?"
                             "?' failed",
                             back.reason);
}

static void expect_refused(const char *text, enum shef_err code, const char *word)
{
    TEST_ASSERT_EQUAL(code, shef_manifest_parse(text, strlen(text), &back, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, word), err.text);
}

#define START                                                                                      \
    "{\"kind\": \"shef-recording\", \"version\": 1, \"session\": "                                 \
    "\"00112233445566778899aabbccddeeff\", \"state\": \"closed\""

static void test_what_is_no_manifest_is_refused_in_one_sentence(void)
{
    expect_refused("", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("[]", SHEF_ERR_FORMAT, "not the manifest of a recording");
    expect_refused("{\"kind\": \"other\"}", SHEF_ERR_FORMAT, "not the manifest of a recording");
    expect_refused("{\"kind\": \"shef-recording\", \"version\": 2}", SHEF_ERR_UNSUPPORTED,
                   "version 2");
    expect_refused("{\"kind\": \"shef-recording\", \"version\": 1}", SHEF_ERR_FORMAT, "session");
    expect_refused(START ", \"events\": {\"camera\": {\"format\": \"EVT9\"}}}", SHEF_ERR_FORMAT,
                   "camera");
    expect_refused(START ", \"events\": {\"camera\": {\"format\": \"EVT2\", \"width_px\": 0, "
                         "\"height_px\": 480}}}",
                   SHEF_ERR_FORMAT, "camera");
    expect_refused(START ", \"files\": [{\"path\": \"/etc/passwd\", \"sha256\": \"\"}]}",
                   SHEF_ERR_FORMAT, "files[0]");
    expect_refused(START ", \"files\": [{\"path\": \"a/../../b\", \"sha256\": \"\"}]}",
                   SHEF_ERR_FORMAT, "inside the recording");
    expect_refused(START ", \"files\": [{\"path\": \"a\", \"sha256\": \"12\"}]}", SHEF_ERR_FORMAT,
                   "SHA-256");
}

static void test_what_is_missing_or_odd_beside_the_essentials_is_tolerated(void)
{
    static const char text[] =
        START ", \"verdict\": \"splendid\", \"extra\": [1, 2], \"events\": {\"camera\": "
              "{\"format\": \"EVT3\", \"width_px\": 640, \"height_px\": 480, \"serial\": 5}, "
              "\"n_events\": -4, \"gaps\": \"none\"}}";

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_parse(text, sizeof text - 1, &back, &err),
                              err.text);
    TEST_ASSERT_EQUAL(SHEF_VERDICT_UNKNOWN, back.verdict);
    TEST_ASSERT_EQUAL_UINT64(0, back.events.stats.n_events);
    TEST_ASSERT_EQUAL_STRING("", back.events.camera.serial);
    TEST_ASSERT_EQUAL_size_t(0, back.n_files);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_everything_comes_back);
    RUN_TEST(test_names_that_are_no_utf8_do_not_stop_the_manifest);
    RUN_TEST(test_what_is_no_manifest_is_refused_in_one_sentence);
    RUN_TEST(test_what_is_missing_or_odd_beside_the_essentials_is_tolerated);
    return UNITY_END();
}
