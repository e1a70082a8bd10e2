/* `sheftool events convert` keeps what a damaged source still holds, and an old result where it is
 * stopped. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "sheftool/command.h"
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

static const char *write_as(const char *name, enum shef_evt_format format)
{
    const struct shef_event_writer_config config = {
        .is_raw = true,
        .width_px = SCENE_WIDTH_PX,
        .height_px = SCENE_HEIGHT_PX,
        .date = "2026-03-01 12:00:00",
        .format = format,
        .ticks = SHEF_EVT_TICKS_SPARSE,
        .generation = SHEF_RAW_NEW,
    };

    return scene_write_file(name, &scene, &config);
}

/* Overwrites some bytes in a file's middle with noise. */
static void damage(const char *path, size_t n_noise)
{
    struct shef_test_random random = { 11 };
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_GREATER_THAN_size_t(10 * n_noise, n_bytes);
    for (size_t i = 0; i < n_noise; i++)
        bytes[n_bytes / 2 + i] = (uint8_t)shef_test_random_range(&random, 0, 255);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, NULL));
    free(bytes);
}

/* How many of the scene's events a CSV file holds, in their order; lines of others are skipped. */
static size_t count_found(const char *path)
{
    uint8_t *bytes;
    size_t n_bytes;
    size_t n_found = 0;
    size_t next = 0;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 26, &bytes, &n_bytes, NULL));
    for (char *line = strtok((char *)bytes, "\n"); line; line = strtok(NULL, "\n")) {
        for (size_t i = next; i < scene.n_events && i < next + 5000; i++) {
            char expected[64];

            snprintf(expected, sizeof expected, "%lld,%u,%u,%d", (long long)scene.times_us[i],
                     scene.events[i].x_px, shef_event_y_px(scene.events[i]),
                     shef_event_is_on(scene.events[i]));
            if (strcmp(line, expected) == 0) {
                next = i + 1;
                n_found++;
                break;
            }
        }
    }
    free(bytes);
    return n_found;
}

static void test_noise_in_a_files_middle_costs_only_what_it_hit(void)
{
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT3 };
    static const char *const names[] = { "evt2.raw", "evt21.raw", "evt3.raw" };

    scene = scene_events_make(&plain);
    for (int i = 0; i < 3; i++) {
        char path[4096];

        snprintf(path, sizeof path, "%s", write_as(names[i], formats[i]));
        damage(path, 64);

        const struct program_result *result =
            program_run("events convert %s %s", path, shef_test_temp_path("damaged.csv"));

        TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "breaks its format"), result->err);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, names[i]), result->err);
        TEST_ASSERT_TRUE_MESSAGE(count_found(shef_test_temp_path("damaged.csv")) >
                                     scene.n_events - scene.n_events / 20,
                                 names[i]);
    }
}

static void test_a_recording_with_a_bad_block_gives_all_others(void)
{
    char path[4096];
    char data[4200];

    scene = scene_events_make(&plain);
    snprintf(path, sizeof path, "%s", scene_write_recording("hurt", &scene, 0, 0, true));
    snprintf(data, sizeof data, "%s/events/000001.raw", path);
    damage(data, 4);

    const struct program_result *result =
        program_run("events convert %s %s", path, shef_test_temp_path("hurt.csv"));

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "do not match their checksums"), result->err);

    const size_t n_found = count_found(shef_test_temp_path("hurt.csv"));

    TEST_ASSERT_TRUE(n_found < scene.n_events);
    TEST_ASSERT_TRUE(n_found > scene.n_events - scene.n_events / 20);
}

/* Last: after this every long work in this process counts as interrupted. */
static void test_a_stopped_conversion_leaves_the_old_result_and_nothing_new(void)
{
    static const char *const endings[] = { "raw", "dat", "csv", "npy" };
    const struct shef_command *convert = &shef_command_events_convert;
    char source[4096];

    scene = scene_events_make(&plain);
    snprintf(source, sizeof source, "%s", scene_write_raw("source.raw", &scene));
    shef_interrupt_install();
    raise(SIGTERM);
    for (int i = 0; i < 4; i++) {
        char out[4096];
        char command[] = "convert";
        char *argv[] = { command, source, out };
        struct shef_error err;
        bool help;
        uint8_t *bytes;
        size_t n_bytes;
        void *settings = calloc(1, convert->settings_bytes);

        TEST_ASSERT_NOT_NULL(settings);
        snprintf(out, sizeof out, "%s.%s", shef_test_temp_path("stopped"), endings[i]);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(out, "old", 3, NULL));

        const int n_entries = shef_test_temp_count();

        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_options_parse(convert->options, settings, 3, argv, &help, &err));
        TEST_ASSERT_EQUAL(SHEF_ERR_GONE, convert->run(settings, &err));
        TEST_ASSERT_NOT_NULL(strstr(err.text, "nothing was written"));
        TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(out, 100, &bytes, &n_bytes, NULL));
        TEST_ASSERT_EQUAL_STRING("old", (const char *)bytes);
        free(bytes);
        free(settings);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_noise_in_a_files_middle_costs_only_what_it_hit);
    RUN_TEST(test_a_recording_with_a_bad_block_gives_all_others);
    RUN_TEST(test_a_stopped_conversion_leaves_the_old_result_and_nothing_new);
    return UNITY_END();
}
