#include "core/wake.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include "support/support.h"

static struct shef_wake wake;

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_wake_init(&wake, NULL));
}

void tearDown(void)
{
    shef_wake_deinit(&wake);
}

static void test_without_a_signal_the_wait_ends_by_its_time_out(void)
{
    TEST_ASSERT_FALSE(shef_wake_wait(&wake, 0));
    TEST_ASSERT_FALSE(shef_wake_wait(&wake, 1));
}

static void test_a_signal_before_the_wait_is_not_lost(void)
{
    shef_wake_signal(&wake);
    TEST_ASSERT_TRUE(shef_wake_wait(&wake, -1));
}

static void test_many_signals_wake_once(void)
{
    for (int i = 0; i < 5; i++)
        shef_wake_signal(&wake);
    TEST_ASSERT_TRUE(shef_wake_wait(&wake, -1));
    TEST_ASSERT_FALSE(shef_wake_wait(&wake, 0));
}

static void test_others_can_poll_for_it(void)
{
    struct pollfd entry = { .fd = wake.fd, .events = POLLIN };

    TEST_ASSERT_EQUAL_INT(0, poll(&entry, 1, 0));
    shef_wake_signal(&wake);
    TEST_ASSERT_EQUAL_INT(1, poll(&entry, 1, 0));
}

static void test_closing_twice_does_nothing(void)
{
    const int fd = wake.fd;
    int pipe_fds[2];

    shef_wake_deinit(&wake);
    TEST_ASSERT_EQUAL_INT(-1, wake.fd);
    TEST_ASSERT_EQUAL_INT(0, pipe(pipe_fds)); /* takes the closed number again */
    TEST_ASSERT_EQUAL_INT(fd, pipe_fds[0]);
    shef_wake_deinit(&wake);
    TEST_ASSERT_EQUAL_INT(1, (int)write(pipe_fds[1], "x", 1));
    close(pipe_fds[0]);
    close(pipe_fds[1]);
}

#define N_ROUNDS 2000

struct players {
    struct shef_wake there;
    struct shef_wake back;
    int ball;
};

static void *return_the_ball(void *argument)
{
    struct players *players = argument;

    for (int i = 0; i < N_ROUNDS; i++) {
        if (!shef_wake_wait(&players->there, -1))
            return NULL;
        players->ball++;
        shef_wake_signal(&players->back);
    }
    return NULL;
}

static void test_two_threads_take_turns_and_see_each_others_work(void)
{
    struct players players = { .ball = 0 };
    pthread_t thread;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_wake_init(&players.there, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_wake_init(&players.back, NULL));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, return_the_ball, &players));
    for (int i = 0; i < N_ROUNDS; i++) {
        players.ball++;
        shef_wake_signal(&players.there);
        TEST_ASSERT_TRUE(shef_wake_wait(&players.back, -1));
        TEST_ASSERT_EQUAL_INT(2 * (i + 1), players.ball);
    }
    pthread_join(thread, NULL);
    shef_wake_deinit(&players.there);
    shef_wake_deinit(&players.back);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_signal_the_wait_ends_by_its_time_out);
    RUN_TEST(test_a_signal_before_the_wait_is_not_lost);
    RUN_TEST(test_many_signals_wake_once);
    RUN_TEST(test_others_can_poll_for_it);
    RUN_TEST(test_closing_twice_does_nothing);
    RUN_TEST(test_two_threads_take_turns_and_see_each_others_work);
    return UNITY_END();
}
