/* `sheftool events info` says what is in a file or recording. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "sheftool/events_report.h"
#include "support/support.h"
#include "tools/event_files.h"
#include "tools/program.h"

static struct scene_events scene;
static json_t *root;

void tearDown(void)
{
    scene_events_free(&scene);
    json_decref(root);
    root = NULL;
}

static void make_scene(const struct event_scene *wanted)
{
    scene = scene_events_make(wanted);
    TEST_ASSERT_TRUE(scene.n_events > 1000);
}

static const struct event_scene plain = {
    .start_us = 5000000, .duration_ms = 400, .trigger_period_us = 20000, .exposure_us = 4000
};

static void info(const char *path, const char *more)
{
    const struct program_result *result = program_run("events info %s --json %s", path, more);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    json_decref(root);
    root = json_loads(result->out, 0, NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(root, result->out);
}

static json_int_t integer_at(const char *key)
{
    const json_t *value = json_object_get(root, key);

    TEST_ASSERT_TRUE_MESSAGE(json_is_integer(value), key);
    return json_integer_value(value);
}

static const char *text_at(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));

    TEST_ASSERT_NOT_NULL_MESSAGE(value, key);
    return value;
}

static bool has_note(const char *word)
{
    size_t i;
    json_t *note;

    json_array_foreach(json_object_get(root, "notes"), i, note)
    {
        if (strstr(json_string_value(note), word))
            return true;
    }
    return false;
}

static void test_counts_times_and_triggers_are_those_of_the_scene(void)
{
    static const char *const kinds[] = { "raw", "dat", "recording" };
    const struct shef_event_writer_config dat = { .width_px = SCENE_WIDTH_PX,
                                                  .height_px = SCENE_HEIGHT_PX };
    size_t n_rising = 0;

    make_scene(&plain);
    for (size_t i = 0; i < scene.n_triggers; i++)
        n_rising += scene.triggers[i].rising;
    for (int i = 0; i < 3; i++) {
        info(i == 0   ? scene_write_raw("plain.raw", &scene)
             : i == 1 ? scene_write_file("plain_td.dat", &scene, &dat)
                      : scene_write_recording("plain", &scene, 0, 0, true),
             "");
        TEST_ASSERT_EQUAL_STRING(kinds[i], text_at(root, "kind"));
        TEST_ASSERT_EQUAL_INT64(scene.n_events, integer_at("n_events"));
        TEST_ASSERT_EQUAL_INT64(scene.n_events / 2, integer_at("n_on"));
        TEST_ASSERT_EQUAL_INT64(SCENE_WIDTH_PX, integer_at("width_px"));
        TEST_ASSERT_EQUAL_INT64(scene.times_us[0], integer_at("first_us"));
        TEST_ASSERT_EQUAL_INT64(scene.times_us[scene.n_events - 1], integer_at("last_us"));
        TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.1,
                                  json_number_value(json_object_get(root, "mean_mev_per_s")));
        TEST_ASSERT_EQUAL_size_t(0, json_array_size(json_object_get(root, "gaps")));
        TEST_ASSERT_EQUAL_size_t(0, json_array_size(json_object_get(root, "notes")));

        const json_t *channel = json_array_get(json_object_get(root, "triggers"), 0);

        TEST_ASSERT_EQUAL_INT64(n_rising, json_integer_value(json_object_get(channel, "rising")));
        TEST_ASSERT_EQUAL_INT64(scene.n_triggers - n_rising,
                                json_integer_value(json_object_get(channel, "falling")));
        TEST_ASSERT_EQUAL_INT64(20000,
                                json_integer_value(json_object_get(channel, "usual_interval_us")));
        TEST_ASSERT_EQUAL_INT64(0, json_integer_value(json_object_get(channel, "missing")));
        TEST_ASSERT_EQUAL_DOUBLE(4000, json_number_value(json_object_get(channel, "mean_high_us")));
    }
}

static void test_missing_edges_are_counted(void)
{
    make_scene(&plain);
    /* A rising edge and the falling one after it, in two places. */
    for (size_t i = 6; i + 4 < scene.n_triggers; i++)
        scene.triggers[i] = scene.triggers[i < 12 ? i + 2 : i + 4];
    scene.n_triggers -= 4;
    info(scene_write_raw("missing.raw", &scene), "");

    const json_t *channel = json_array_get(json_object_get(root, "triggers"), 0);

    TEST_ASSERT_EQUAL_INT64(2, json_integer_value(json_object_get(channel, "missing")));
    TEST_ASSERT_EQUAL_INT64(40000, json_integer_value(json_object_get(channel, "max_interval_us")));
}

