#include "record/verify.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "recordings.h"

static struct shef_test_random random_source;
static struct sensor_stream stream;
static struct shef_verify_report report;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    sensor_stream_free(&stream);
}

static void make_recording(uint32_t n_stop)
{
    static int n_made;
    struct shef_event_recorder_config config;
    char name[32];

    random_source = shef_test_random_start();
    snprintf(name, sizeof name, "verified%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    stream = sensor_stream_make(SHEF_EVT3, 0, 3000, 10, &random_source);
    config = recording_config(&stream);
    config.segment_bytes = 4000;
    record_stream(folder, &stream, &config, 500, n_stop, &random_source);
}

static void verify(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recording_verify(folder, NULL, NULL, &report, &err),
                              err.text);
}

static bool has_problem(const char *text)
{
    for (uint64_t i = 0; i < report.n_problems && i < SHEF_VERIFY_MAX_PROBLEMS; i++)
        if (strstr(report.problems[i], text))
            return true;
    return false;
}

/* Flips a bit `back` bytes before a file's end. */
static void damage(const char *name, size_t back)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, &err));
    bytes[n_bytes - back] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, &err));
    free(bytes);
}

static void test_sha256_is_the_standards(void)
{
    char text[SHEF_SHA256_TEXT_BYTES];
    const char *path = shef_test_temp_path("abc");

    /* FIPS 180-4's example. */
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "abc", 3, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_sha256_file(path, NULL, NULL, text, &err));
    TEST_ASSERT_EQUAL_STRING("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
                             text);
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_sha256_file("/nowhere", NULL, NULL, text, &err));
}

static void test_a_whole_recording_has_no_problems(void)
{
    make_recording(0);
    verify();
    TEST_ASSERT_EQUAL_UINT64(0, report.n_problems);
    TEST_ASSERT_TRUE(report.n_blocks > 10);
    TEST_ASSERT_TRUE(report.n_files >= 4);
    TEST_ASSERT_EQUAL_UINT64(0, report.n_unhashed_files);
    TEST_ASSERT_EQUAL_UINT64(0, report.n_new_files);
}

static void test_every_kind_of_damage_is_named(void)
{
    char path[4300];

    make_recording(0);
    damage("events/000000.raw", 10);
    verify();
    TEST_ASSERT_TRUE(has_problem("1 blocks do not match"));
    TEST_ASSERT_TRUE(has_problem("'events/000000.raw' does not match its SHA-256"));

    damage("events/000000.raw", 10);
    verify();
    TEST_ASSERT_EQUAL_UINT64(0, report.n_problems);

    damage("events/000001.idx", 100);
    verify();
    TEST_ASSERT_TRUE(has_problem("1 records of indexes are damaged"));
    TEST_ASSERT_TRUE(has_problem("'events/000001.idx' does not match its SHA-256"));
    damage("events/000001.idx", 100);

    snprintf(path, sizeof path, "%s/events/000000.raw", folder);
    TEST_ASSERT_EQUAL_INT(0, truncate(path, 2000));
    verify();
    TEST_ASSERT_TRUE(has_problem("beyond the ends of their files"));
    TEST_ASSERT_TRUE(has_problem("'events/000000.raw' has 2000 bytes"));
    unlink(path);
    verify();
    TEST_ASSERT_TRUE(has_problem("'events/000000.raw' is missing"));
}

static void test_the_text_at_a_files_front_is_checked_too(void)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;

    make_recording(0);
    snprintf(path, sizeof path, "%s/events/000001.raw", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, &err));
    bytes[20] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, &err));
    free(bytes);
    verify();
    TEST_ASSERT_EQUAL_UINT64(1, report.n_problems);
    TEST_ASSERT_TRUE(has_problem("'events/000001.raw' does not match its SHA-256"));
}

static void test_missing_ends_and_new_files_are_noticed(void)
{
    char path[4300];

    make_recording(0);
    snprintf(path, sizeof path, "%s/notes.txt", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "hello", 5, &err));
    verify();
    TEST_ASSERT_EQUAL_UINT64(0, report.n_problems);
    TEST_ASSERT_EQUAL_UINT64(1, report.n_new_files);

    struct shef_manifest manifest;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/events/%06u.%s", folder, manifest.events.n_segments - 1,
                 i == 0 ? "raw" : "idx");
        TEST_ASSERT_EQUAL_INT(0, unlink(path));
    }
    shef_manifest_free(&manifest);
    verify();
    TEST_ASSERT_TRUE(has_problem("blocks are missing at the end"));
}

static void test_a_recording_that_was_never_closed_is_checked_by_its_blocks(void)
{
    make_recording(8);
    verify();
    TEST_ASSERT_EQUAL_UINT64(8, report.n_blocks);
    TEST_ASSERT_EQUAL_UINT64(0, report.n_files);
    TEST_ASSERT_EQUAL_UINT64(1, report.n_problems);
    TEST_ASSERT_TRUE(has_problem("never closed"));
}

static bool stop_after(void *context, uint64_t n_bytes)
{
    uint64_t *n_left = context;

    *n_left = *n_left > n_bytes ? *n_left - n_bytes : 0;
    return *n_left > 0;
}

static void test_a_check_can_be_stopped(void)
{
    uint64_t n_left = 3000;

    make_recording(0);
    TEST_ASSERT_TRUE(shef_recording_verify_size(folder) > 2 * stream.n_bytes);
    TEST_ASSERT_EQUAL(SHEF_ERR_GONE,
                      shef_recording_verify(folder, stop_after, &n_left, &report, &err));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sha256_is_the_standards);
    RUN_TEST(test_a_whole_recording_has_no_problems);
    RUN_TEST(test_every_kind_of_damage_is_named);
    RUN_TEST(test_the_text_at_a_files_front_is_checked_too);
    RUN_TEST(test_missing_ends_and_new_files_are_noticed);
    RUN_TEST(test_a_recording_that_was_never_closed_is_checked_by_its_blocks);
    RUN_TEST(test_a_check_can_be_stopped);
    return UNITY_END();
}
