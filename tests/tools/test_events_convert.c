/* `sheftool events convert` keeps every event and trigger, and leaves whole files or none. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/cpu.h"
#include "core/file.h"
#include "sheftool/events_source.h"
#include "support/support.h"
#include "tools/event_files.h"
#include "tools/program.h"

static struct scene_events scene;

void tearDown(void)
{
    scene_events_free(&scene);
}

static const struct event_scene plain = {
    .start_us = 5000000, .duration_ms = 300, .trigger_period_us = 20000, .exposure_us = 4000
};

static void convert(const char *from, const char *to, const char *more)
{
    const struct program_result *result = program_run("events convert %s %s %s", from, to, more);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    TEST_ASSERT_EQUAL_STRING("", result->err);
}

/* Reads a file or recording and compares it with the scene. */
static void expect_scene(const char *path, bool with_triggers)
{
    static struct shef_event events[1000];
    struct shef_event_batch batch = { .events = events, .capacity = 1000 };
    struct shef_events_source *source;
    struct shef_error err;
    size_t n_events = 0;
    size_t n_triggers = 0;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_events_source_open(path, shef_cpu_features(), &source, &err), err.text);
    TEST_ASSERT_EQUAL_UINT32(SCENE_WIDTH_PX, shef_events_source_info(source)->width_px);
    TEST_ASSERT_EQUAL_UINT32(SCENE_HEIGHT_PX, shef_events_source_info(source)->height_px);
    while (shef_events_source_next(source, &batch, &err) == SHEF_OK) {
        for (uint32_t i = 0; i < batch.n_events; i++, n_events++) {
            TEST_ASSERT_TRUE(n_events < scene.n_events);
            TEST_ASSERT_EQUAL_INT64(scene.times_us[n_events], shef_event_batch_time_us(&batch, i));
            TEST_ASSERT_EQUAL_UINT16(scene.events[n_events].x_px, events[i].x_px);
            TEST_ASSERT_EQUAL_UINT16(scene.events[n_events].y_on, events[i].y_on);
        }
        for (uint32_t i = 0; i < batch.n_triggers; i++, n_triggers++) {
            TEST_ASSERT_TRUE(n_triggers < scene.n_triggers);
            TEST_ASSERT_EQUAL_INT64(scene.triggers[n_triggers].t_us, batch.triggers[i].t_us);
            TEST_ASSERT_EQUAL(scene.triggers[n_triggers].rising, batch.triggers[i].rising);
        }
    }
    TEST_ASSERT_EQUAL_size_t(scene.n_events, n_events);
    TEST_ASSERT_EQUAL_size_t(with_triggers ? scene.n_triggers : 0, n_triggers);
    shef_events_source_close(source);
}

static void test_every_kind_becomes_every_kind_and_comes_back(void)
{
    static const char *const steps[][2] = { { "a.raw", "--format evt2" },
                                            { "b.raw", "--format evt21" },
                                            { "c.raw", "--format evt3" },
                                            { "d_td.dat", "" },
                                            { "e.raw", "" } };
    char from[4096];
    char to[4096];

    scene = scene_events_make(&plain);
    snprintf(from, sizeof from, "%s", scene_write_recording("start", &scene, 0, 0, true));
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        snprintf(to, sizeof to, "%s", shef_test_temp_path(steps[i][0]));
        convert(from, to, steps[i][1]);
        expect_scene(to, true);
        snprintf(from, sizeof from, "%s", to);
    }
}

static void test_format_auto_keeps_the_sources(void)
{
    char from[4096];
    uint8_t *bytes;
    size_t n_bytes;

    scene = scene_events_make(&plain);
    snprintf(from, sizeof from, "%s", scene_write_raw("auto.raw", &scene));
    convert(from, shef_test_temp_path("auto2.raw"), "--format evt2");
    convert(shef_test_temp_path("auto2.raw"), shef_test_temp_path("auto3.raw"), "");
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("auto3.raw"), 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_NOT_NULL(strstr((const char *)bytes, "% format EVT2;height=48;width=64"));
    TEST_ASSERT_NOT_NULL(strstr((const char *)bytes, "% date 2026-03-01 12:00:00"));
    free(bytes);
}

/* The n-th little-endian number of n_bytes at a place. */
static int64_t number_at(const uint8_t *bytes, int n_bytes)
{
    uint64_t value = 0;

    for (int i = 0; i < n_bytes; i++)
        value |= (uint64_t)bytes[i] << 8 * i;
    return (int64_t)value;
}