static void test_the_rates_bins_add_up_to_all_events(void)
{
    json_int_t n_on = 0;
    size_t i;
    json_t *bin;
    const struct event_scene quiet = { .duration_ms = 3000 };

    make_scene(&quiet);
    info(scene_write_raw("rate.raw", &scene), "");

    const json_t *rate = json_object_get(root, "rate");
    const json_t *on = json_object_get(rate, "on");
    const json_int_t bin_us = json_integer_value(json_object_get(rate, "bin_us"));

    json_array_foreach(on, i, bin) n_on += json_integer_value(bin);
    TEST_ASSERT_EQUAL_INT64(integer_at("n_on"), n_on);
    /* An even stream: all bins but the last hold the same. */
    TEST_ASSERT_TRUE(json_array_size(on) > 100);
    TEST_ASSERT_INT64_WITHIN(bin_us, 3000000, bin_us * (json_int_t)json_array_size(on));
    for (i = 0; i + 1 < json_array_size(on); i++)
        TEST_ASSERT_EQUAL_INT64(bin_us / 20, json_integer_value(json_array_get(on, i)));
}

static void test_silence_is_a_pause_and_its_place_is_said(void)
{
    const struct event_scene silent = { .duration_ms = 300,
                                        .silence_from_ms = 100,
                                        .silence_to_ms = 150 };

    make_scene(&silent);
    info(scene_write_raw("silent.raw", &scene), "");

    const json_t *pauses = json_object_get(root, "pauses");

    TEST_ASSERT_EQUAL_INT64(1, json_integer_value(json_object_get(pauses, "n")));
    TEST_ASSERT_EQUAL_INT64(50020, json_integer_value(json_object_get(pauses, "longest_us")));
    TEST_ASSERT_EQUAL_INT64(99980, json_integer_value(json_object_get(pauses, "longest_at_us")));
    info(shef_test_temp_path("silent.raw"), "--pause 60");
    pauses = json_object_get(root, "pauses");
    TEST_ASSERT_EQUAL_INT64(0, json_integer_value(json_object_get(pauses, "n")));
}

static void test_a_pixel_that_fires_on_its_own_is_hot_and_a_busy_edge_is_not(void)
{
    const struct event_scene hot = { .duration_ms = 300, .hot_period_us = 200 };

    make_scene(&hot);
    info(scene_write_raw("hot.raw", &scene), "");

    const json_t *pixels = json_object_get(json_object_get(root, "hot_pixels"), "pixels");
    const json_t *pixel = json_array_get(pixels, 0);

    TEST_ASSERT_EQUAL_size_t(1, json_array_size(pixels));
    TEST_ASSERT_EQUAL_INT64(60, json_integer_value(json_object_get(pixel, "x")));
    TEST_ASSERT_EQUAL_INT64(40, json_integer_value(json_object_get(pixel, "y")));
    TEST_ASSERT_DOUBLE_WITHIN(100, 5000, json_number_value(json_object_get(pixel, "per_s")));
    info(shef_test_temp_path("hot.raw"), "--hot 6000");
    TEST_ASSERT_EQUAL_INT64(
        0, json_integer_value(json_object_get(json_object_get(root, "hot_pixels"), "n")));
}

static void test_violations_are_counted_by_class(void)
{
    /* EVT2, 64 x 48: a time, an event inside, two outside, a word of no type, half a word. */
    static const char head[] = "% evt 2.0\n% geometry 64x48\n% end\n";
    static const uint32_t words[] = { 0x80000001,       (5u << 11) | 3u, (70u << 11) | 3u,
                                      (5u << 11) | 60u, 0x30000000,      (6u << 11) | 4u };
    char bytes[sizeof head - 1 + sizeof words + 2];

    memcpy(bytes, head, sizeof head - 1);
    memcpy(bytes + sizeof head - 1, words, sizeof words);
    memset(bytes + sizeof head - 1 + sizeof words, 7, 2);
    info(write_bytes("odd.raw", bytes, sizeof bytes), "");

    const json_t *violations = json_object_get(root, "violations");

    TEST_ASSERT_EQUAL_INT64(2, integer_at("n_events"));
    TEST_ASSERT_EQUAL_INT64(
        2, json_integer_value(json_object_get(violations, "event outside the sensor")));
    TEST_ASSERT_EQUAL_INT64(1, json_integer_value(json_object_get(violations, "unknown word")));
    TEST_ASSERT_EQUAL_INT64(1,
                            json_integer_value(json_object_get(violations, "word cut by the end")));
    TEST_ASSERT_TRUE(has_note("in the middle of a word"));
}

