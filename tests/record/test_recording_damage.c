/* A recording cut or damaged anywhere: no crash, no invented event, and what is whole is kept. */
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/file.h"
#include "record/block_index.h"
#include "recordings.h"

#define SEGMENT_BYTES 700
#define BUFFER_BYTES  150

static struct shef_test_random random_source;
static struct sensor_stream stream;
static struct replayed replayed;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    sensor_stream_free(&stream);
    replayed_free(&replayed);
}

/* A closed recording of a few small segments. */
static void make_recording(enum shef_evt_format format)
{
    static int n_made;
    char name[32];
    struct shef_event_recorder_config config;

    random_source = shef_test_random_start();
    snprintf(name, sizeof name, "damaged%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    stream = sensor_stream_make(format, (3 << 24) - 2500, 350, 12, &random_source);
    config = recording_config(&stream);
    config.segment_bytes = SEGMENT_BYTES;
    record_stream(folder, &stream, &config, BUFFER_BYTES, 0, &random_source);
}

static void read_again(void)
{
    replayed_free(&replayed);
    replayed = read_recording(folder);
}

/* A file of the recording, and its content to put back. */
struct victim {
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;
};

static struct victim take_victim(const char *name)
{
    struct victim victim;

    snprintf(victim.path, sizeof victim.path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_file_read(victim.path, 1 << 24, &victim.bytes, &victim.n_bytes, &err),
        err.text);
    return victim;
}

/* In place, and without O_TRUNC, after which closing waits for the disk: there are thousands of
 * versions to try. */
static void overwrite(const struct victim *victim, const uint8_t *bytes, size_t n_bytes)
{
    const int fd = open(victim->path, O_WRONLY);

    TEST_ASSERT_TRUE(fd >= 0);
    TEST_ASSERT_EQUAL_INT64((int64_t)n_bytes, write(fd, bytes, n_bytes));
    TEST_ASSERT_EQUAL_INT(0, ftruncate(fd, (off_t)n_bytes));
    close(fd);
}

static void give_back(struct victim *victim)
{
    overwrite(victim, victim->bytes, victim->n_bytes);
    free(victim->bytes);
}

/* Where the events of the block end that byte `at` of a data or index file belongs to lie in the
 * stream: how many items come before that block. */
static size_t items_before(const struct victim *index, size_t record)
{
    struct shef_block_record found;
    size_t n = 0;

    TEST_ASSERT_TRUE(
        shef_block_record_decode(index->bytes + (record + 1) * SHEF_INDEX_RECORD_BYTES, &found));
    while (n < stream.seen.n && stream.seen.items[n].t_us < found.first_us)
        n++;
    return n;
}

/* Reads what is left and expects nothing new in it, and at least the first n_kept items. */
static void expect_prefix(size_t n_kept, const char *what, size_t at)
{
    char text[700];

    read_again();
    snprintf(text, sizeof text, "%s at byte %zu: %s", what, at, replayed.error);
    TEST_ASSERT_TRUE_MESSAGE(replayed.code == SHEF_ERR_EMPTY || replayed.seen.n == 0, text);
    TEST_ASSERT_TRUE_MESSAGE(seen_is_subsequence(&replayed.seen, &stream.seen), text);
    TEST_ASSERT_TRUE_MESSAGE(seen_common_prefix(&replayed.seen, &stream.seen) >= n_kept, text);
    if (replayed.seen.n < stream.seen.n)
        TEST_ASSERT_TRUE_MESSAGE(*replayed.notes || *replayed.error, text);
}

/* The first record whose block reaches beyond byte `at` of the data file. */
static size_t record_of_byte(const struct victim *index, size_t at)
{
    const size_t n_records = index->n_bytes / SHEF_INDEX_RECORD_BYTES - 1;

    for (size_t i = 0; i < n_records; i++) {
        struct shef_block_record record;

        TEST_ASSERT_TRUE(
            shef_block_record_decode(index->bytes + (i + 1) * SHEF_INDEX_RECORD_BYTES, &record));
        if (at < record.offset + record.n_bytes)
            return i;
    }
    return n_records - 1;
}

static void cut_and_flip_data(const char *data_name, const char *index_name)
{
    struct victim data = take_victim(data_name);
    struct victim index = take_victim(index_name);

    for (size_t at = 0; at < data.n_bytes; at++) {
        const size_t n_kept = items_before(&index, record_of_byte(&index, at));

        overwrite(&data, data.bytes, at);
        expect_prefix(n_kept, "data file cut", at);
        data.bytes[at] ^= 0x40;
        overwrite(&data, data.bytes, data.n_bytes);
        expect_prefix(n_kept, "data file changed", at);
        data.bytes[at] ^= 0x40;
    }
    give_back(&data);
    free(index.bytes);
}

static void test_data_files_cut_or_changed_at_every_byte(void)
{
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT3 };

    for (int i = 0; i < 2; i++) {
        make_recording(formats[i]);
        read_again();
        seen_expect_same(&stream.seen, &replayed.seen);
        TEST_ASSERT_EQUAL_STRING("", replayed.notes);
        cut_and_flip_data("events/000000.raw", "events/000000.idx");
        cut_and_flip_data("events/000001.raw", "events/000001.idx");
        tearDown();
    }
}

