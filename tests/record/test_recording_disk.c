/* A disk that refuses: what was written stays readable, and one sentence says what happened. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "recordings.h"
#include "support/small_disk.h"

static struct shef_test_random random_source;
static struct sensor_stream stream;

void tearDown(void)
{
    sensor_stream_free(&stream);
}

#define EXPECT(condition) SHEF_TEST_CHILD_EXPECT(condition, err)

/* Records until something fails, closes, and reads back. Ends the child. */
static void record_until_refused(const char *folder, enum shef_err expected_code,
                                 const char *expected_word)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    struct shef_event_recorder_config config = recording_config(&stream);
    struct shef_event_recorder *recorder;
    struct shef_manifest manifest;
    struct shef_error err = { .text = "" };
    struct shef_error ignored = { .text = "" };
    enum shef_err code = SHEF_OK;
    size_t n_written = 0;

    config.segment_bytes = 1 << 19;
    EXPECT(shef_recording_writer_create(&recording, folder, &writer_config, &err) == SHEF_OK);
    EXPECT(shef_event_recorder_start(&recording, &config, &recorder, &err) == SHEF_OK);
    for (size_t at = 0; code == SHEF_OK; at = (at + 5000) % (stream.n_bytes - 5000)) {
        code = shef_event_recorder_write(recorder, stream.bytes + at, 5000, (shef_host_time){ 0 },
                                         0, &err);
        n_written += code == SHEF_OK ? 5000 : 0;
        EXPECT(n_written < (64u << 20));
    }
    EXPECT(code == expected_code);
    EXPECT(strstr(err.text, expected_word) != NULL);
    EXPECT(strstr(err.text, "are kept") != NULL);
    EXPECT(n_written > 0);
    EXPECT(shef_event_recorder_stop(recorder, &ignored) == SHEF_OK);
    EXPECT(shef_recording_writer_close(&recording, true, NULL, NULL, &ignored) == SHEF_OK);

    EXPECT(shef_manifest_read(folder, &manifest, &ignored) == SHEF_OK);
    EXPECT(manifest.is_closed);
    EXPECT(manifest.verdict == SHEF_VERDICT_STOPPED);
    EXPECT(strstr(manifest.reason, expected_word) != NULL);
    EXPECT(manifest.events.stats.n_bytes == n_written);

    struct replayed replayed = read_recording(folder);

    EXPECT(replayed.code == SHEF_ERR_EMPTY);
    EXPECT(replayed.stats.n_bytes == n_written);
    EXPECT(replayed.stats.n_events == manifest.events.stats.n_events);
    EXPECT(replayed.damage.n_missing_blocks == 0);
    EXPECT(replayed.damage.n_loose_bytes == 0);
    EXPECT(strstr(replayed.notes, "'stopped'") != NULL);
    _exit(0);
}

static void make_stream(void)
{
    random_source = shef_test_random_start();
    stream = sensor_stream_make(SHEF_EVT2, 0, 30000, 5, &random_source);
}

static void test_a_file_that_may_not_grow_ends_the_recording_in_order(void)
{
    char folder[4200];
    int status;

    make_stream();
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("limited"));

    const pid_t pid = fork();

    TEST_ASSERT_TRUE(pid >= 0);
    if (pid == 0) {
        /* Larger than the reserve and the manifest, smaller than a segment. */
        const struct rlimit limit = { 300000, 300000 };

        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        record_until_refused(folder, SHEF_ERR_IO, "File too large");
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_TRUE(WIFEXITED(status));
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
}

static void fill_the_disk(const char *folder)
{
    record_until_refused(folder, SHEF_ERR_NO_SPACE, "No space left on device");
}

static void test_a_full_disk_ends_the_recording_in_order(void)
{
    make_stream();
    shef_test_on_small_disk("disk", "2m", fill_the_disk);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_file_that_may_not_grow_ends_the_recording_in_order);
    RUN_TEST(test_a_full_disk_ends_the_recording_in_order);
    return UNITY_END();
}