static void test_the_text_names_everything_a_person_looks_for(void)
{
    static const char *const words[] = { "RAW file, EVT3",
                                         "64 x 48 px",
                                         "duration",
                                         "50.0 % of them ON",
                                         "kev/s in the mean",
                                         "triggers",
                                         "channel 0",
                                         "every 20.000 ms",
                                         "lost data",
                                         "none known",
                                         "violations",
                                         "hot pixels",
                                         "|##" };
    const struct program_result *result;

    make_scene(&plain);
    result = program_run("events info %s", scene_write_raw("text.raw", &scene));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    TEST_ASSERT_EQUAL_STRING("", result->err);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->out, words[i]), result->out);
}

static void test_missing_edges_are_said_in_the_text(void)
{
    make_scene(&plain);
    for (size_t i = 6; i + 2 < scene.n_triggers; i++)
        scene.triggers[i] = scene.triggers[i + 2];
    scene.n_triggers -= 2;

    const struct program_result *result =
        program_run("events info %s", scene_write_raw("said.raw", &scene));

    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->out, "1 rising edge seems to be missing"),
                                 result->out);
}

static void test_rates_are_in_a_unit_that_leaves_digits_to_read(void)
{
    TEST_ASSERT_EQUAL_STRING("Mev/s", shef_rate_unit_of(50).name);
    TEST_ASSERT_EQUAL_STRING("Mev/s", shef_rate_unit_of(1).name);
    TEST_ASSERT_EQUAL_STRING("kev/s", shef_rate_unit_of(0.999).name);
    TEST_ASSERT_EQUAL_STRING("ev/s", shef_rate_unit_of(2e-4).name);
    TEST_ASSERT_EQUAL_DOUBLE(200, 2e-4 * shef_rate_unit_of(2e-4).per_mev_s);
    TEST_ASSERT_EQUAL_STRING("ev/s", shef_rate_unit_of(0).name);
}

/* Surveys an event every 50 us up to a time. */
static struct shef_survey *survey_until(uint32_t end_us)
{
    static struct shef_event events[1000];
    static struct shef_survey survey;
    struct shef_event_batch batch = { .events = events, .base_us = 7, .capacity = 1000 };

    for (uint32_t t_us = 0; t_us <= end_us; t_us += 50)
        events[batch.n_events++] = shef_event_make(t_us, 3, 4, true);
    batch.reached_us = batch.base_us + end_us;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_survey_create(&survey, 64, 48, 10000, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_survey_add(&survey, &batch, 0, NULL));
    return &survey;
}

static void test_one_event_in_a_bin_that_has_just_begun_is_no_burst(void)
{
    struct shef_survey *survey = survey_until(2000);

    /* Bins of 100 us; the event at 2000 us is alone in the 21st. */
    TEST_ASSERT_EQUAL_UINT32(21, survey->n_bins);
    TEST_ASSERT_EQUAL_UINT32(20, shef_survey_rated_bins(survey));
    shef_survey_destroy(survey);
    survey = survey_until(1950);
    TEST_ASSERT_EQUAL_UINT32(20, survey->n_bins);
    TEST_ASSERT_EQUAL_UINT32(20, shef_survey_rated_bins(survey));
    shef_survey_destroy(survey);
    survey = survey_until(0);
    TEST_ASSERT_EQUAL_UINT32(1, shef_survey_rated_bins(survey));
    shef_survey_destroy(survey);
}

/* Reads a colour PNG's size from its header. */
static void expect_png(const char *path, uint32_t min_width_px)
{
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_TRUE(n_bytes > 1000);
    TEST_ASSERT_EQUAL_MEMORY("\x89PNG", bytes, 4);
    TEST_ASSERT_TRUE(((uint32_t)bytes[18] << 8 | bytes[19]) >= min_width_px);
    free(bytes);
}

static void test_the_picture_is_a_png_and_a_bad_place_for_it_leaves_nothing(void)
{
    char path[4096];

    make_scene(&plain);
    snprintf(path, sizeof path, "%s", scene_write_raw("drawn.raw", &scene));
    TEST_ASSERT_EQUAL_INT(
        0,
        program_run("events info %s --picture %s", path, shef_test_temp_path("drawn.png"))->status);
    expect_png(shef_test_temp_path("drawn.png"), 900);

    const int n_entries = shef_test_temp_count();

    program_run("events info %s --picture /nowhere/x.png", path);
    program_expect_failure(1, "/nowhere/x.png", "No such file", n_entries);
    program_run("events info %s --picture %s", path, shef_test_temp_path("x.jpg"));
    program_expect_failure(2, "x.jpg", "ends in .png", n_entries);
}

