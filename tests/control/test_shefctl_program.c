/* The real shefctl against a server that says what the test wants. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "control/server.h"
#include "core/base64.h"
#include "core/file.h"
#include "support/process.h"
#include "support/support.h"

static struct shef_loop *loop;
static struct shef_control *control;
static struct shef_test_process ctl;
static pthread_t thread;
static char socket_path[100];
static char last_arguments[1024]; /* as JSON, of the last request */

static const uint8_t picture[] = { 0x89, 'P', 'N', 'G', 0, 1, 2, 3, 250 };

static void keep_arguments(const json_t *arguments)
{
    char *text = json_dumps(arguments, JSON_COMPACT);

    snprintf(last_arguments, sizeof last_arguments, "%s", text);
    free(text);
}

static enum shef_err answer_snapshot(void *context, const json_t *arguments, json_t *answer,
                                     struct shef_error *err)
{
    char *text = shef_base64_encode(picture, sizeof picture);

    (void)context;
    (void)arguments;
    (void)err;
    json_object_set_new(answer, "png_base64", json_string(text));
    json_object_set_new(answer, "seq", json_integer(77));
    free(text);
    return SHEF_OK;
}

static enum shef_err answer_broken_snapshot(void *context, const json_t *arguments, json_t *answer,
                                            struct shef_error *err)
{
    (void)context;
    (void)arguments;
    (void)err;
    json_object_set_new(answer, "png_base64", json_string("no base64"));
    return SHEF_OK;
}

static enum shef_err answer_top(void *context, const json_t *arguments, json_t *answer,
                                struct shef_error *err)
{
    (void)context;
    (void)arguments;
    (void)err;
    json_object_set_new(answer, "stages",
                        json_pack("[{s:s, s:f}]", "name", "stereo", "p99_ms", 7.125));
    return SHEF_OK;
}

static enum shef_err take_play(void *context, const json_t *arguments, json_t *answer,
                               struct shef_error *err)
{
    (void)context;
    (void)answer;
    (void)err;
    keep_arguments(arguments);
    return SHEF_OK;
}

static enum shef_err decline_mode(void *context, const json_t *arguments, json_t *answer,
                                  struct shef_error *err)
{
    (void)context;
    (void)answer;
    keep_arguments(arguments);
    return shef_fail(err, SHEF_ERR_INVALID, "there is no mode 'magic'");
}

static const struct shef_control_command commands[] = {
    { "snapshot", "", answer_snapshot },
    { "top", "", answer_top },
    { "play", "", take_play, "recording|loop|pace" },
    { "mode", "", decline_mode, "name" },
};

static const struct shef_control_command broken_commands[] = {
    { "snapshot", "", answer_broken_snapshot },
};

static void *serve(void *argument)
{
    (void)argument;
    shef_loop_run(loop);
    return NULL;
}

static void start(const struct shef_control_command *table, int n_commands)
{
    struct shef_control_params params = { .path = socket_path,
                                          .group = "",
                                          .max_clients = 1,
                                          .timeout_s = 60,
                                          .clock = shef_clock_monotonic() };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_loop_create(&loop, NULL));
    params.loop = loop;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_create(&params, &control, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_register(control, table, n_commands, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, serve, NULL));
}

static void start_usual(void)
{
    start(commands, sizeof commands / sizeof commands[0]);
}

void setUp(void)
{
    snprintf(socket_path, sizeof socket_path, "%s", shef_test_temp_path("s"));
    last_arguments[0] = '\0';
}

void tearDown(void)
{
    shef_loop_quit(loop);
    pthread_join(thread, NULL);
    shef_control_destroy(control);
    shef_loop_destroy(loop);
}

static void run(const char *words)
{
    shef_test_process_run(&ctl, "shefctl", NULL, "--socket %s %s", socket_path, words);
}

static void test_a_snapshot_becomes_a_file(void)
{
    char words[512];
    char expected[512];
    uint8_t *bytes;
    size_t n_bytes;

    start_usual();
    snprintf(words, sizeof words, "snapshot %s", shef_test_temp_path("now.png"));
    run(words);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, ctl.status, ctl.err);
    snprintf(expected, sizeof expected, "seq   77\nfile  %s\n", shef_test_temp_path("now.png"));
    TEST_ASSERT_EQUAL_STRING(expected, ctl.out);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_read(shef_test_temp_path("now.png"), 1000, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_size_t(sizeof picture, n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(picture, bytes, sizeof picture);
    free(bytes);
    unlink(shef_test_temp_path("now.png"));
}

static void expect_failure(int status, const char *words)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, ctl.status, ctl.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(ctl.err, words), ctl.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&ctl), ctl.err);
    TEST_ASSERT_EQUAL_STRING("", ctl.out);
}