static void test_npy_is_the_array_that_it_says_it_is(void)
{
    char expected[256];
    uint8_t *bytes;
    size_t n_bytes;

    scene = scene_events_make(&plain);
    convert(scene_write_raw("npy.raw", &scene), shef_test_temp_path("out.npy"), "");
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("out.npy"), 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_MEMORY("\x93NUMPY\x01\x00", bytes, 8);

    const size_t n_head = 10 + (size_t)number_at(bytes + 8, 2);

    TEST_ASSERT_EQUAL_size_t(0, n_head % 64);
    TEST_ASSERT_EQUAL_HEX8('\n', bytes[n_head - 1]);
    snprintf(expected, sizeof expected,
             "{'descr': [('t', '<i8'), ('x', '<i2'), ('y', '<i2'), ('p', '|u1')], "
             "'fortran_order': False, 'shape': (%zu,), } ",
             scene.n_events);
    TEST_ASSERT_EQUAL_MEMORY(expected, bytes + 10, strlen(expected));
    TEST_ASSERT_EQUAL_size_t(n_head + 13 * scene.n_events, n_bytes);
    for (size_t i = 0; i < scene.n_events; i++) {
        const uint8_t *item = bytes + n_head + 13 * i;

        TEST_ASSERT_EQUAL_INT64(scene.times_us[i], number_at(item, 8));
        TEST_ASSERT_EQUAL_INT64(scene.events[i].x_px, number_at(item + 8, 2));
        TEST_ASSERT_EQUAL_INT64(shef_event_y_px(scene.events[i]), number_at(item + 10, 2));
        TEST_ASSERT_EQUAL_INT64(shef_event_is_on(scene.events[i]), item[12]);
    }
    free(bytes);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_temp_path("out_trigger.npy"), 1 << 24,
                                              &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_size_t(192 + 10 * scene.n_triggers, n_bytes);
    TEST_ASSERT_EQUAL_INT64(scene.triggers[1].t_us, number_at(bytes + 192 + 10, 8));
    TEST_ASSERT_EQUAL_INT64(scene.triggers[1].rising, bytes[192 + 19]);
    free(bytes);
}

static void test_csv_has_a_head_and_a_line_an_event(void)
{
    uint8_t *bytes;
    size_t n_bytes;
    size_t n_lines = 0;
    char line[64];

    scene = scene_events_make(&plain);
    convert(scene_write_raw("csv.raw", &scene), shef_test_temp_path("out.csv"), "");
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("out.csv"), 1 << 24, &bytes, &n_bytes, NULL));
    for (char *at = (char *)bytes; *at; n_lines++) {
        if (n_lines == 0)
            snprintf(line, sizeof line, "t_us,x,y,p\n");
        else
            snprintf(line, sizeof line, "%lld,%u,%u,%d\n", (long long)scene.times_us[n_lines - 1],
                     scene.events[n_lines - 1].x_px, shef_event_y_px(scene.events[n_lines - 1]),
                     shef_event_is_on(scene.events[n_lines - 1]));
        TEST_ASSERT_EQUAL_MEMORY(line, at, strlen(line));
        at += strlen(line);
    }
    TEST_ASSERT_EQUAL_size_t(scene.n_events + 1, n_lines);
    free(bytes);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_temp_path("out_trigger.csv"), 1 << 24,
                                              &bytes, &n_bytes, NULL));
    snprintf(line, sizeof line, "t_us,channel,rising\n%lld,0,1\n",
             (long long)scene.triggers[0].t_us);
    TEST_ASSERT_EQUAL_MEMORY(line, bytes, strlen(line));
    free(bytes);
}

static void test_times_pass_the_wraps_of_every_counter(void)
{
    /* EVT2 and DAT wrap after 2^34 and 2^32 us; a recording's index has gone past both. */
    const struct event_scene late = { .start_us = (INT64_C(1) << 34) - 150000, .duration_ms = 300 };
    char from[4096];

    scene = scene_events_make(&late);
    snprintf(from, sizeof from, "%s", scene_write_recording("late", &scene, 0, 0, true));
    convert(from, shef_test_temp_path("late.csv"), "");

    uint8_t *bytes;
    size_t n_bytes;
    char line[64];

    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("late.csv"), 1 << 24, &bytes, &n_bytes, NULL));
    snprintf(line, sizeof line, "\n%lld,", (long long)scene.times_us[scene.n_events - 1]);
    TEST_ASSERT_NOT_NULL(strstr((const char *)bytes, line));
    free(bytes);

    /* In an EVT2 file the wrap is seen and counted on. */
    convert(from, shef_test_temp_path("late.raw"), "--format evt2");
    const struct program_result *result = program_run(
        "events convert %s %s", shef_test_temp_path("late.raw"), shef_test_temp_path("again.csv"));

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "wrapped"), result->err);
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("again.csv"), 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_NOT_NULL(strstr((const char *)bytes, line));
    free(bytes);
}

