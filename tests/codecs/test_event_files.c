/* Event files of every kind: written, read back, damaged, and refused. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "codecs/event_reader.h"
#include "codecs/event_writer.h"
#include "core/cpu.h"
#include "streams.h"

static struct decoded scene;
static struct decoded decoded;
static struct shef_event_reader *reader;
static struct shef_error err;

void tearDown(void)
{
    decoded_free(&scene);
    decoded_free(&decoded);
    shef_event_reader_close(reader);
    reader = NULL;
}

static void make_scene(int64_t start_us)
{
    struct shef_test_random random = shef_test_random_start();

    decoded_free(&scene);
    scene = scene_make((struct scene){ .width_px = 640,
                                       .height_px = 480,
                                       .start_us = start_us,
                                       .pause_us = 50000,
                                       .n_bursts = 5000,
                                       .n_channels = 8 },
                       &random);
}

/* The scene as one batch, for the writer. */
static struct shef_event_batch batch_of_scene(size_t from, size_t n)
{
    struct shef_event_batch batch = { .events = calloc(n + 1, sizeof *batch.events),
                                      .capacity = (uint32_t)n + 1,
                                      .base_us = scene.events[from].t_us };

    TEST_ASSERT_NOT_NULL(batch.events);
    for (size_t i = from; i < from + n; i++)
        batch.events[batch.n_events++] =
            shef_event_make((uint32_t)(scene.events[i].t_us - batch.base_us), scene.events[i].x_px,
                            scene.events[i].y_px, scene.events[i].on);
    batch.reached_us = scene.events[from + n - 1].t_us;
    for (size_t i = 0; i < scene.n_triggers; i++)
        if (scene.triggers[i].n_before > from && scene.triggers[i].n_before <= from + n) {
            TEST_ASSERT_TRUE(batch.n_triggers < SHEF_BATCH_TRIGGERS);
            batch.triggers[batch.n_triggers] = scene.triggers[i];
            batch.triggers[batch.n_triggers++].n_before -= (uint32_t)from;
        }
    return batch;
}

static void write_scene(const char *path, const struct shef_event_writer_config *config)
{
    struct shef_event_writer *writer;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_open(path, config, &writer, &err),
                              err.text);
    for (size_t at = 0; at < scene.n_events; at += 2000) {
        const size_t n_left = scene.n_events - at;
        struct shef_event_batch batch = batch_of_scene(at, n_left < 2000 ? n_left : 2000);

        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_write(writer, &batch, &err), err.text);
        free(batch.events);
    }
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_close(writer, &err), err.text);
}

static void open_file(const char *path)
{
    tearDown();
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_reader_open(path, shef_cpu_features(), &reader, &err), err.text);
}

static void read_all(const char *path)
{
    static struct shef_event events[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = 1000 };
    enum shef_err code;

    shef_event_reader_close(reader);
    reader = NULL;
    decoded_free(&decoded);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_reader_open(path, shef_cpu_features(), &reader, &err), err.text);
    while ((code = shef_event_reader_next(reader, &batch, &err)) == SHEF_OK) {
        TEST_ASSERT_TRUE(batch.n_events > 0 || batch.n_triggers > 0);
        decoded_add(&decoded, &batch);
    }
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_EMPTY, code, err.text);
    decoded.stats = shef_event_reader_stats(reader);
}

static bool has_note(const char *text)
{
    for (int i = 0; shef_event_reader_note(reader, i); i++)
        if (strstr(shef_event_reader_note(reader, i), text))
            return true;
    return false;
}

static const struct shef_event_writer_config evt3_config = { .is_raw = true,
                                                             .width_px = 640,
                                                             .height_px = 480,
                                                             .format = SHEF_EVT3,
                                                             .generation = SHEF_RAW_NEW };

static void test_raw_files_of_every_format_and_generation_come_back(void)
{
    make_scene(3000000);
    for (int format = 0; format < SHEF_EVT_FORMATS; format++)
        for (int generation = 0; generation < 2; generation++) {
            struct shef_event_writer_config config = evt3_config;

            config.format = (enum shef_evt_format)format;
            config.generation = (enum shef_raw_generation)generation;
            config.ticks = generation ? SHEF_EVT_TICKS_SENSOR : SHEF_EVT_TICKS_SPARSE;
            write_scene(shef_test_temp_path("scene.raw"), &config);
            read_all(shef_test_temp_path("scene.raw"));
            expect_same_events(&scene, &decoded);
            expect_no_violations(&decoded.stats);
            TEST_ASSERT_NULL(shef_event_reader_note(reader, 0));

            const struct shef_event_file_info *info = shef_event_reader_info(reader);

            TEST_ASSERT_TRUE(info->is_raw && info->size_known);
            TEST_ASSERT_EQUAL(format, info->raw.format);
            TEST_ASSERT_EQUAL_UINT32(640, info->width_px);
            TEST_ASSERT_EQUAL_UINT32(480, info->height_px);
            TEST_ASSERT_EQUAL_DOUBLE(1.0, shef_event_reader_progress(reader));
        }
    TEST_ASSERT_EQUAL(1, shef_test_temp_count());
    unlink(shef_test_temp_path("scene.raw"));
}

