/* `sheftool events render` draws the filter at the right instants. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "sheftool/events_frame.h"
#include "sheftool/events_moments.h"
#include "support/support.h"
#include "tools/event_files.h"
#include "tools/program.h"

static struct scene_events scene;
static char source[4096];

void tearDown(void)
{
    scene_events_free(&scene);
}

static const struct event_scene plain = {
    .start_us = 5000000, .duration_ms = 400, .trigger_period_us = 20000, .exposure_us = 4000
};

static void make_source(const struct event_scene *wanted)
{
    scene = scene_events_make(wanted);
    snprintf(source, sizeof source, "%s", scene_write_raw("source.raw", &scene));
}

/* Renders into a folder of that name and gives its list of pictures. */
static json_t *render(const char *name, const char *more)
{
    char path[4096];
    json_error_t at;
    const struct program_result *result =
        program_run("events render %s %s %s", source, shef_test_temp_path(name), more);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    snprintf(path, sizeof path, "%s/render.json", shef_test_temp_path(name));

    json_t *root = json_load_file(path, 0, &at);
    json_t *list = json_incref(json_object_get(root, "pictures"));

    TEST_ASSERT_NOT_NULL_MESSAGE(list, at.text);
    json_decref(root);
    return list;
}

static double number_at(const json_t *list, size_t i, const char *key)
{
    const json_t *value = json_object_get(json_array_get(list, i), key);

    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

static void test_at_a_rate_there_is_a_picture_every_period(void)
{
    json_t *list;

    make_source(&plain);
    list = render("at_rate", "--rate 50");
    /* At 20, 40 ... 380 ms; the last ones look ahead beyond the end. */
    TEST_ASSERT_EQUAL_size_t(18, json_array_size(list));
    for (size_t i = 0; i < json_array_size(list); i++) {
        char path[4200];

        TEST_ASSERT_EQUAL_DOUBLE(0.02 * (double)(i + 1), number_at(list, i, "since_first_s"));
        snprintf(path, sizeof path, "%s/%06zu.png", shef_test_temp_path("at_rate"), i);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, access(path, R_OK), path);
    }
    json_decref(list);
}

static void test_a_stretch_of_time_can_be_picked(void)
{
    json_t *list;

    make_source(&plain);
    list = render("stretch", "--rate 100 --from 0.1 --to 0.2");
    TEST_ASSERT_EQUAL_size_t(11, json_array_size(list));
    TEST_ASSERT_EQUAL_DOUBLE(0.1, number_at(list, 0, "since_first_s"));
    TEST_ASSERT_EQUAL_DOUBLE(0.2, number_at(list, 10, "since_first_s"));
    json_decref(list);
}

static void test_at_triggers_the_picture_is_at_mid_exposure(void)
{
    json_t *list;

    make_source(&plain);
    list = render("at_triggers", "--triggers");
    TEST_ASSERT_TRUE(json_array_size(list) >= 17);
    for (size_t i = 0; i < json_array_size(list); i++) {
        const double t_s = number_at(list, i, "since_first_s");

        /* Rises every 20 ms, falls 4 ms later; the first exposure is assumed to be 5 ms. */
        TEST_ASSERT_DOUBLE_WITHIN(i == 0 ? 0.0006 : 1e-6, 0.02 * (double)(i + 1) + 0.002, t_s);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 4, number_at(list, i, "exposure_ms"));
    }
    json_decref(list);
}

static void test_a_lost_trigger_is_predicted_and_flagged(void)
{
    json_t *list;
    size_t n_predicted = 0;

    scene = scene_events_make(&plain);
    /* The tenth exposure's edges are lost. */
    for (size_t i = 18; i + 2 < scene.n_triggers; i++)
        scene.triggers[i] = scene.triggers[i + 2];
    scene.n_triggers -= 2;
    snprintf(source, sizeof source, "%s", scene_write_raw("lost.raw", &scene));
    list = render("lost", "--triggers");
    for (size_t i = 0; i < json_array_size(list); i++)
        if (json_is_true(json_object_get(json_array_get(list, i), "predicted"))) {
            TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.202, number_at(list, i, "since_first_s"));
            n_predicted++;
        }
    TEST_ASSERT_EQUAL_size_t(1, n_predicted);
    json_decref(list);
}

/* Where the drawn moment has its rising and falling edges. */
struct columns {
    double rising_px;
    double falling_px;
    uint8_t still_grey; /* of a pixel that nothing has passed */
};

static enum shef_err measure_columns(void *context, const struct shef_moment *moment,
                                     struct shef_error *err)
{
    const struct shef_frame_params params = { .show = SHEF_SHOW_BOTH,
                                              .edges = SHEF_FRAME_EDGES_SIGNED,
                                              .range_c = 3,
                                              .width_px = SCENE_WIDTH_PX,
                                              .height_px = SCENE_HEIGHT_PX };
    struct columns *columns = context;
    struct shef_frame frame;
    double sums[2] = { 0 };
    double counts[2] = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_create(&frame, &params, err));
    shef_frame_draw(&frame, moment);
    TEST_ASSERT_EQUAL_INT(0, frame.picture.width_px % 2);
    TEST_ASSERT_EQUAL_INT(0, frame.picture.height_px % 2);
    for (int32_t y = frame.picture.height_px - SCENE_HEIGHT_PX; y < frame.picture.height_px; y++)
        for (int32_t x = 0; x < SCENE_WIDTH_PX; x++) {
            const struct shef_rgb8 pixel =
                shef_row_rgb8(frame.picture, y)[frame.picture.width_px - SCENE_WIDTH_PX + x];
            const int sign = pixel.blue > pixel.red ? 0 : 1;

            if (pixel.red + pixel.green + pixel.blue == 0)
                continue;
            sums[sign] += x;
            counts[sign]++;
        }
    TEST_ASSERT_TRUE(counts[0] > 20 && counts[1] > 20);
    columns->rising_px = sums[0] / counts[0];
    columns->falling_px = sums[1] / counts[1];
    columns->still_grey = shef_row_rgb8(frame.picture, 30)[SCENE_WIDTH_PX - 3].green;
    shef_frame_destroy(&frame);
    return SHEF_OK;
}