static void test_indexes_cut_or_changed_at_every_byte(void)
{
    static const char *const names[] = { "events/000000.idx", "events/000001.idx" };

    make_recording(SHEF_EVT3);
    for (int i = 0; i < 2; i++) {
        struct victim index = take_victim(names[i]);
        const size_t n_before_segment = items_before(&index, 0);

        for (size_t at = 0; at < index.n_bytes; at++) {
            const size_t record = at / SHEF_INDEX_RECORD_BYTES;
            const size_t n_kept = record == 0 ? n_before_segment : items_before(&index, record - 1);

            overwrite(&index, index.bytes, at);
            expect_prefix(n_kept, "index cut", at);
            index.bytes[at] ^= 0x04;
            overwrite(&index, index.bytes, index.n_bytes);
            expect_prefix(n_kept, "index changed", at);
            index.bytes[at] ^= 0x04;
        }
        give_back(&index);
    }
}

static void test_damage_to_one_block_costs_only_that_block(void)
{
    struct victim data;
    struct victim index;
    struct shef_block_record record;
    size_t n_left;

    make_recording(SHEF_EVT3);
    data = take_victim("events/000001.raw");
    index = take_victim("events/000001.idx");
    TEST_ASSERT_TRUE(shef_block_record_decode(index.bytes + 3 * SHEF_INDEX_RECORD_BYTES, &record));
    data.bytes[record.offset + record.n_bytes / 2] ^= 1;
    overwrite(&data, data.bytes, data.n_bytes);
    read_again();
    n_left = stream.seen.n - record.n_items - record.n_triggers;
    TEST_ASSERT_TRUE(record.n_items > 0);
    TEST_ASSERT_EQUAL_size_t(n_left, replayed.seen.n);
    TEST_ASSERT_TRUE(seen_is_subsequence(&replayed.seen, &stream.seen));
    TEST_ASSERT_EQUAL_UINT64(1, replayed.damage.n_bad_blocks);
    TEST_ASSERT_EQUAL_UINT64(1, replayed.damage.n_missing_blocks);
    TEST_ASSERT_NOT_NULL(strstr(replayed.notes, "1 blocks do not match their checksums"));
    free(data.bytes);
    free(index.bytes);
}

static void test_manifest_cut_or_changed_at_every_byte_costs_no_event(void)
{
    struct victim manifest;

    make_recording(SHEF_EVT2);
    manifest = take_victim("manifest.json");
    for (size_t at = 0; at < manifest.n_bytes; at++) {
        overwrite(&manifest, manifest.bytes, at);
        read_again();
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
        TEST_ASSERT_EQUAL_size_t(stream.seen.n, replayed.seen.n);
        TEST_ASSERT_NOT_NULL(strstr(replayed.notes, "the manifest is not used"));
        manifest.bytes[at] ^= 0x02;
        overwrite(&manifest, manifest.bytes, manifest.n_bytes);
        read_again();
        /* "version": 1 may have become 3. */
        TEST_ASSERT_TRUE_MESSAGE(replayed.code == SHEF_ERR_EMPTY ||
                                     replayed.code == SHEF_ERR_UNSUPPORTED,
                                 replayed.error);
        if (replayed.code == SHEF_ERR_EMPTY)
            seen_expect_same(&stream.seen, &replayed.seen);
        manifest.bytes[at] ^= 0x02;
    }
    free(manifest.bytes);
}

static void test_missing_files_are_said_and_the_rest_is_read(void)
{
    static const char *const names[] = { "events/000001.raw", "events/000001.idx",
                                         "manifest.json" };
    static const char *const said[] = { "beyond the ends of their files", "no readable index",
                                        "the manifest is not used" };

    make_recording(SHEF_EVT2);
    for (int i = 0; i < 3; i++) {
        struct victim victim = take_victim(names[i]);

        TEST_ASSERT_EQUAL_INT(0, unlink(victim.path));
        read_again();
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(replayed.notes, said[i]), replayed.notes);
        TEST_ASSERT_TRUE(seen_is_subsequence(&replayed.seen, &stream.seen));
        TEST_ASSERT_TRUE(replayed.seen.n > stream.seen.n / 4);
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_file_replace(victim.path, victim.bytes, victim.n_bytes, &err));
        free(victim.bytes);
    }
    struct victim data = take_victim("events/000001.raw");
    struct victim index = take_victim("events/000001.idx");

    unlink(data.path);
    unlink(index.path);
    read_again();
    TEST_ASSERT_EQUAL_UINT32(1, replayed.damage.n_lost_segments);
    TEST_ASSERT_NOT_NULL(strstr(replayed.notes, "1 segments are missing"));
    free(data.bytes);
    free(index.bytes);
}