static void test_dat_files_come_back_with_their_trigger_file(void)
{
    static const char *const names[] = { "log_td.dat", "a_cd.dat" };
    static const char *const trigger_names[] = { "log_trigger.dat", "a_trigger.dat" };
    const struct shef_event_writer_config config = { .width_px = 640, .height_px = 480 };

    for (size_t i = 0; i < 2; i++) {
        make_scene(0);
        write_scene(shef_test_temp_path(names[i]), &config);
        TEST_ASSERT_EQUAL(2, shef_test_temp_count());
        read_all(shef_test_temp_path(names[i]));
        TEST_ASSERT_EQUAL_UINT64(scene.n_events, decoded.n_events);
        TEST_ASSERT_EQUAL_UINT64(scene.n_triggers, decoded.n_triggers);
        TEST_ASSERT_EQUAL_UINT64(scene.n_triggers, decoded.stats.n_triggers);
        for (size_t j = 0; j < scene.n_triggers; j++) {
            const struct shef_trigger trigger = decoded.triggers[j];

            TEST_ASSERT_EQUAL_INT64(scene.triggers[j].t_us, trigger.t_us);
            TEST_ASSERT_EQUAL_UINT8(scene.triggers[j].channel, trigger.channel);
            /* Merged by time: events before it are not later, events after it not earlier. */
            if (trigger.n_before > 0)
                TEST_ASSERT_TRUE(decoded.events[trigger.n_before - 1].t_us <= trigger.t_us);
            if (trigger.n_before < decoded.n_events)
                TEST_ASSERT_TRUE(decoded.events[trigger.n_before].t_us >= trigger.t_us);
        }
        unlink(shef_test_temp_path(names[i]));
        read_all(shef_test_temp_path(trigger_names[i]));
        TEST_ASSERT_EQUAL_UINT64(0, decoded.n_events);
        TEST_ASSERT_EQUAL_UINT64(scene.n_triggers, decoded.n_triggers);
        unlink(shef_test_temp_path(trigger_names[i]));
    }
}

static void test_a_broken_trigger_file_is_left_out_with_a_note(void)
{
    const struct shef_event_writer_config config = { .width_px = 640, .height_px = 480 };
    FILE *file;

    make_scene(0);
    write_scene(shef_test_temp_path("log_td.dat"), &config);
    file = fopen(shef_test_temp_path("log_trigger.dat"), "wb");
    TEST_ASSERT_NOT_NULL(file);
    fputs("no triggers here", file);
    fclose(file);
    read_all(shef_test_temp_path("log_td.dat"));
    TEST_ASSERT_EQUAL_UINT64(scene.n_events, decoded.n_events);
    TEST_ASSERT_TRUE(has_note("log_trigger.dat' was left out"));
    unlink(shef_test_temp_path("log_td.dat"));
    unlink(shef_test_temp_path("log_trigger.dat"));
}

static void test_a_truncated_file_keeps_what_could_be_read(void)
{
    const char *path = shef_test_temp_path("cut.raw");
    struct shef_raw_header header;
    struct stat status;

    make_scene(0);
    write_scene(path, &evt3_config);
    TEST_ASSERT_EQUAL(0, stat(path, &status));
    read_all(path);
    header = shef_event_reader_info(reader)->raw;
    /* Two thirds of the words and one byte more. */
    TEST_ASSERT_EQUAL(0, truncate(path, (off_t)header.n_bytes +
                                            (status.st_size - (off_t)header.n_bytes) / 6 * 4 + 1));
    read_all(path);
    TEST_ASSERT_TRUE(decoded.n_events > scene.n_events / 2);
    scene.n_events = decoded.n_events;
    scene.n_triggers = decoded.n_triggers;
    expect_same_events(&scene, &decoded);
    TEST_ASSERT_TRUE(has_note("ends in the middle of a word (1 of 2 bytes)"));
    unlink(path);
}

static void write_bytes(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");

    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    fclose(file);
}

static void append_words(const char *path, const uint16_t *words, size_t n_words)
{
    FILE *file = fopen(path, "ab");

    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_UINT64(n_words, fwrite(words, sizeof *words, n_words, file));
    fclose(file);
}

