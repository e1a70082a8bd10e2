#include "control/server.h"

#include <errno.h>
#include <grp.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "control/request.h"
#include "support/support.h"

#define MAX_CLIENTS 4
#define TIMEOUT_S   10

static struct shef_manual_clock manual;
static struct shef_loop *loop;
static struct shef_control *control;
static struct shef_error err;
static char path[sizeof((struct sockaddr_un *)0)->sun_path];
static int n_calls;

static enum shef_err echo(void *context, const json_t *arguments, json_t *answer,
                          struct shef_error *sentence)
{
    char text[64];
    const enum shef_err code = shef_control_text(arguments, "text", text, sizeof text, sentence);

    (*(int *)context)++;
    json_object_set_new(answer, "text", json_string(text));
    return code;
}

#define BIG_BYTES 4000000

static enum shef_err answer_big(void *context, const json_t *arguments, json_t *answer,
                                struct shef_error *sentence)
{
    char *text = malloc(BIG_BYTES + 1);

    (void)context;
    (void)arguments;
    (void)sentence;
    memset(text, 'x', BIG_BYTES);
    text[BIG_BYTES] = '\0';
    json_object_set_new(answer, "text", json_string(text));
    free(text);
    return SHEF_OK;
}

static const struct shef_control_command commands[] = {
    { "echo", "says what it hears", echo, "text|tone" },
    { "big", "says a lot", answer_big },
};

void setUp(void)
{
    const struct shef_control_params params = {
        .path = path,
        .group = "",
        .max_clients = MAX_CLIENTS,
        .timeout_s = TIMEOUT_S,
        .clock = &manual.clock,
    };
    struct shef_control_params used = params;

    n_calls = 0;
    snprintf(path, sizeof path, "%s", shef_test_temp_path("s"));
    shef_manual_clock_init(&manual, (shef_host_time){ SHEF_NS_PER_S });
    TEST_ASSERT_EQUAL(SHEF_OK, shef_loop_create(&loop, &err));
    used.loop = loop;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_control_create(&used, &control, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_register(control, commands, 2, &n_calls, &err));
}

void tearDown(void)
{
    shef_control_destroy(control);
    shef_loop_destroy(loop);
    control = NULL;
    loop = NULL;
}

/* Lets the server do all there is to do. */
static void turn(void)
{
    for (int i = 0; i < 50; i++)
        shef_loop_step(loop, 0);
}

static int connect_now(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);

    memcpy(address.sun_path, path, strlen(path) + 1);
    TEST_ASSERT_EQUAL_INT(0, connect(fd, (const struct sockaddr *)&address, sizeof address));
    turn();
    return fd;
}

static void say(int fd, const char *text)
{
    TEST_ASSERT_EQUAL_INT((int)strlen(text), (int)send(fd, text, strlen(text), MSG_NOSIGNAL));
    turn();
}

static const char *heard(int fd)
{
    static char text[65536];
    const ssize_t n = recv(fd, text, sizeof text - 1, MSG_DONTWAIT);

    text[n > 0 ? n : 0] = '\0';
    return text;
}

static bool is_dropped(int fd)
{
    char byte;
    const ssize_t n = recv(fd, &byte, 1, MSG_DONTWAIT | MSG_PEEK);

    return n == 0 || (n < 0 && errno == ECONNRESET);
}

#define ECHO(text_)   "{\"command\":\"echo\",\"arguments\":{\"text\":\"" text_ "\"}}\n"
#define ANSWER(text_) "{\"ok\":true,\"answer\":{\"text\":\"" text_ "\"}}\n"

