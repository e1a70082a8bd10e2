#include "shefctl/connection.h"

#include <pthread.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "support/support.h"

/* A service of one connection that says what it is told to. */
struct fake {
    int fd;
    const char *answer; /* NULL: hangs up */
    char heard[1024];
    pthread_t thread;
};

static struct fake fake;
static char path[sizeof((struct sockaddr_un *)0)->sun_path];
static struct shef_error err;
static json_t *answer;

static void *serve(void *argument)
{
    struct fake *self = argument;
    const int fd = accept(self->fd, NULL, NULL);
    ssize_t n;
    size_t n_heard = 0;

    while (!memchr(self->heard, '\n', n_heard) &&
           (n = recv(fd, self->heard + n_heard, sizeof self->heard - 1 - n_heard, 0)) > 0)
        n_heard += (size_t)n;
    /* In small pieces, as a busy system may deliver it. */
    for (const char *at = self->answer; at && *at; at++)
        (void)!send(fd, at, 1, MSG_NOSIGNAL);
    close(fd);
    return NULL;
}

static enum shef_ctl_status ask(const char *says)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    json_t *arguments = json_pack("{s:s}", "name", "x");
    enum shef_ctl_status status;

    memset(&fake, 0, sizeof fake);
    fake.answer = says;
    snprintf(path, sizeof path, "%s", shef_test_temp_path("s"));
    memcpy(address.sun_path, path, sizeof path);
    fake.fd = socket(AF_UNIX, SOCK_STREAM, 0);
    TEST_ASSERT_EQUAL_INT(0, bind(fake.fd, (const struct sockaddr *)&address, sizeof address));
    TEST_ASSERT_EQUAL_INT(0, listen(fake.fd, 1));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&fake.thread, NULL, serve, &fake));
    status = shef_ctl_ask(path, "mode", arguments, &answer, &err);
    pthread_join(fake.thread, NULL);
    close(fake.fd);
    unlink(path);
    json_decref(arguments);
    return status;
}

static void test_a_request_is_one_line_and_its_answer_comes_back(void)
{
    TEST_ASSERT_EQUAL(SHEF_CTL_OK, ask("{\"ok\":true,\"answer\":{\"mode\":\"x\"}}\n"));
    TEST_ASSERT_EQUAL_STRING("{\"command\":\"mode\",\"arguments\":{\"name\":\"x\"}}\n", fake.heard);
    TEST_ASSERT_EQUAL_STRING("x", json_string_value(json_object_get(answer, "mode")));
    json_decref(answer);
}

static void expect_status(enum shef_ctl_status status, const char *says, const char *sentence)
{
    TEST_ASSERT_EQUAL(status, ask(says));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
}

static void test_refusals_have_their_classes(void)
{
    expect_status(SHEF_CTL_REFUSED,
                  "{\"ok\":false,\"error\":{\"code\":\"permission\",\"text\":\"not you\","
                  "\"closes\":true}}\n",
                  "not you");
    TEST_ASSERT_EQUAL(SHEF_ERR_PERMISSION, err.code);
    expect_status(
        SHEF_CTL_REFUSED,
        "{\"ok\":false,\"error\":{\"code\":\"full\",\"text\":\"later\",\"closes\":true}}\n",
        "later");
    /* What was asked for failed; who asked is welcome. */
    expect_status(SHEF_CTL_FAILED,
                  "{\"ok\":false,\"error\":{\"code\":\"permission\",\"text\":\"play '/x'\","
                  "\"closes\":false}}\n",
                  "play '/x'");
    expect_status(SHEF_CTL_FAILED, "{\"ok\":false,\"error\":{\"code\":\"io\",\"text\":\"disk\"}}\n",
                  "disk");
}

static void test_another_program_at_the_socket_is_found_out(void)
{
    const char *sentence = "this is no answer of shefd; is it another program?";

    expect_status(SHEF_CTL_FAILED, "HTTP/1.1 400 Bad Request\n", sentence);
    expect_status(SHEF_CTL_FAILED, "{\"ok\":true}\n", sentence);
    expect_status(SHEF_CTL_FAILED, "[]\n", sentence);
}

static void test_a_service_that_hangs_up_is_not_reachable(void)
{
    expect_status(SHEF_CTL_UNREACHABLE, NULL, "shefd closed the connection without an answer");
    expect_status(SHEF_CTL_UNREACHABLE, "{\"ok\":tr",
                  "shefd closed the connection without an answer");
}

static void test_without_a_service_the_sentence_says_what_to_do(void)
{
    TEST_ASSERT_EQUAL(SHEF_CTL_UNREACHABLE,
                      shef_ctl_ask("/no/such/socket", "status", NULL, &answer, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "systemctl start shefd"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_request_is_one_line_and_its_answer_comes_back);
    RUN_TEST(test_refusals_have_their_classes);
    RUN_TEST(test_another_program_at_the_socket_is_found_out);
    RUN_TEST(test_a_service_that_hangs_up_is_not_reachable);
    RUN_TEST(test_without_a_service_the_sentence_says_what_to_do);
    return UNITY_END();
}