static void test_absurd_and_unknown_sizes_are_noted_and_read(void)
{
    static const uint16_t words[] = { 0x8010, 0x0005, 0x27ff };
    const char *path = shef_test_temp_path("size.raw");

    write_bytes(path, "% evt 3.0\n% geometry 100000x3\n% end\n");
    append_words(path, words, sizeof words / sizeof words[0]);
    read_all(path);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    expect_event(&decoded, 0, 16 * 4096, 2047, 5, false);
    TEST_ASSERT_TRUE(has_note("no sensor has the size in its header ('100000x3')"));
    TEST_ASSERT_FALSE(shef_event_reader_info(reader)->size_known);
    write_bytes(path, "% evt 3.0\n% end\n");
    read_all(path);
    TEST_ASSERT_TRUE(has_note("does not tell the sensor's size"));
    TEST_ASSERT_TRUE(has_note("holds no event in the 0 bytes after its header"));
    unlink(path);
}

static void test_damage_is_noted(void)
{
    const char *path = shef_test_temp_path("damaged.raw");
    uint16_t words[4000];

    write_bytes(path, "% evt 3.0\n% geometry 640x480\n% end\n");
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        words[i] = (uint16_t)(0xb000 + i);
    append_words(path, words, sizeof words / sizeof words[0]);
    read_all(path);
    TEST_ASSERT_TRUE(has_note("is damaged: "));
    unlink(path);
}

static void test_events_outside_the_sensor_are_counted_in_a_note(void)
{
    static const uint16_t words[] = { 0x8010, 0x0005, 0x2003, 0x2400, 0x2fff };
    const char *path = shef_test_temp_path("outside.raw");

    write_bytes(path, "% evt 3.0\n% geometry 640x480\n% end\n");
    append_words(path, words, sizeof words / sizeof words[0]);
    read_all(path);
    TEST_ASSERT_EQUAL_UINT64(1, decoded.n_events);
    TEST_ASSERT_TRUE(has_note("2 event(s) lie outside the sensor of 640 x 480 px"));
    unlink(path);
}

static void test_a_stream_without_time_words_says_so(void)
{
    static const uint16_t words[] = { 0x0005, 0x2003, 0x2004 };
    const char *path = shef_test_temp_path("timeless.raw");

    write_bytes(path, "% evt 3.0\n% geometry 640x480\n% end\n");
    append_words(path, words, sizeof words / sizeof words[0]);
    read_all(path);
    TEST_ASSERT_EQUAL_UINT64(0, decoded.n_events);
    TEST_ASSERT_TRUE(has_note("all 2 event(s) were left out, because no time word precedes them"));
    unlink(path);
}

static void test_the_wrap_of_a_long_clock_is_noted(void)
{
    const struct shef_event_writer_config evt2_config = {
        .is_raw = true, .width_px = 640, .height_px = 480, .format = SHEF_EVT2
    };
    const char *path = shef_test_temp_path("wrap.raw");

    make_scene(((int64_t)1 << 34) - 2000);
    write_scene(path, &evt2_config);
    read_all(path);
    expect_same_events(&scene, &decoded);
    TEST_ASSERT_TRUE(has_note("clock wrapped 1 time(s)"));
    unlink(path);
}

static void test_the_wrap_of_a_short_clock_is_everyday(void)
{
    const char *path = shef_test_temp_path("wrap.raw");

    make_scene(((int64_t)1 << 24) - 2000);
    write_scene(path, &evt3_config);
    read_all(path);
    expect_same_events(&scene, &decoded);
    TEST_ASSERT_EQUAL_UINT64(1, shef_event_reader_stats(reader).n_wraps);
    TEST_ASSERT_FALSE(has_note("wrapped"));
    unlink(path);
}

static void expect_no_opening(const char *path, enum shef_err code, const char *sentence)
{
    struct shef_event_reader *none = NULL;

    err = (struct shef_error){ 0 };
    TEST_ASSERT_EQUAL(code, shef_event_reader_open(path, shef_cpu_features(), &none, &err));
    TEST_ASSERT_NULL(none);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, sentence), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, path), err.text);
}

static void test_what_is_no_recording_is_refused_with_its_path(void)
{
    const char *path = shef_test_temp_path("x.raw");
    const char *dat_path = shef_test_temp_path("x.dat");

    expect_no_opening(path, SHEF_ERR_NOT_FOUND, "open event file");
    expect_no_opening(shef_test_temp_folder(), SHEF_ERR_INVALID, "is a folder");
    write_bytes(path, "");
    expect_no_opening(path, SHEF_ERR_FORMAT, "the file is empty");
    write_bytes(path, "\x89PNG\r\n and so on");
    expect_no_opening(path, SHEF_ERR_FORMAT, "not a RAW recording");
    write_bytes(path, "% format EVT9;height=1;width=1\n% end\n");
    expect_no_opening(path, SHEF_ERR_UNSUPPORTED, "'EVT9' cannot be read");
    write_bytes(dat_path, "\x89PNG\r\n\x1a\n____");
    expect_no_opening(dat_path, SHEF_ERR_FORMAT, "not a DAT recording");
    unlink(path);
    unlink(dat_path);
}