static void test_a_request_is_answered_and_the_connection_stays(void)
{
    const int fd = connect_now();

    say(fd, ECHO("one"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("one"), heard(fd));
    say(fd, ECHO("two"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("two"), heard(fd));
    TEST_ASSERT_EQUAL_INT(2, n_calls);
    TEST_ASSERT_EQUAL_INT(1, shef_control_client_count(control));
    close(fd);
    turn();
    TEST_ASSERT_EQUAL_INT(0, shef_control_client_count(control));
}

static void test_a_request_may_come_in_pieces_and_several_at_once(void)
{
    const int fd = connect_now();

    say(fd, "{\"command\":\"echo\",");
    TEST_ASSERT_EQUAL_STRING("", heard(fd));
    say(fd, "\"arguments\":{\"text\":\"a\"}}\n" ECHO("b") ECHO("c"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("a") ANSWER("b") ANSWER("c"), heard(fd));
    close(fd);
}

static void test_a_handlers_sentence_reaches_the_client(void)
{
    const int fd = connect_now();

    say(fd, "{\"command\":\"echo\"}\n");
    TEST_ASSERT_EQUAL_STRING("{\"ok\":false,\"error\":{\"code\":\"invalid\",\"text\":\"the "
                             "argument 'text' is missing\",\"closes\":false}}\n",
                             heard(fd));
    TEST_ASSERT_FALSE(is_dropped(fd));
    close(fd);
}

static void test_an_unknown_command_is_refused_and_help_lists_the_known(void)
{
    const int fd = connect_now();

    say(fd, "{\"command\":\"dance\"}\n");
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "there is no command 'dance'"));
    say(fd, "{\"command\":\"help\"}\n");
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "{\"name\":\"echo\",\"help\":\"says what it hears\"}"));
    close(fd);
}

static void test_an_argument_that_the_command_does_not_know_is_refused(void)
{
    const int fd = connect_now();

    say(fd, "{\"command\":\"echo\",\"arguments\":{\"text\":\"a\",\"txet\":\"b\"}}\n");
    TEST_ASSERT_NOT_NULL(
        strstr(heard(fd), "echo: there is no argument 'txet'; it takes text|tone"));
    say(fd, "{\"command\":\"big\",\"arguments\":{\"x\":1}}\n");
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "big: there is no argument 'x'; it takes none"));
    TEST_ASSERT_EQUAL_INT(0, n_calls);
    TEST_ASSERT_FALSE(is_dropped(fd));
    close(fd);
}

static void test_a_request_without_its_newline_is_named_when_nothing_follows(void)
{
    const int fd = connect_now();

    say(fd, "{\"command\":\"echo\"}");
    TEST_ASSERT_EQUAL_STRING("", heard(fd));
    TEST_ASSERT_EQUAL_INT(0, shutdown(fd, SHUT_WR));
    turn();
    TEST_ASSERT_NOT_NULL(
        strstr(heard(fd), "the request has no end: 18 bytes came, but no newline behind them"));
    TEST_ASSERT_TRUE(is_dropped(fd));
    TEST_ASSERT_EQUAL_INT(0, n_calls);
    TEST_ASSERT_EQUAL_INT(0, shef_control_client_count(control));
    close(fd);
}

static void test_garbage_is_refused_and_the_sender_dropped(void)
{
    const int fd = connect_now();
    const int other = connect_now();

    say(fd, "GET / HTTP/1.1\r\n\r\n");
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "the request is no JSON"));
    TEST_ASSERT_TRUE(is_dropped(fd));
    say(other, ECHO("still here"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("still here"), heard(other));
    close(fd);
    close(other);
}

static void test_random_bytes_harm_nobody(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 50; round++) {
        const int fd = connect_now();
        char bytes[512];

        for (size_t i = 0; i < sizeof bytes; i++)
            bytes[i] = (char)shef_test_random_range(&random, 0, 255);
        (void)!send(fd, bytes, sizeof bytes, MSG_NOSIGNAL);
        turn();
        close(fd);
        turn();
    }
    TEST_ASSERT_EQUAL_INT(0, shef_control_client_count(control));
    TEST_ASSERT_EQUAL_INT(0, n_calls);

    const int fd = connect_now();

    say(fd, ECHO("fine"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("fine"), heard(fd));
    close(fd);
}

static void test_a_request_without_end_is_refused_at_the_limit(void)
{
    const int fd = connect_now();
    char bytes[SHEF_CONTROL_REQUEST_BYTES];

    memset(bytes, ' ', sizeof bytes);
    TEST_ASSERT_EQUAL_INT(sizeof bytes, send(fd, bytes, sizeof bytes, MSG_NOSIGNAL));
    turn();
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "the request is longer than 16384 bytes"));
    TEST_ASSERT_TRUE(is_dropped(fd));
    close(fd);
}