static void test_segments_of_another_recording_are_left_out(void)
{
    char first[4200];
    char path[4300];
    struct sensor_stream first_stream;

    make_recording(SHEF_EVT2);
    first_stream = stream;
    stream = (struct sensor_stream){ .bytes = NULL };
    snprintf(first, sizeof first, "%s", folder);
    make_recording(SHEF_EVT2);

    static const char *const names[] = { "events/000001.raw", "events/000001.idx" };

    for (int i = 0; i < 2; i++) {
        struct victim stranger = take_victim(names[i]);

        snprintf(path, sizeof path, "%s/%s", first, names[i]);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, stranger.bytes, stranger.n_bytes, &err));
        free(stranger.bytes);
    }
    sensor_stream_free(&stream);
    stream = first_stream;
    snprintf(folder, sizeof folder, "%s", first);
    read_again();
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
    TEST_ASSERT_TRUE(replayed.seen.n > 0);
    TEST_ASSERT_TRUE(seen_is_subsequence(&replayed.seen, &stream.seen));
    TEST_ASSERT_EQUAL_UINT32(1, replayed.damage.n_strange_segments);
}

static void test_a_recording_that_was_never_closed_says_so_and_is_whole_up_to_its_end(void)
{
    struct shef_event_recorder_config config;

    random_source = shef_test_random_start();
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("open"));
    stream = sensor_stream_make(SHEF_EVT3, 0, 2000, 10, &random_source);
    config = recording_config(&stream);
    record_stream(folder, &stream, &config, 200, 20, &random_source);
    read_again();
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, replayed.code);
    TEST_ASSERT_NOT_NULL(strstr(replayed.notes, "was not closed"));
    TEST_ASSERT_TRUE(replayed.seen.n > 100);
    TEST_ASSERT_EQUAL_size_t(replayed.seen.n, seen_common_prefix(&replayed.seen, &stream.seen));
}

/* Records until it is killed. */
static void record_for_ever(const struct sensor_stream *source)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    struct shef_event_recorder_config config = recording_config(source);
    struct shef_event_recorder *recorder;

    config.segment_bytes = 5000;
    config.near_us = 0;
    if (shef_recording_writer_create(&recording, folder, &writer_config, NULL) != SHEF_OK ||
        shef_event_recorder_start(&recording, &config, &recorder, NULL) != SHEF_OK)
        _exit(1);
    for (size_t at = 0; at < source->n_bytes; at += 64) {
        const size_t n_left = source->n_bytes - at;

        if (shef_event_recorder_write(recorder, source->bytes + at,
                                      (uint32_t)(n_left < 64 ? n_left : 64),
                                      (shef_host_time){ (int64_t)at }, 0, NULL) != SHEF_OK)
            _exit(1);
    }
    pause();
}

static void test_a_recorder_killed_at_any_moment_leaves_a_readable_recording(void)
{
    size_t n_read = 0;

    random_source = shef_test_random_start();
    stream = sensor_stream_make(SHEF_EVT2, 0, 50000, 5, &random_source);
    for (int i = 0; i < 20; i++) {
        char name[32];
        int status;

        snprintf(name, sizeof name, "killed%d", i);
        snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));

        const pid_t pid = fork();

        TEST_ASSERT_TRUE(pid >= 0);
        if (pid == 0)
            record_for_ever(&stream);
        usleep((useconds_t)shef_test_random_range(&random_source, 500, 40000));
        kill(pid, SIGKILL);
        TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
        TEST_ASSERT_TRUE(WIFSIGNALED(status));

        struct stat info;

        if (stat(folder, &info) != 0)
            continue;
        read_again();
        if (replayed.code == SHEF_ERR_FORMAT || replayed.code == SHEF_ERR_NOT_FOUND)
            continue; /* killed before there was a manifest, or a part */
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
        TEST_ASSERT_EQUAL_size_t(replayed.seen.n, seen_common_prefix(&replayed.seen, &stream.seen));
        n_read += replayed.seen.n;
    }
    printf("read %zu events and triggers of 20 killed recordings\n", n_read);
    TEST_ASSERT_TRUE(n_read > 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_data_files_cut_or_changed_at_every_byte);
    RUN_TEST(test_indexes_cut_or_changed_at_every_byte);
    RUN_TEST(test_damage_to_one_block_costs_only_that_block);
    RUN_TEST(test_manifest_cut_or_changed_at_every_byte_costs_no_event);
    RUN_TEST(test_missing_files_are_said_and_the_rest_is_read);
    RUN_TEST(test_segments_of_another_recording_are_left_out);
    RUN_TEST(test_a_recording_that_was_never_closed_says_so_and_is_whole_up_to_its_end);
    RUN_TEST(test_a_recorder_killed_at_any_moment_leaves_a_readable_recording);
    return UNITY_END();
}
