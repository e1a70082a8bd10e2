/* What people tell a running service, and what they may get wrong. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "calib/calibration.h"
#include "core/base64.h"
#include "core/clock.h"
#include "core/file.h"
#include "played.h"
#include "support/support.h"

static struct shef_service *start_idle(void)
{
    struct shef_config config = played_config();

    config.source.recording[0] = '\0';
    return played_start(&config);
}

static void end(struct shef_service *service)
{
    shef_service_stop(service);
    shef_service_destroy(service);
}

static const char *play_words(const char *path, const char *more)
{
    static char words[1200];

    snprintf(words, sizeof words, "{\"recording\": \"%s\"%s}", path, more);
    return words;
}

static void expect_state(struct shef_service *service, const char *state)
{
    json_t *status = played_ask(service, "status", NULL);

    TEST_ASSERT_EQUAL_STRING(state, json_string_value(json_object_get(status, "state")));
    json_decref(status);
}

/* Until so many frames have been published since the present source began. */
static void wait_for_frames(struct shef_service *service, int64_t n)
{
    int64_t n_published;

    do {
        json_t *status = played_ask(service, "status", NULL);

        n_published = played_number(status, "frames.n_published");
        json_decref(status);
        usleep(1000);
    } while (n_published < n);
}

static void test_a_recording_is_played_and_stopped_and_played_again(void)
{
    struct shef_service *service = start_idle();

    expect_state(service, "idle");
    for (int i = 0; i < 2; i++) {
        json_decref(
            played_ask(service, "play", play_words(played_recording(), ", \"pace\": \"fast\"")));
        wait_for_frames(service, PLAYED_FRAMES - 2);
        if (i == 0) {
            json_decref(played_ask(service, "stop", NULL));
            expect_state(service, "idle");
        }
    }
    /* Without a stop between them. */
    json_decref(played_ask(service, "play", play_words(played_recording(), ", \"loop\": true")));
    expect_state(service, "playing");
    end(service);
}

static void test_the_mode_changes_while_it_plays(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    int mode = -1;

    config.source.loop = true;
    service = played_start(&config);
    wait_for_frames(service, 2);
    json_decref(played_ask(service, "mode", "{\"name\": \"paper-dp\"}"));
    while (mode != SHEF_DEPTH_PAPER_DP) {
        struct shef_result *result = shef_playback_newest(service->playback);

        TEST_ASSERT_NOT_NULL(result);
        mode = result->mode;
        shef_result_give(result);
        usleep(1000);
    }
    TEST_ASSERT_EQUAL_STRING(
        "mode 'fastest' is none of paper-ds|paper-dp|unsigned|ternary|graded|temporal|combined",
        played_refusal(service, "mode", "{\"name\": \"fastest\"}"));
    end(service);
}

static void test_a_snapshot_is_a_picture_of_the_newest_frame(void)
{
    static const uint8_t png[8] = { 0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n' };
    struct shef_config config = played_config();
    struct shef_service *service = played_start(&config);
    json_t *answer;
    uint8_t *bytes;
    size_t n_bytes;

    played_wait(service);
    answer = played_ask(service, "snapshot", NULL);
    TEST_ASSERT_EQUAL_INT64(640, played_number(answer, "width_px"));
    /* f b / d of the largest disparity: 555 px * 65.44 mm / 47 px. */
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.773, json_real_value(json_object_get(answer, "red_m")));
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(PLAYED_FRAMES - 3, played_number(answer, "seq"));
    bytes = shef_base64_decode(json_string_value(json_object_get(answer, "png_base64")), &n_bytes);
    TEST_ASSERT_NOT_NULL(bytes);
    TEST_ASSERT_GREATER_THAN_size_t(10000, n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(png, bytes, sizeof png);
    free(bytes);
    json_decref(answer);
    end(service);
}

static void test_what_is_recorded_while_playing_can_be_played(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    char path[512];
    json_t *answer;

    service = played_start(&config);
    /* The recording shall not be over before the command comes. */
    atomic_store(&service->live.drag_us, 30000);
    json_decref(played_ask(service, "record start", "{\"name\": \"again\"}"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "record start", NULL), "is being recorded already"));
    wait_for_frames(service, PLAYED_FRAMES - 3);
    answer = played_ask(service, "record stop", NULL);
    TEST_ASSERT_GREATER_THAN_INT64(10000000, played_number(answer, "n_bytes"));
    snprintf(path, sizeof path, "%s", json_string_value(json_object_get(answer, "path")));
    json_decref(answer);
    TEST_ASSERT_EQUAL_STRING("record stop: nothing is being recorded",
                             played_refusal(service, "record stop", NULL));
    answer = played_ask(service, "record list", NULL);
    TEST_ASSERT_EQUAL_STRING(
        "again", json_string_value(json_object_get(
                     json_array_get(json_object_get(answer, "recordings"), 0), "name")));
    json_decref(answer);
    end(service);

    snprintf(config.source.recording, sizeof config.source.recording, "%s", path);
    service = played_start(&config);
    played_wait(service);
    played_expect_accounted(service, 0);
    wait_for_frames(service, 5);
    end(service);
}