static void test_a_pipe_can_be_read(void)
{
    const char *path = shef_test_temp_path("piped.raw");
    char command[1024];
    FILE *pipe;
    char fd_path[64];

    make_scene(0);
    write_scene(path, &evt3_config);
    snprintf(command, sizeof command, "cat '%s'", path);
    pipe = popen(command, "r");
    TEST_ASSERT_NOT_NULL(pipe);
    snprintf(fd_path, sizeof fd_path, "/proc/self/fd/%d", fileno(pipe));
    read_all(fd_path);
    TEST_ASSERT_EQUAL(0, pclose(pipe));
    expect_same_events(&scene, &decoded);
    TEST_ASSERT_EQUAL_INT64(-1, shef_event_reader_info(reader)->n_file_bytes);
    unlink(path);
}

static void test_a_failed_write_leaves_nothing_behind(void)
{
    const char *path = shef_test_temp_path("never.raw");
    struct shef_event event = shef_event_make(0, 640, 0, true);
    const struct shef_event_batch batch = { .events = &event, .capacity = 1, .n_events = 1 };
    struct shef_event_writer *writer;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_writer_open(path, &evt3_config, &writer, &err));
    TEST_ASSERT_EQUAL(1, shef_test_temp_count());
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_event_writer_write(writer, &batch, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "EVT3 cannot hold event 0 at (640, 0)"),
                                 err.text);
    err = (struct shef_error){ 0 };
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_event_writer_close(writer, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "(640, 0)"));
    TEST_ASSERT_EQUAL(0, shef_test_temp_count());

    TEST_ASSERT_EQUAL(SHEF_OK, shef_event_writer_open(path, &evt3_config, &writer, &err));
    shef_event_writer_abandon(writer);
    TEST_ASSERT_EQUAL(0, shef_test_temp_count());
}

static void test_impossible_places_and_sizes_are_refused(void)
{
    struct shef_event_writer_config config = evt3_config;
    struct shef_event_writer *writer;

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_event_writer_open("/nowhere/at/all.raw", &config, &writer, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "/nowhere/at/all.raw"));
    config.width_px = 2049;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_event_writer_open(shef_test_temp_path("x"), &config, &writer, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "2049 x 480"));
    TEST_ASSERT_EQUAL(0, shef_test_temp_count());
}

static void test_a_copy_keeps_the_cameras_data(void)
{
    const char *path = shef_test_temp_path("copy.raw");
    struct shef_raw_header like = { .system_id = 21, .serial = "30384338" };
    struct shef_event_writer_config config = evt3_config;

    strcpy(like.plugin, "hal_plugin_gen3_fx3");
    config.like = &like;
    config.date = "2020-09-14 09:03:25";
    make_scene(0);
    write_scene(path, &config);
    open_file(path);
    const struct shef_raw_header *raw = &shef_event_reader_info(reader)->raw;

    TEST_ASSERT_EQUAL_INT32(21, raw->system_id);
    TEST_ASSERT_EQUAL_STRING("30384338", raw->serial);
    TEST_ASSERT_EQUAL_STRING("hal_plugin_gen3_fx3", raw->plugin);
    TEST_ASSERT_EQUAL_STRING("2020-09-14 09:03:25", raw->date);
    unlink(path);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_raw_files_of_every_format_and_generation_come_back);
    RUN_TEST(test_dat_files_come_back_with_their_trigger_file);
    RUN_TEST(test_a_broken_trigger_file_is_left_out_with_a_note);
    RUN_TEST(test_a_truncated_file_keeps_what_could_be_read);
    RUN_TEST(test_absurd_and_unknown_sizes_are_noted_and_read);
    RUN_TEST(test_damage_is_noted);
    RUN_TEST(test_events_outside_the_sensor_are_counted_in_a_note);
    RUN_TEST(test_a_stream_without_time_words_says_so);
    RUN_TEST(test_the_wrap_of_a_long_clock_is_noted);
    RUN_TEST(test_the_wrap_of_a_short_clock_is_everyday);
    RUN_TEST(test_what_is_no_recording_is_refused_with_its_path);
    RUN_TEST(test_a_pipe_can_be_read);
    RUN_TEST(test_a_failed_write_leaves_nothing_behind);
    RUN_TEST(test_impossible_places_and_sizes_are_refused);
    RUN_TEST(test_a_copy_keeps_the_cameras_data);
    return UNITY_END();
}
