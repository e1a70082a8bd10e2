/* What was recorded comes back: any format, any buffers, any segments. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "codecs/event_reader.h"
#include "core/cpu.h"
#include "core/file.h"
#include "recordings.h"

static struct shef_test_random random_source;
static struct sensor_stream stream;
static struct replayed replayed;
static struct shef_error err;
static int n_folders;

void tearDown(void)
{
    sensor_stream_free(&stream);
    replayed_free(&replayed);
}

/* Valid until the fourth call after this one. */
static const char *new_folder(void)
{
    static char paths[4][4200];
    char *path = paths[n_folders % 4];
    char name[32];

    snprintf(name, sizeof name, "recording%d", n_folders++);
    snprintf(path, sizeof paths[0], "%s", shef_test_temp_path(name));
    return path;
}

static const char *in_folder(const char *folder, const char *name)
{
    static char path[4300];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void make_stream(enum shef_evt_format format, int64_t start_us, int32_t n_events)
{
    sensor_stream_free(&stream);
    stream = sensor_stream_make(format, start_us, n_events, 20, &random_source);
}

static void expect_whole(const char *folder)
{
    replayed_free(&replayed);
    replayed = read_recording(folder);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
    seen_expect_same(&stream.seen, &replayed.seen);
    TEST_ASSERT_EQUAL_UINT64(0, replayed.damage.n_missing_blocks);
    TEST_ASSERT_EQUAL_UINT64(0, replayed.damage.n_loose_bytes);
    TEST_ASSERT_EQUAL_STRING("", replayed.notes);
}

static void test_every_format_comes_back_from_buffers_of_any_size(void)
{
    random_source = shef_test_random_start();
    for (int format = 0; format < SHEF_EVT_FORMATS; format++) {
        make_stream(format, 123456789, 5000);
        for (uint32_t max_bytes = 1; max_bytes <= 100000; max_bytes *= 17) {
            struct shef_event_recorder_config config = recording_config(&stream);
            const char *folder = new_folder();

            config.segment_bytes = 6000;
            record_stream(folder, &stream, &config, max_bytes, 0, &random_source);
            expect_whole(folder);
        }
    }
}

static void test_times_go_on_over_wraps_and_segments(void)
{
    /* EVT3 wraps every 16.8 s, EVT2 every 4.8 h. */
    static const int64_t wrap_us[] = { INT64_C(1) << 34, 1 << 24 };
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT3 };

    for (int i = 0; i < 2; i++) {
        const char *folder = new_folder();
        struct shef_event_recorder_config config;

        make_stream(formats[i], 7 * wrap_us[i] - 40000, 4000);
        TEST_ASSERT_TRUE(stream.seen.items[stream.seen.n - 1].t_us > 7 * wrap_us[i]);
        config = recording_config(&stream);
        config.segment_bytes = 3000;
        record_stream(folder, &stream, &config, 500, 0, &random_source);
        expect_whole(folder);
    }
}