static void test_a_missing_folder_for_recordings_is_named_with_its_setting(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    const char *text;

    snprintf(config.record.folder, sizeof config.record.folder, "/no/such/folder");
    service = played_start(&config);
    text = played_refusal(service, "record start", NULL);
    TEST_ASSERT_NOT_NULL(strstr(text, "'/no/such/folder'"));
    TEST_ASSERT_NOT_NULL(strstr(text, "record.folder"));
    text = played_refusal(service, "record list", NULL);
    TEST_ASSERT_NOT_NULL(strstr(text, "record.folder"));
    end(service);
}

static void test_threads_that_have_ended_use_no_processor(void)
{
    struct shef_config config = played_config();
    struct shef_service *service = played_start(&config);
    struct shef_window *window = &service->window;
    shef_host_time now;

    wait_for_frames(service, PLAYED_FRAMES / 2);
    now = shef_clock_now(shef_clock_monotonic());
    shef_window_start(window, service->playback, now);
    TEST_ASSERT_GREATER_THAN_INT64(0, window->from.thread_cpu_ns[0]);
    played_wait(service);
    shef_service_stop(service);
    now.ns += 2 * SHEF_NS_PER_S;
    shef_window_tick(window, service->playback, now);
    TEST_ASSERT_TRUE(window->length_s > 1.9);
    for (int i = 0; i < SHEF_WINDOW_THREADS; i++)
        TEST_ASSERT_TRUE_MESSAGE(window->thread_cpu_share[i] >= 0, shef_window_thread_name(i));
    shef_service_destroy(service);
}

static void test_mistakes_are_one_sentence_and_harm_nothing(void)
{
    struct shef_service *service = start_idle();

    TEST_ASSERT_NOT_NULL(strstr(played_refusal(service, "play", play_words("/no/such/folder", "")),
                                "/no/such/folder"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "play", play_words("walk-1", "")), "by its full path"));
    TEST_ASSERT_NOT_NULL(strstr(
        played_refusal(service, "play", play_words(played_recording(), ", \"pace\": \"slow\"")),
        "source.pace"));
    TEST_ASSERT_NOT_NULL(strstr(
        played_refusal(service, "play", play_words(played_recording(), ", \"loop\": 3")), "loop"));
    TEST_ASSERT_EQUAL_STRING("stop: nothing is playing", played_refusal(service, "stop", NULL));
    TEST_ASSERT_NOT_NULL(strstr(played_refusal(service, "snapshot", NULL), "nothing is playing"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "record start", NULL), "there is no source"));
    expect_state(service, "idle");
    json_decref(played_ask(service, "play", play_words(played_recording(), "")));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "record start", "{\"name\": \"../x\"}"), "hold a slash"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "record start", "{\"name\": \"a\\nb\"}"), "control char"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "record start", "{\"name\": \"-rf\"}"), "a dash"));
    TEST_ASSERT_NOT_NULL(strstr(played_refusal(service, "mode", "{\"name\": \"gradde\"}"),
                                "mode 'gradde' is none of"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "mode", "{\"name\": \"gradde\"}"), "is 'graded' meant?"));
    expect_state(service, "playing");
    end(service);
}

static void test_what_plays_goes_on_when_something_else_cannot_be_played(void)
{
    struct shef_service *service = start_idle();
    const struct shef_playback *before;
    const char *file = shef_test_temp_path("file");
    const char *empty = shef_test_temp_path("empty");

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(file, "x", 1, NULL));
    TEST_ASSERT_EQUAL_INT(0, mkdir(empty, 0700));
    json_decref(played_ask(service, "play", play_words(played_recording(), ", \"loop\": true")));
    before = service->playback;
    TEST_ASSERT_NOT_NULL(strstr(played_refusal(service, "play", play_words("/no/such", "")),
                                "play '/no/such': No such file or directory"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "play", play_words(file, "")), "Not a directory"));
    TEST_ASSERT_NOT_NULL(
        strstr(played_refusal(service, "play", play_words(empty, "")), "is not a recording"));
    TEST_ASSERT_EQUAL_PTR(before, service->playback);
    expect_state(service, "playing");
    end(service);
}

static void test_files_shorter_than_the_manifest_says_are_named(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    char command[4096];
    char folder[512];
    json_t *status;
    const char *warning;

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("short"));
    snprintf(command, sizeof command,
             "cp -a '%s' '%s' && cd '%s' && truncate -s 5000000 events/000000.raw && "
             "rm -r triggers truth",
             played_recording(), folder, folder);
    TEST_ASSERT_EQUAL_INT(0, system(command));
    snprintf(config.source.recording, sizeof config.source.recording, "%s", folder);
    service = played_start(&config);
    status = played_ask(service, "status", NULL);
    warning = json_string_value(json_array_get(json_object_get(status, "warnings"), 0));
    TEST_ASSERT_NOT_NULL(warning);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warning, "of events/000000.raw 5000000 of "), warning);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warning, "(3 files are too short or missing)"), warning);
    json_decref(status);
    end(service);
}