static void test_edges_are_drawn_where_the_bar_is(void)
{
    const struct shef_moments_params params = { .rate_hz = 10,
                                                .from_s = 0.03,
                                                .to_s = 0.03,
                                                .cutoff_rad_s = 600,
                                                .read = SHEF_SNAPSHOT_CENTRED,
                                                .width_px = SCENE_WIDTH_PX,
                                                .height_px = SCENE_HEIGHT_PX };
    struct shef_events_source *reader;
    struct shef_snapshot_stats stats;
    struct shef_error err = { .text = "" };
    struct columns columns = { 0 };

    make_source(&plain);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_events_source_open(source, 0, &reader, &err));
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_moments_run(reader, &params, measure_columns, &columns, &stats, &err),
        err.text);
    shef_events_source_close(reader);
    /* At 30 ms the front is at column 30, the back 12 px behind it. */
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 30, columns.rising_px);
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 18, columns.falling_px);
    TEST_ASSERT_EQUAL_UINT8(128, columns.still_grey);
}

static void test_many_instants_in_one_batch_are_all_drawn(void)
{
    json_t *list;
    /* Few events: one batch spans the whole stream. */
    const struct event_scene sparse = { .duration_ms = 2000,
                                        .silence_from_ms = 20,
                                        .silence_to_ms = 1900 };

    make_source(&sparse);
    list = render("sparse", "--rate 100 --read at-mid");
    TEST_ASSERT_EQUAL_size_t(199, json_array_size(list));
    for (size_t i = 0; i < json_array_size(list); i++)
        TEST_ASSERT_EQUAL_DOUBLE(0.01 * (double)(i + 1), number_at(list, i, "since_first_s"));
    json_decref(list);
}

static void test_a_video_is_one_file_and_mp4(void)
{
    char path[4096];
    uint8_t *bytes;
    size_t n_bytes;
    struct program_result result;

    make_source(&plain);
    snprintf(path, sizeof path, "%s", shef_test_temp_path("video.mp4"));

    const int n_entries = shef_test_temp_count();

    result = *program_run("events render %s %s --rate 50 --show image", source, path);
    if (result.status != 0 && strstr(result.err, "name a folder for a sequence of PNG files")) {
        TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
        TEST_IGNORE_MESSAGE("this OpenCV cannot write MP4; the sentence says so");
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result.status, result.err);
    TEST_ASSERT_EQUAL_INT(n_entries + 1, shef_test_temp_count());
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, NULL));
    TEST_ASSERT_TRUE(n_bytes > 1000);
    TEST_ASSERT_EQUAL_MEMORY("ftyp", bytes + 4, 4);
    free(bytes);
}

static void test_mistakes_are_refused_and_leave_nothing(void)
{
    const struct event_scene untriggered = { .duration_ms = 100 };
    int n_entries;

    make_source(&untriggered);
    n_entries = shef_test_temp_count();
    program_run("events render %s %s/out --triggers", source, shef_test_temp_folder());
    program_expect_failure(1, "no trigger on channel 0", "--channel", n_entries);
    program_run("events render %s %s/out --from 5", source, shef_test_temp_folder());
    program_expect_failure(1, "no instant to render", "--from", n_entries);
    program_run("events render %s %s/out --from 5 --to 4", source, shef_test_temp_folder());
    program_expect_failure(2, "--to 4", "--from 5", n_entries);
    program_run("events render %s %s/out --rate 1000", source, shef_test_temp_folder());
    program_expect_failure(2, "--rate 1000", "--read at-mid", n_entries);
    program_run("events render %s %s", source, shef_test_temp_path("out.mkv"));
    program_expect_failure(2, "out.mkv", "video in .mp4", n_entries);
    program_run("events render %s /nowhere/out.mp4", source);
    program_expect_failure(1, "/nowhere/out.mp4", "No such file", n_entries);
    program_run("events render %s %s", source, source);
    program_expect_failure(1, "source.raw' exists and is no folder", "another place", n_entries);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_at_a_rate_there_is_a_picture_every_period);
    RUN_TEST(test_a_stretch_of_time_can_be_picked);
    RUN_TEST(test_at_triggers_the_picture_is_at_mid_exposure);
    RUN_TEST(test_a_lost_trigger_is_predicted_and_flagged);
    RUN_TEST(test_edges_are_drawn_where_the_bar_is);
    RUN_TEST(test_many_instants_in_one_batch_are_all_drawn);
    RUN_TEST(test_a_video_is_one_file_and_mp4);
    RUN_TEST(test_mistakes_are_refused_and_leave_nothing);
    return UNITY_END();
}