static void test_segments_end_by_size_and_by_age_and_begin_with_a_word(void)
{
    const char *folder = new_folder();
    struct shef_event_recorder_config config;
    struct shef_manifest manifest;
    struct stat info;

    make_stream(SHEF_EVT2, 0, 5000);
    config = recording_config(&stream);
    config.segment_bytes = 4000;
    /* Small enough that one of them begins with a word before the segment must end anyway. */
    record_stream(folder, &stream, &config, 100, 0, &random_source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_TRUE(manifest.events.n_segments >= stream.n_bytes / 8000);
    TEST_ASSERT_TRUE(manifest.events.n_segments <= stream.n_bytes / 4000 + 1);
    for (uint32_t i = 0; i + 1 < manifest.events.n_segments; i++) {
        struct shef_event_reader *reader;
        char name[32];

        snprintf(name, sizeof name, "events/%06u.raw", i);
        TEST_ASSERT_EQUAL_INT(0, stat(in_folder(folder, name), &info));
        TEST_ASSERT_EQUAL(SHEF_OK, shef_event_reader_open(in_folder(folder, name),
                                                          shef_cpu_features(), &reader, &err));
        const size_t front = shef_event_reader_info(reader)->raw.n_bytes;

        shef_event_reader_close(reader);
        TEST_ASSERT_EQUAL_INT(0, ((size_t)info.st_size - front) % 4);
        TEST_ASSERT_TRUE((size_t)info.st_size - front >= 4000);
    }
    shef_manifest_free(&manifest);

    folder = new_folder();
    config.segment_bytes = UINT64_C(1) << 30;
    config.segment_ns = 10 * SHEF_NS_PER_MS;
    record_stream(folder, &stream, &config, 400, 0, &random_source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    /* One buffer a millisecond; a segment waits for a buffer that begins with a word, but not
     * longer than for twice its time. */
    TEST_ASSERT_TRUE(manifest.events.n_segments >= manifest.events.n_blocks / 20);
    TEST_ASSERT_TRUE(manifest.events.n_segments <= manifest.events.n_blocks / 10 + 1);
    shef_manifest_free(&manifest);
    expect_whole(folder);
}

static void test_each_segment_can_be_read_without_the_others(void)
{
    const char *folder = new_folder();
    struct shef_event_recorder_config config;
    struct shef_manifest manifest;
    struct seen together = { 0 };
    char kept[4300];
    char moved[4300];
    char first[4200];

    snprintf(first, sizeof first, "%s", folder);
    make_stream(SHEF_EVT3, (5 << 24) - 30000, 4000);
    config = recording_config(&stream);
    config.segment_bytes = 3000;
    record_stream(folder, &stream, &config, 300, 0, &random_source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_TRUE(manifest.events.n_segments > 3);
    for (uint32_t i = 0; i < manifest.events.n_segments; i++) {
        static const char *const endings[] = { "raw", "idx" };
        char one[4200];

        snprintf(one, sizeof one, "%s", new_folder());
        TEST_ASSERT_EQUAL_INT(0, mkdir(one, 0777));
        TEST_ASSERT_EQUAL_INT(0, mkdir(in_folder(one, "events"), 0777));
        for (int k = 0; k < 2; k++) {
            snprintf(kept, sizeof kept, "%s/events/%06u.%s", first, i, endings[k]);
            snprintf(moved, sizeof moved, "%s/events/%06u.%s", one, i, endings[k]);
            TEST_ASSERT_EQUAL_INT(0, link(kept, moved));
        }
        replayed_free(&replayed);
        replayed = read_recording(one);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, replayed.code, replayed.error);
        TEST_ASSERT_TRUE(replayed.seen.n > 0);
        together.items =
            reallocarray(together.items, together.n + replayed.seen.n, sizeof *together.items);
        TEST_ASSERT_NOT_NULL(together.items);
        memcpy(together.items + together.n, replayed.seen.items,
               replayed.seen.n * sizeof *together.items);
        together.n += replayed.seen.n;
    }
    seen_expect_same(&stream.seen, &together);
    seen_free(&together);
    shef_manifest_free(&manifest);
}

static void test_data_files_hold_the_sensors_bytes_and_are_raw_files_for_everybody(void)
{
    const char *folder = new_folder();
    struct shef_event_recorder_config config;
    struct shef_event_reader *reader;
    uint8_t *bytes;
    size_t n_bytes;

    make_stream(SHEF_EVT2, 1000, 3000);
    config = recording_config(&stream);
    record_stream(folder, &stream, &config, 5000, 0, &random_source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(in_folder(folder, "events/000000.raw"), 1 << 24,
                                              &bytes, &n_bytes, &err));
    TEST_ASSERT_TRUE(n_bytes > stream.n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(stream.bytes, bytes + n_bytes - stream.n_bytes, stream.n_bytes);
    free(bytes);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_reader_open(in_folder(folder, "events/000000.raw"),
                                                      shef_cpu_features(), &reader, &err));
    TEST_ASSERT_EQUAL_STRING("00001234", shef_event_reader_info(reader)->raw.serial);
    TEST_ASSERT_EQUAL_UINT32(64, shef_event_reader_info(reader)->width_px);
    shef_event_reader_close(reader);
}

static void test_the_manifest_counts_what_the_stream_holds(void)
{
    const char *folder = new_folder();
    struct shef_event_recorder_config config;
    struct shef_manifest manifest;
    uint64_t n_triggers = 0;

    make_stream(SHEF_EVT3, 5000, 3000);
    for (size_t i = 0; i < stream.seen.n; i++)
        n_triggers += stream.seen.items[i].y_px == UINT16_MAX;
    config = recording_config(&stream);
    record_stream(folder, &stream, &config, 1000, 0, &random_source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_TRUE(manifest.is_closed);
    TEST_ASSERT_EQUAL(SHEF_VERDICT_CLEAN, manifest.verdict);
    TEST_ASSERT_EQUAL_UINT64(stream.n_bytes, manifest.events.stats.n_bytes);
    TEST_ASSERT_EQUAL_UINT64(n_triggers, manifest.events.stats.n_triggers);
    TEST_ASSERT_TRUE(n_triggers > 0);
    TEST_ASSERT_EQUAL_UINT64(stream.seen.n - n_triggers, manifest.events.stats.n_events);
    TEST_ASSERT_EQUAL_INT64(stream.seen.items[0].t_us, manifest.events.first_us);
    TEST_ASSERT_EQUAL_INT64(stream.seen.items[stream.seen.n - 1].t_us, manifest.events.last_us);
    TEST_ASSERT_EQUAL_size_t(2, manifest.n_files);
    shef_manifest_free(&manifest);
}

static void test_lost_buffers_are_in_the_verdict_with_their_place(void)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    const char *folder = new_folder();
    struct shef_event_recorder_config config;
    struct shef_event_recorder *recorder;
    struct shef_recorded_events *events;
    struct shef_event scratch[500];
    struct shef_event_batch batch = { .events = scratch, .capacity = 500 };
    struct shef_manifest manifest;

    make_stream(SHEF_EVT2, 5000, 3000);
    config = recording_config(&stream);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(&recording, folder, &writer_config, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_start(&recording, &config, &recorder, &err));
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_event_recorder_write(recorder, stream.bytes + i * 2000, 2000,
                                                    (shef_host_time){ i }, i == 2 ? 3 : 0, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_recorder_stop(recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, false, NULL, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, manifest.verdict);
    TEST_ASSERT_NOT_NULL(strstr(manifest.reason, "3 sensor buffers were lost"));
    TEST_ASSERT_EQUAL_UINT32(1, manifest.events.n_gaps);
    TEST_ASSERT_EQUAL_UINT32(3, manifest.events.gaps[0].n_lost_buffers);

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recorded_events_open(folder, shef_cpu_features(), &events, &err));
    while (shef_recorded_events_next(events, &batch, &err) == SHEF_OK)
        ;
    TEST_ASSERT_NOT_NULL(strstr(shef_recorded_events_note(events, 0), "'gaps'"));
    TEST_ASSERT_NOT_NULL(shef_recorded_events_gap(events, 0));
    TEST_ASSERT_NULL(shef_recorded_events_gap(events, 1));
    TEST_ASSERT_EQUAL_UINT32(3, shef_recorded_events_gap(events, 0)->n_lost_buffers);
    TEST_ASSERT_EQUAL_INT64(manifest.events.gaps[0].at_us,
                            shef_recorded_events_gap(events, 0)->from_us);
    shef_recorded_events_close(events);
    shef_manifest_free(&manifest);
}

static void test_calibration_and_configuration_are_copied_and_other_parts_are_listed(void)
{
    static struct shef_recording_writer recording;
    char folder[4200];
    char source[4300];
    const struct shef_recording_writer_config config = { .software = "test",
                                                         .calibration_path = source,
                                                         .config_path = source };
    struct shef_recording found;
    bool has_frames = false;

    snprintf(folder, sizeof folder, "%s", new_folder());
    snprintf(source, sizeof source, "%s", shef_test_temp_path("source.yaml"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(source, "a: 1\n", 5, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_create(&recording, folder, &config, &err));
    TEST_ASSERT_EQUAL_INT(0, mkdir(in_folder(folder, "frames"), 0777));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_replace(in_folder(folder, "frames/000000.blk"), "xyz", 3, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_inspect(folder, &found, &err));
    TEST_ASSERT_TRUE(found.has_calibration);
    TEST_ASSERT_TRUE(found.has_config);
    for (int i = 0; i < found.n_parts; i++)
        if (strcmp(found.parts[i].name, "frames") == 0) {
            has_frames = true;
            TEST_ASSERT_EQUAL_UINT64(1, found.parts[i].n_files);
            TEST_ASSERT_EQUAL_UINT64(3, found.parts[i].n_bytes);
        }
    TEST_ASSERT_TRUE(has_frames);
    shef_recording_free(&found);

    replayed = read_recording(folder);
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, replayed.code);
    TEST_ASSERT_NOT_NULL(strstr(replayed.error, "no event part"));
}

static void test_a_recording_needs_a_place_of_its_own(void)
{
    static struct shef_recording_writer recording;
    const struct shef_recording_writer_config config = { .software = "test" };
    const struct shef_recording_writer_config bad_config = { .software = "test",
                                                             .config_path = "/nowhere/x.yaml" };
    char folder[4200];

    snprintf(folder, sizeof folder, "%s", new_folder());
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder, 0777));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(in_folder(folder, "mine"), "x", 1, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_recording_writer_create(&recording, folder, &config, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "not empty"));
    TEST_ASSERT_EQUAL_INT(0, access(in_folder(folder, "mine"), F_OK));

    const int n_entries = shef_test_temp_count();

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_recording_writer_create(&recording, new_folder(), &bad_config, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "/nowhere/x.yaml"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(n_entries, shef_test_temp_count(), "something stayed behind");
}

static void test_what_is_no_recording_is_refused_in_one_sentence(void)
{
    char folder[4200];

    snprintf(folder, sizeof folder, "%s", new_folder());
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder, 0777));
    replayed = read_recording(folder);
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, replayed.code);
    TEST_ASSERT_NOT_NULL(strstr(replayed.error, "is not a recording"));
    replayed = read_recording("/nowhere/at/all");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, replayed.code);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_format_comes_back_from_buffers_of_any_size);
    RUN_TEST(test_times_go_on_over_wraps_and_segments);
    RUN_TEST(test_segments_end_by_size_and_by_age_and_begin_with_a_word);
    RUN_TEST(test_each_segment_can_be_read_without_the_others);
    RUN_TEST(test_data_files_hold_the_sensors_bytes_and_are_raw_files_for_everybody);
    RUN_TEST(test_the_manifest_counts_what_the_stream_holds);
    RUN_TEST(test_lost_buffers_are_in_the_verdict_with_their_place);
    RUN_TEST(test_calibration_and_configuration_are_copied_and_other_parts_are_listed);
    RUN_TEST(test_a_recording_needs_a_place_of_its_own);
    RUN_TEST(test_what_is_no_recording_is_refused_in_one_sentence);
    return UNITY_END();
}