/* A copy of the recording by links, without its calibration. */
static void copy_recording(const char *to)
{
    char command[4096];

    snprintf(command, sizeof command, "cp -a '%s' '%s' && rm '%s/calibration.yaml'",
             played_recording(), to, to);
    TEST_ASSERT_EQUAL_INT(0, system(command));
}

static void expect_no_service(const struct shef_config *config, const char *words)
{
    struct shef_service *service = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_service_create(config, &service, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, words), err.text);
}

static void test_a_calibration_that_is_missing_or_of_another_size_is_named(void)
{
    struct shef_calibration calibration = shef_calibration_paper_rig();
    struct shef_config config = played_config();
    struct shef_error err = { 0 };
    char folder[512];
    char other[512];

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("uncalibrated"));
    snprintf(other, sizeof other, "%s", shef_test_temp_path("other.yaml"));
    copy_recording(folder);
    snprintf(config.source.recording, sizeof config.source.recording, "%s", folder);
    expect_no_service(&config, "it has no calibration.yaml, without which there is no depth");

    calibration.frame.width_px = 1024;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_calibration_write(other, &calibration, &err), err.text);
    snprintf(config.calibration.file, sizeof config.calibration.file, "%s", other);
    expect_no_service(&config, "it has frames of 2048 x 1536 px, but the calibration is for 1024");
}

static void test_a_recording_cut_short_is_played_and_named(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    char command[4096];
    char folder[512];
    json_t *status;

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("cut"));
    snprintf(command, sizeof command,
             "cp -a '%s' '%s' && cd '%s' && for f in frames/*.blk events/*.raw; do "
             "truncate -s $(($(stat -c %%s $f) * 6 / 10)) $f; done && "
             "sed -i 's/\"closed\"/\"recording\"/' manifest.json",
             played_recording(), folder, folder);
    TEST_ASSERT_EQUAL_INT(0, system(command));
    snprintf(config.source.recording, sizeof config.source.recording, "%s", folder);
    service = played_start(&config);
    played_wait(service);
    played_expect_accounted(service, 0);
    status = played_ask(service, "status", NULL);
    TEST_ASSERT_GREATER_THAN_INT64(0, played_number(status, "frames.n_published"));
    TEST_ASSERT_NOT_NULL(strstr(
        json_string_value(json_array_get(json_object_get(status, "warnings"), 0)), "cut short"));
    json_decref(status);
    end(service);
}

/* The row of the stereo thread's helpers; NULL: there is none. To be released with the answer. */
static const json_t *helpers_of(const json_t *graph)
{
    size_t i;
    const json_t *row;

    json_array_foreach(json_object_get(graph, "threads"), i, row)
    {
        if (strcmp(json_string_value(json_object_get(row, "name")), "workers") == 0)
            return row;
    }
    return NULL;
}

static void test_the_graph_shows_the_helpers_that_there_are(void)
{
    struct shef_config config = played_config();

    for (int32_t n_workers = 1; n_workers <= 3; n_workers++) {
        struct shef_service *service;
        json_t *graph;

        config.depth.workers = n_workers;
        config.source.loop = true;
        service = played_start(&config);
        graph = played_ask(service, "graph", NULL);
        if (n_workers == 1)
            TEST_ASSERT_NULL(helpers_of(graph));
        else
            TEST_ASSERT_TRUE(json_is_true(json_object_get(helpers_of(graph), "running")));
        json_decref(graph);
        shef_service_stop(service);
        shef_service_destroy(service);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_recording_is_played_and_stopped_and_played_again);
    RUN_TEST(test_the_mode_changes_while_it_plays);
    RUN_TEST(test_a_snapshot_is_a_picture_of_the_newest_frame);
    RUN_TEST(test_what_is_recorded_while_playing_can_be_played);
    RUN_TEST(test_a_missing_folder_for_recordings_is_named_with_its_setting);
    RUN_TEST(test_threads_that_have_ended_use_no_processor);
    RUN_TEST(test_mistakes_are_one_sentence_and_harm_nothing);
    RUN_TEST(test_what_plays_goes_on_when_something_else_cannot_be_played);
    RUN_TEST(test_files_shorter_than_the_manifest_says_are_named);
    RUN_TEST(test_a_calibration_that_is_missing_or_of_another_size_is_named);
    RUN_TEST(test_a_recording_cut_short_is_played_and_named);
    RUN_TEST(test_the_graph_shows_the_helpers_that_there_are);
    return UNITY_END();
}