static void test_a_beginning_that_the_format_cannot_say_is_told(void)
{
    static const char *const steps[][3] = {
        { "short.raw", "--format evt3",
          "repeats times every 17 s, so it begins at 5.032704 s instead of 4300.000000 s" },
        { "short_td.dat", "",
          "repeats times every 4295 s, so it begins at 5.032704 s instead of 4300.000000 s" },
    };
    const struct event_scene late = { .start_us = 4300000000, .duration_ms = 50 };
    char from[4096];

    scene = scene_events_make(&late);
    snprintf(from, sizeof from, "%s", scene_write_recording("later", &scene, 0, 0, true));
    convert(from, shef_test_temp_path("long.raw"), "--format evt2");
    for (int i = 0; i < 2; i++) {
        const struct program_result *result = program_run(
            "events convert %s %s %s", from, shef_test_temp_path(steps[i][0]), steps[i][1]);

        TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, steps[i][2]), result->err);
    }
}

static void test_what_a_cut_file_still_holds_is_kept_and_the_cut_is_said(void)
{
    uint8_t *bytes;
    size_t n_bytes;
    char path[4096];

    scene = scene_events_make(&plain);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(scene_write_raw("whole.raw", &scene), 1 << 24, &bytes,
                                              &n_bytes, NULL));

    /* Half of it, and half a word of two bytes. */
    const size_t n_head = (size_t)(strstr((const char *)bytes, "% end\n") + 6 - (char *)bytes);

    snprintf(path, sizeof path, "%s",
             write_bytes("half.raw", bytes, n_head + ((n_bytes - n_head) / 2 | 1)));
    free(bytes);

    const struct program_result *result =
        program_run("events convert %s %s", path, shef_test_temp_path("half.csv"));

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "in the middle of a word"), result->err);
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("half.csv"), 1 << 24, &bytes, &n_bytes, NULL));

    size_t n_lines = 0;

    for (size_t i = 0; i < n_bytes; i++)
        n_lines += bytes[i] == '\n';
    free(bytes);
    TEST_ASSERT_TRUE(n_lines > scene.n_events / 3 && n_lines < 2 * scene.n_events / 3);
}

static void test_a_size_that_is_absurd_or_missing_is_taken_from_the_events(void)
{
    static const char *const heads[] = { "% evt 2.0\n% geometry 99999x3\n% end\n",
                                         "% evt 2.0\n% end\n" };
    static const char *const said[] = { "no sensor has the size",
                                        "does not tell the sensor's size" };
    static const uint32_t words[] = { 0x80000001, (300u << 11) | 3u, (5u << 11) | 100u };

    for (int i = 0; i < 2; i++) {
        char bytes[256];
        const size_t n_head = strlen(heads[i]);
        char path[4096];
        uint8_t *text;
        size_t n_bytes;

        memcpy(bytes, heads[i], n_head);
        memcpy(bytes + n_head, words, sizeof words);
        snprintf(path, sizeof path, "%s", write_bytes("size.raw", bytes, n_head + sizeof words));

        const struct program_result *result =
            program_run("events convert %s %s", path, shef_test_temp_path("sized.raw"));

        TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, said[i]), result->err);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_temp_path("sized.raw"), 1 << 24, &text,
                                                  &n_bytes, NULL));
        TEST_ASSERT_NOT_NULL(strstr((const char *)text, "height=101;width=301"));
        free(text);
    }
}

static void test_a_pipe_is_read_as_it_comes(void)
{
    char path[4096];
    char fifo[4096];
    int status;

    scene = scene_events_make(&plain);
    snprintf(path, sizeof path, "%s", scene_write_raw("piped.raw", &scene));
    snprintf(fifo, sizeof fifo, "%s", shef_test_temp_path("fifo"));
    TEST_ASSERT_EQUAL_INT(0, mkfifo(fifo, 0600));

    const pid_t pid = fork();

    TEST_ASSERT_TRUE(pid >= 0);
    if (pid == 0) {
        uint8_t *bytes;
        size_t n_bytes;
        const int fd = open(fifo, O_WRONLY);

        if (fd < 0 || shef_file_read(path, 1 << 24, &bytes, &n_bytes, NULL) != SHEF_OK ||
            write(fd, bytes, n_bytes) != (ssize_t)n_bytes)
            _exit(1);
        _exit(0);
    }
    convert(fifo, shef_test_temp_path("from_pipe.raw"), "--format evt2");
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
    expect_scene(shef_test_temp_path("from_pipe.raw"), true);
}

