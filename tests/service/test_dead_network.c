/* A service whose messages go nowhere: everything else goes on, and publishing when it can. In a
 * network of this program's own. Stepped, so that no other frame may get lost. */
#include <arpa/inet.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <lcm/lcm.h>

#include "played.h"
#include "support/namespaces.h"
#include "support/support.h"

#define ADDRESS "239.255.76.67"
#define PORT    7667
#define URL     "udpm://" ADDRESS ":7667?ttl=0"

static bool has_namespace;

void setUp(void)
{
    if (!has_namespace)
        TEST_IGNORE_MESSAGE("this user may not make a network namespace");
    shef_test_set_loopback(false);
}

static void make_network(void)
{
    shef_test_set_loopback(true);
    shef_test_add_route(ADDRESS);
}

static struct shef_service *start(void)
{
    struct shef_config config = played_config();

    snprintf(config.lcm.url, sizeof config.lcm.url, "%s", URL);
    config.source.loop = true;
    return played_start(&config);
}

static int64_t now(struct shef_service *service, const char *path)
{
    json_t *status = played_ask(service, "status", NULL);
    const int64_t number = played_number(status, path);

    json_decref(status);
    return number;
}

/* Until so many more are counted. */
static void wait_for(struct shef_service *service, const char *path, int64_t n_more)
{
    const int64_t enough = now(service, path) + n_more;

    while (now(service, path) < enough)
        usleep(2000);
}

/* But for those that were not sent, no frame got lost. */
static void expect_nothing_else_lost(struct shef_service *service)
{
    json_t *status = played_ask(service, "status", NULL);

    TEST_ASSERT_EQUAL_INT64(played_number(status, "frames.lost_by.not_sent") +
                                played_number(status, "frames.lost_by.stopped"),
                            played_number(status, "frames.n_lost"));
    TEST_ASSERT_EQUAL_INT64(0, played_number(status, "events.n_lost_buffers"));
    TEST_ASSERT_EQUAL_INT64(0, played_number(status, "triggers.n_snapshots_lost"));
    json_decref(status);
}

static bool warns_of(struct shef_service *service, const char *words)
{
    json_t *status = played_ask(service, "status", NULL);
    char *text = json_dumps(json_object_get(status, "warnings"), JSON_COMPACT);
    const bool is_there = strstr(text, words) != NULL;

    free(text);
    json_decref(status);
    return is_there;
}

static void end(struct shef_service *service)
{
    shef_service_stop(service);
    played_expect_accounted(service, 0);
    expect_nothing_else_lost(service);
    shef_service_destroy(service);
}

static void test_started_without_a_network_it_works_records_and_publishes_once_there_is_one(void)
{
    struct shef_service *service = start();
    json_t *answer;

    json_decref(played_ask(service, "record start", "{\"name\": \"meanwhile\"}"));
    wait_for(service, "frames.lost_by.not_sent", PLAYED_FRAMES);
    TEST_ASSERT_EQUAL_INT64(0, now(service, "frames.n_published"));
    TEST_ASSERT_TRUE(warns_of(service, "not connected"));
    json_decref(played_ask(service, "snapshot", NULL));
    answer = played_ask(service, "record stop", NULL);
    /* Whether the disk keeps up with stepped playback is another matter. */
    TEST_ASSERT_NOT_EQUAL(0,
                          strcmp("unknown", json_string_value(json_object_get(answer, "verdict"))));
    TEST_ASSERT_GREATER_THAN_INT64(1000000, played_number(answer, "n_bytes"));
    json_decref(answer);

    make_network();
    wait_for(service, "frames.n_published", PLAYED_FRAMES);
    TEST_ASSERT_FALSE(warns_of(service, "LCM"));
    end(service);
}

static void test_a_network_that_goes_and_returns_costs_the_messages_in_between_and_no_more(void)
{
    struct shef_service *service;

    make_network();
    service = start();
    for (int i = 0; i < 3; i++) {
        int64_t n_published;

        wait_for(service, "frames.n_published", 10);
        shef_test_set_loopback(false);
        wait_for(service, "frames.lost_by.not_sent", 1);
        n_published = now(service, "frames.n_published");
        wait_for(service, "frames.lost_by.not_sent", PLAYED_FRAMES);
        TEST_ASSERT_EQUAL_INT64(n_published, now(service, "frames.n_published"));
        TEST_ASSERT_TRUE(warns_of(service, "not sent"));
        make_network();
    }
    wait_for(service, "frames.n_published", PLAYED_FRAMES);
    TEST_ASSERT_FALSE(warns_of(service, "LCM"));
    end(service);
}

/* Joined to the group, with hardly a buffer; nobody ever reads from it. */
static int listen_without_reading(void)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int on = 1, n_bytes = 4096;
    const struct sockaddr_in any = { .sin_family = AF_INET, .sin_port = htons(PORT) };
    struct ip_mreq group = { .imr_interface.s_addr = htonl(INADDR_LOOPBACK) };

    TEST_ASSERT_EQUAL_INT(1, inet_pton(AF_INET, ADDRESS, &group.imr_multiaddr));
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on));
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on));
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &n_bytes, sizeof n_bytes));
    TEST_ASSERT_EQUAL_INT(0, bind(fd, (const struct sockaddr *)&any, sizeof any));
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group));
    return fd;
}

static void count_message(const lcm_recv_buf_t *message, const char *channel, void *context)
{
    (void)message;
    TEST_ASSERT_EQUAL_STRING("SHEF_DEPTH", channel);
    (*(int *)context)++;
}

static void test_a_subscriber_that_does_not_read_harms_neither_the_service_nor_other_readers(void)
{
    struct shef_service *service;
    int fds[8], n_read = 0;
    lcm_t *reader;

    make_network();
    for (int i = 0; i < 8; i++)
        fds[i] = listen_without_reading();
    reader = lcm_create(URL);
    TEST_ASSERT_NOT_NULL(reader);
    (void)lcm_subscribe(reader, "SHEF_DEPTH", count_message, &n_read);
    service = start();
    while (n_read < 2 * PLAYED_FRAMES)
        (void)lcm_handle_timeout(reader, 100);
    lcm_destroy(reader);
    wait_for(service, "frames.n_published", 2 * PLAYED_FRAMES);
    TEST_ASSERT_EQUAL_INT64(0, now(service, "frames.lost_by.not_sent"));
    for (int i = 0; i < 8; i++) {
        uint8_t byte;

        /* It had its share, until its buffer was full. */
        TEST_ASSERT_EQUAL_INT64(1, recv(fds[i], &byte, 1, MSG_DONTWAIT | MSG_PEEK));
        close(fds[i]);
    }
    end(service);
}

int main(void)
{
    has_namespace = shef_test_enter_namespaces(CLONE_NEWNET);
    UNITY_BEGIN();
    RUN_TEST(test_started_without_a_network_it_works_records_and_publishes_once_there_is_one);
    RUN_TEST(test_a_network_that_goes_and_returns_costs_the_messages_in_between_and_no_more);
    RUN_TEST(test_a_subscriber_that_does_not_read_harms_neither_the_service_nor_other_readers);
    return UNITY_END();
}