static void test_who_asks_too_often_is_dropped_and_the_others_are_served(void)
{
    const int fd = connect_now();
    const int other = connect_now();

    for (int i = 0; i < SHEF_CONTROL_REQUESTS_PER_S; i++) {
        say(fd, ECHO("again"));
        TEST_ASSERT_EQUAL_STRING(ANSWER("again"), heard(fd));
    }
    say(fd, ECHO("again"));
    TEST_ASSERT_NOT_NULL(strstr(heard(fd), "more than 100 requests in a second"));
    TEST_ASSERT_TRUE(is_dropped(fd));
    say(other, ECHO("calm"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("calm"), heard(other));
    close(fd);
    close(other);
}

static void test_the_same_number_of_requests_over_time_is_fine(void)
{
    const int fd = connect_now();

    for (int i = 0; i < 2 * SHEF_CONTROL_REQUESTS_PER_S; i++) {
        shef_manual_clock_advance(&manual, SHEF_NS_PER_S / 50);
        say(fd, ECHO("again"));
        TEST_ASSERT_EQUAL_STRING(ANSWER("again"), heard(fd));
    }
    close(fd);
}

static void test_one_client_too_many_is_told_so(void)
{
    int fds[MAX_CLIENTS];
    int late;

    for (int i = 0; i < MAX_CLIENTS; i++)
        fds[i] = connect_now();
    late = connect_now();
    TEST_ASSERT_NOT_NULL(strstr(heard(late), "the limit of 4 connections is reached"));
    TEST_ASSERT_TRUE(is_dropped(late));
    close(late);
    for (int i = 0; i < MAX_CLIENTS; i++)
        close(fds[i]);
    turn();
    late = connect_now();
    say(late, ECHO("room"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("room"), heard(late));
    close(late);
}

static void test_a_silent_client_is_dropped_after_the_time_out(void)
{
    const int silent = connect_now();
    const int busy = connect_now();

    say(silent, "{\"comm");
    shef_manual_clock_advance(&manual, TIMEOUT_S * SHEF_NS_PER_S);
    say(busy, ECHO("x"));
    shef_control_expire(control);
    TEST_ASSERT_EQUAL_INT(2, shef_control_client_count(control));
    shef_manual_clock_advance(&manual, 1);
    shef_control_expire(control);
    TEST_ASSERT_EQUAL_INT(1, shef_control_client_count(control));
    TEST_ASSERT_TRUE(is_dropped(silent));
    close(silent);
    close(busy);
}

static void test_a_client_that_sends_a_byte_now_and_then_is_dropped_too(void)
{
    const int fd = connect_now();

    for (int i = 0; i <= TIMEOUT_S; i++) {
        TEST_ASSERT_EQUAL_INT(1, shef_control_client_count(control));
        say(fd, " ");
        shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
        shef_control_expire(control);
    }
    TEST_ASSERT_EQUAL_INT(0, shef_control_client_count(control));
    TEST_ASSERT_TRUE(is_dropped(fd));
    close(fd);
}

static void test_a_client_that_does_not_read_holds_up_nobody_and_is_dropped(void)
{
    const int slow = connect_now();
    const int other = connect_now();

    say(slow, "{\"command\":\"big\"}\n{\"command\":\"big\"}\n");
    say(other, ECHO("quick"));
    TEST_ASSERT_EQUAL_STRING(ANSWER("quick"), heard(other));
    shef_manual_clock_advance(&manual, (TIMEOUT_S + 1) * SHEF_NS_PER_S);
    say(other, ECHO("quick"));
    shef_control_expire(control);
    TEST_ASSERT_EQUAL_INT(1, shef_control_client_count(control));
    close(slow);
    close(other);
}

static void *read_big(void *argument)
{
    const int fd = *(int *)argument;
    size_t n_all = 0;
    char bytes[65536];
    ssize_t n;

    while ((n = recv(fd, bytes, sizeof bytes, 0)) > 0 && bytes[n - 1] != '\n')
        n_all += (size_t)n;
    n_all += n > 0 ? (size_t)n : 0;
    shef_loop_quit(loop);
    return (void *)n_all;
}

static void test_a_long_answer_arrives_whole(void)
{
    int fd = connect_now();
    pthread_t reader;
    void *n_read;

    TEST_ASSERT_EQUAL_INT(0, pthread_create(&reader, NULL, read_big, &fd));
    TEST_ASSERT_EQUAL_INT(18, (int)send(fd, "{\"command\":\"big\"}\n", 18, MSG_NOSIGNAL));
    shef_loop_run(loop);
    pthread_join(reader, &n_read);
    TEST_ASSERT_EQUAL_size_t(BIG_BYTES + strlen(ANSWER("")), (size_t)n_read);
    close(fd);
}

/* In a child, as a user who may reach the file but is not allowed to command. */
static int try_as_stranger(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    char text[512] = "";

    memcpy(address.sun_path, path, strlen(path) + 1);
    if (setgroups(0, NULL) != 0 || setgid(65534) != 0 || setuid(65534) != 0)
        return 2;
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) != 0)
        return 3;
    if (send(fd, ECHO("hi"), strlen(ECHO("hi")), MSG_NOSIGNAL) < 0 && errno != EPIPE)
        return 4;
    (void)!recv(fd, text, sizeof text - 1, 0);
    return strstr(text, "\"permission\"") && strstr(text, "user 65534 may not") ? 0 : 5;
}