static void test_a_result_that_grows_too_large_leaves_nothing(void)
{
    char path[4096];
    struct rlimit usual;

    scene = scene_events_make(&plain);
    snprintf(path, sizeof path, "%s", scene_write_raw("large.raw", &scene));

    const int n_entries = shef_test_temp_count();

    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &usual));

    const struct rlimit small = { .rlim_cur = 4096, .rlim_max = usual.rlim_max };

    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &small));
    program_run("events convert %s %s/large.csv", path, shef_test_temp_folder());
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &usual));
    program_expect_failure(1, "large.csv", "File too large", n_entries);
}

static void test_mistakes_are_refused_and_leave_nothing(void)
{
    char path[4096];
    char folder[4096];

    scene = scene_events_make(&plain);
    snprintf(path, sizeof path, "%s", scene_write_raw("in.raw", &scene));
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("folder.csv"));
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder, 0777));

    const int n_entries = shef_test_temp_count();

    program_run("events convert %s %s/x.txt", path, shef_test_temp_folder());
    program_expect_failure(2, "x.txt", ".raw, .dat, .csv or .npy", n_entries);
    program_run("events convert %s %s/x.csv --format evt2", path, shef_test_temp_folder());
    program_expect_failure(2, "--format", ".raw", n_entries);
    program_run("events convert %s %s", path, path);
    program_expect_failure(1, "is the source itself", "another name", n_entries);
    program_run("events convert %s %s", path, folder);
    program_expect_failure(1, "folder.csv", "is no file", n_entries);
    program_run("events convert %s /nowhere/x.npy", path);
    program_expect_failure(1, "/nowhere/x.npy", "No such file", n_entries);
    program_run("events convert %s/none.raw %s/x.csv", shef_test_temp_folder(),
                shef_test_temp_folder());
    program_expect_failure(1, "none.raw", "No such file", n_entries);
    program_run("events convert %s %s/x.csv", shef_test_temp_folder(), shef_test_temp_folder());
    program_expect_failure(1, "is not a recording", "manifest.json", n_entries);
    program_run("events convert %s", path);
    program_expect_failure(2, "RESULT is missing", "--help", n_entries);
}

static void test_files_that_hold_no_events_or_no_format_are_named(void)
{
    static const struct {
        const char *content;
        const char *said;
    } bad[] = {
        { "", "is empty" },
        { "hello world\n", "not a RAW recording" },
        { "% evt 4.0\n% end\n", "'4.0' cannot be read" },
        { "% format HISTO3D;height=320;width=320\n% end\n", "'HISTO3D' cannot be read" },
        { "% geometry 640x480\n% end\n", "names no event format" },
        { "% evt 2.0\n% geometry 64", "ends inside its header" },
    };
    char path[4096];

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        snprintf(path, sizeof path, "%s",
                 write_bytes("bad.raw", bad[i].content, strlen(bad[i].content)));

        const int n_entries = shef_test_temp_count();

        program_run("events convert %s %s/bad.csv", path, shef_test_temp_folder());
        program_expect_failure(1, "bad.raw", bad[i].said, n_entries);
        program_run("events info %s", path);
        program_expect_failure(1, "bad.raw", bad[i].said, n_entries);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_kind_becomes_every_kind_and_comes_back);
    RUN_TEST(test_format_auto_keeps_the_sources);
    RUN_TEST(test_npy_is_the_array_that_it_says_it_is);
    RUN_TEST(test_csv_has_a_head_and_a_line_an_event);
    RUN_TEST(test_times_pass_the_wraps_of_every_counter);
    RUN_TEST(test_a_beginning_that_the_format_cannot_say_is_told);
    RUN_TEST(test_what_a_cut_file_still_holds_is_kept_and_the_cut_is_said);
    RUN_TEST(test_a_size_that_is_absurd_or_missing_is_taken_from_the_events);
    RUN_TEST(test_a_pipe_is_read_as_it_comes);
    RUN_TEST(test_a_result_that_grows_too_large_leaves_nothing);
    RUN_TEST(test_mistakes_are_refused_and_leave_nothing);
    RUN_TEST(test_files_that_hold_no_events_or_no_format_are_named);
    return UNITY_END();
}