static void test_a_recording_tells_its_verdict_its_gaps_and_its_parts(void)
{
    make_scene(&plain);
    info(scene_write_recording("gaps", &scene, 100, 5, true), "");

    const json_t *recording = json_object_get(root, "recording");
    const json_t *gap = json_array_get(json_object_get(root, "gaps"), 0);

    TEST_ASSERT_EQUAL_STRING("closed", text_at(recording, "state"));
    TEST_ASSERT_EQUAL_STRING("gaps", text_at(recording, "verdict"));
    TEST_ASSERT_NOT_NULL(strstr(text_at(recording, "reason"), "5 sensor buffers"));
    TEST_ASSERT_EQUAL_INT64(5, json_integer_value(json_object_get(gap, "lost_buffers")));
    TEST_ASSERT_INT64_WITHIN(1000, 5000000 + 100000,
                             json_integer_value(json_object_get(gap, "from_us")));
    TEST_ASSERT_EQUAL_STRING(
        "events", text_at(json_array_get(json_object_get(recording, "parts"), 0), "name"));
    TEST_ASSERT_TRUE(has_note("'gaps'"));
}

static void test_a_recording_that_was_cut_is_read_and_said_to_be_cut(void)
{
    make_scene(&plain);
    info(scene_write_recording("cut", &scene, 0, 0, false), "");
    TEST_ASSERT_EQUAL_STRING("recording", text_at(json_object_get(root, "recording"), "state"));
    TEST_ASSERT_EQUAL_INT64(scene.n_events, integer_at("n_events"));
    TEST_ASSERT_TRUE(has_note("was not closed"));
}

static void test_verify_finds_a_changed_byte_and_info_reads_what_is_left(void)
{
    char path[4096];
    char data[4200];
    uint8_t *bytes;
    size_t n_bytes;

    make_scene(&plain);
    snprintf(path, sizeof path, "%s", scene_write_recording("verified", &scene, 0, 0, true));
    info(path, "--verify");
    TEST_ASSERT_EQUAL_INT64(
        0, json_integer_value(json_object_get(
               json_object_get(json_object_get(root, "recording"), "verify"), "n_problems")));

    snprintf(data, sizeof data, "%s/events/000001.raw", path);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(data, 1 << 24, &bytes, &n_bytes, NULL));
    bytes[n_bytes / 2] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(data, bytes, n_bytes, NULL));
    free(bytes);

    const struct program_result *result = program_run("events info %s --verify", path);

    TEST_ASSERT_EQUAL_INT(1, result->status);
    TEST_ASSERT_NOT_NULL(strstr(result->err, "is not as it was recorded"));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "'events/000001.raw' does not match its SHA-256"));
    info(path, "");
    TEST_ASSERT_TRUE(integer_at("n_events") < (json_int_t)scene.n_events);
    TEST_ASSERT_TRUE(integer_at("n_events") > (json_int_t)scene.n_events - 500);
    TEST_ASSERT_TRUE(has_note("do not match their checksums"));
    TEST_ASSERT_EQUAL_size_t(1, json_array_size(json_object_get(root, "gaps")));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_counts_times_and_triggers_are_those_of_the_scene);
    RUN_TEST(test_missing_edges_are_counted);
    RUN_TEST(test_the_rates_bins_add_up_to_all_events);
    RUN_TEST(test_silence_is_a_pause_and_its_place_is_said);
    RUN_TEST(test_a_pixel_that_fires_on_its_own_is_hot_and_a_busy_edge_is_not);
    RUN_TEST(test_violations_are_counted_by_class);
    RUN_TEST(test_the_text_names_everything_a_person_looks_for);
    RUN_TEST(test_missing_edges_are_said_in_the_text);
    RUN_TEST(test_rates_are_in_a_unit_that_leaves_digits_to_read);
    RUN_TEST(test_one_event_in_a_bin_that_has_just_begun_is_no_burst);
    RUN_TEST(test_the_picture_is_a_png_and_a_bad_place_for_it_leaves_nothing);
    RUN_TEST(test_a_recording_tells_its_verdict_its_gaps_and_its_parts);
    RUN_TEST(test_a_recording_that_was_cut_is_read_and_said_to_be_cut);
    RUN_TEST(test_verify_finds_a_changed_byte_and_info_reads_what_is_left);
    return UNITY_END();
}