static void test_a_foreign_user_is_refused_even_where_the_file_is_open_to_all(void)
{
    int status;
    pid_t pid;

    if (geteuid() != 0)
        TEST_IGNORE_MESSAGE("only root can try to be somebody else");
    TEST_ASSERT_EQUAL_INT(0, chmod(path, 0666));
    TEST_ASSERT_EQUAL_INT(0, chmod(shef_test_temp_folder(), 0755));
    pid = fork();
    if (pid == 0)
        _exit(try_as_stranger());
    while (waitpid(pid, &status, WNOHANG) == 0)
        shef_loop_step(loop, 10);
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
    TEST_ASSERT_EQUAL_INT(0, n_calls);
    TEST_ASSERT_EQUAL_INT(0, shef_control_client_count(control));
}

static void test_a_command_can_be_registered_once(void)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_control_register(control, commands, 1, &n_calls, &err));
    TEST_ASSERT_EQUAL_STRING("control: there are two commands 'echo'", err.text);
}

static void test_clients_that_are_connected_at_the_end_are_dropped(void)
{
    const int fd = connect_now();

    shef_control_destroy(control);
    control = NULL;
    TEST_ASSERT_TRUE(is_dropped(fd));
    TEST_ASSERT_EQUAL_INT(0, shef_test_temp_count());
    close(fd);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_request_is_answered_and_the_connection_stays);
    RUN_TEST(test_a_request_may_come_in_pieces_and_several_at_once);
    RUN_TEST(test_a_handlers_sentence_reaches_the_client);
    RUN_TEST(test_an_unknown_command_is_refused_and_help_lists_the_known);
    RUN_TEST(test_an_argument_that_the_command_does_not_know_is_refused);
    RUN_TEST(test_a_request_without_its_newline_is_named_when_nothing_follows);
    RUN_TEST(test_garbage_is_refused_and_the_sender_dropped);
    RUN_TEST(test_random_bytes_harm_nobody);
    RUN_TEST(test_a_request_without_end_is_refused_at_the_limit);
    RUN_TEST(test_who_asks_too_often_is_dropped_and_the_others_are_served);
    RUN_TEST(test_the_same_number_of_requests_over_time_is_fine);
    RUN_TEST(test_one_client_too_many_is_told_so);
    RUN_TEST(test_a_silent_client_is_dropped_after_the_time_out);
    RUN_TEST(test_a_client_that_sends_a_byte_now_and_then_is_dropped_too);
    RUN_TEST(test_a_client_that_does_not_read_holds_up_nobody_and_is_dropped);
    RUN_TEST(test_a_long_answer_arrives_whole);
    RUN_TEST(test_a_foreign_user_is_refused_even_where_the_file_is_open_to_all);
    RUN_TEST(test_a_command_can_be_registered_once);
    RUN_TEST(test_clients_that_are_connected_at_the_end_are_dropped);
    return UNITY_END();
}