static void test_a_snapshot_that_cannot_be_written_is_one_sentence(void)
{
    start_usual();
    run("snapshot /no/such/folder/now.png");
    expect_failure(4, "/no/such/folder/now.png");
}

static void test_a_broken_picture_leaves_no_file(void)
{
    char words[512];

    start(broken_commands, 1);
    snprintf(words, sizeof words, "snapshot %s", shef_test_temp_path("now.png"));
    run(words);
    expect_failure(4, "holds no picture");
    TEST_ASSERT_EQUAL_INT(2, shef_test_temp_count()); /* socket and lock */
}

static void test_top_looks_as_often_as_it_is_told_to(void)
{
    const char *first;

    start_usual();
    run("top --count 2 --interval 0.1");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, ctl.status, ctl.err);
    first = strstr(ctl.out, "stages:  stereo 7.12 ms\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(first, ctl.out);
    first = strstr(first + 1, "stages:  stereo 7.12 ms\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(first, ctl.out);
    TEST_ASSERT_NULL(strstr(first + strlen("stages:  stereo"), "stereo"));
    TEST_ASSERT_NULL_MESSAGE(strchr(ctl.out, '\033'), "commands for a terminal in a file");
}

static void test_errors_are_json_as_well_where_that_was_wanted(void)
{
    json_t *root;
    const json_t *error;

    start_usual();
    run("--json mode magic");
    TEST_ASSERT_EQUAL_INT(4, ctl.status);
    TEST_ASSERT_EQUAL_STRING("shefctl: there is no mode 'magic'\n", ctl.err);
    root = json_loads(ctl.out, 0, NULL);
    error = json_object_get(root, "error");
    TEST_ASSERT_EQUAL_STRING("invalid", json_string_value(json_object_get(error, "code")));
    TEST_ASSERT_EQUAL_STRING("there is no mode 'magic'",
                             json_string_value(json_object_get(error, "text")));
    json_decref(root);
    run("--json dance");
    TEST_ASSERT_EQUAL_INT(1, ctl.status);
    root = json_loads(ctl.out, 0, NULL);
    TEST_ASSERT_TRUE(json_is_object(json_object_get(root, "error")));
    json_decref(root);
}

static void test_top_ends_when_nobody_can_read_it(void)
{
    const struct shef_test_process_manner full = { .out_path = "/dev/full" };

    start_usual();
    shef_test_process_run(&ctl, "shefctl", &full, "--socket %s top --interval 3600", socket_path);
    expect_failure(4, "cannot be written to standard output");
}

static void test_json_is_json(void)
{
    json_t *root;

    start_usual();
    run("top --json --count 1");
    root = json_loads(ctl.out, 0, NULL);
    TEST_ASSERT_TRUE(json_is_array(json_object_get(root, "stages")));
    json_decref(root);
}

static void test_play_sends_a_full_path(void)
{
    start_usual();
    run("play /tmp/../tmp --loop");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, ctl.status, ctl.err);
    TEST_ASSERT_EQUAL_STRING("done\n", ctl.out);
    TEST_ASSERT_EQUAL_STRING("{\"recording\":\"/tmp\",\"loop\":true}", last_arguments);
}

static void test_what_the_service_declines_is_said_in_its_words(void)
{
    start_usual();
    run("mode magic");
    expect_failure(4, "shefctl: there is no mode 'magic'");
    TEST_ASSERT_EQUAL_STRING("{\"name\":\"magic\"}", last_arguments);
    run("status");
    expect_failure(4, "there is no command 'status'");
}

static void test_who_comes_too_many_is_refused(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    char text[256];

    start_usual();
    memcpy(address.sun_path, socket_path, sizeof socket_path);
    TEST_ASSERT_EQUAL_INT(0, connect(fd, (const struct sockaddr *)&address, sizeof address));
    /* Answered, so the server has counted this client. */
    TEST_ASSERT_EQUAL_INT(19, (int)send(fd, "{\"command\":\"help\"}\n", 19, 0));
    TEST_ASSERT_GREATER_THAN_INT(0, (int)recv(fd, text, sizeof text, 0));
    run("top --count 1");
    expect_failure(3, "the limit of 1");
    close(fd);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_snapshot_becomes_a_file);
    RUN_TEST(test_a_snapshot_that_cannot_be_written_is_one_sentence);
    RUN_TEST(test_a_broken_picture_leaves_no_file);
    RUN_TEST(test_top_looks_as_often_as_it_is_told_to);
    RUN_TEST(test_json_is_json);
    RUN_TEST(test_errors_are_json_as_well_where_that_was_wanted);
    RUN_TEST(test_top_ends_when_nobody_can_read_it);
    RUN_TEST(test_play_sends_a_full_path);
    RUN_TEST(test_what_the_service_declines_is_said_in_its_words);
    RUN_TEST(test_who_comes_too_many_is_refused);
    return UNITY_END();
}
