#include "service/thread.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/time.h"
#include "support/support.h"

static struct shef_thread thread;
static struct shef_error err;

struct seen {
    char name[16];
    int policy;
    int priority;
    int cpu;
    size_t stack_bytes;
    bool usr1_blocked;
    _Atomic bool may_end;
};

static struct seen seen;

static void look_around(void *context)
{
    struct seen *found = context;
    struct sched_param param;
    pthread_attr_t attributes;
    void *stack;
    sigset_t mask;

    pthread_getschedparam(pthread_self(), &found->policy, &param);
    found->priority = param.sched_priority;
    found->cpu = sched_getcpu();
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstack(&attributes, &stack, &found->stack_bytes);
    pthread_attr_destroy(&attributes);
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    found->usr1_blocked = sigismember(&mask, SIGUSR1) == 1;
}

static void run(const struct shef_thread_params *params)
{
    memset(&seen, 0, sizeof seen);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_thread_start(&thread, params, look_around, &seen, &err),
                              err.text);
    shef_thread_join(&thread);
}

/* The thread sanitizer enlarges every stack for its own needs. */
static void expect_stack(size_t n_bytes)
{
#ifdef __SANITIZE_THREAD__
    TEST_ASSERT_GREATER_OR_EQUAL_size_t(n_bytes, seen.stack_bytes);
#else
    TEST_ASSERT_EQUAL_size_t(n_bytes, seen.stack_bytes);
#endif
}

static void test_a_thread_has_the_stack_it_was_given_and_blocks_signals(void)
{
    run(&(struct shef_thread_params){ .name = "small", .cpu = -1, .stack_bytes = 128 * 1024 });
    expect_stack(128 * 1024);
    TEST_ASSERT_TRUE(seen.usr1_blocked);
    TEST_ASSERT_EQUAL_INT(SCHED_OTHER, seen.policy);
    TEST_ASSERT_FALSE(thread.real_time_given);
}

static void test_without_a_wish_the_stack_is_the_usual_one(void)
{
    run(&(struct shef_thread_params){ .name = "usual", .cpu = -1 });
    expect_stack(SHEF_THREAD_STACK_BYTES);
}

static void test_the_starter_keeps_its_own_signal_mask(void)
{
    sigset_t mask;

    run(&(struct shef_thread_params){ .name = "masked", .cpu = -1 });
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    TEST_ASSERT_EQUAL_INT(0, sigismember(&mask, SIGUSR1));
}

static void wait_to_end(void *context)
{
    struct seen *found = context;

    while (!atomic_load(&found->may_end))
        sched_yield();
}

static void test_a_running_thread_has_its_name_a_number_and_uses_time(void)
{
    const struct shef_thread_params params = { .name = "shef-stereo", .cpu = -1 };
    char name[16];
    int64_t used = 0;

    atomic_store(&seen.may_end, false);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_thread_start(&thread, &params, wait_to_end, &seen, &err));
    TEST_ASSERT_EQUAL_INT(0, pthread_getname_np(thread.handle, name, sizeof name));
    TEST_ASSERT_EQUAL_STRING("shef-stereo", name);
    TEST_ASSERT_GREATER_THAN_INT32(0, thread.tid);
    TEST_ASSERT_NOT_EQUAL(getpid(), thread.tid);
    while (used < SHEF_NS_PER_MS)
        used = shef_thread_cpu_ns(&thread);
    atomic_store(&seen.may_end, true);
    shef_thread_join(&thread);
    TEST_ASSERT_EQUAL_INT64(-1, shef_thread_cpu_ns(&thread));
}

static void test_a_thread_stays_on_its_processor(void)
{
    const struct shef_thread_params params = { .name = "pinned", .cpu = sched_getcpu() };

    run(&params);
    TEST_ASSERT_EQUAL_INT(params.cpu, seen.cpu);
}

static void test_a_processor_that_is_not_there_is_one_sentence(void)
{
    const struct shef_thread_params params = { .name = "lost", .cpu = 1000 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_thread_start(&thread, &params, look_around, &seen, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "no processor 1000"), err.text);
    TEST_ASSERT_FALSE(thread.is_running);
}

/* In a child process, because limits that are gone do not come back. */
static int without_rights(void)
{
    const struct rlimit none = { 0, 0 };

    if (setrlimit(RLIMIT_RTPRIO, &none) != 0 || (getuid() == 0 && setuid(65534) != 0))
        return 2;
    if (shef_thread_start(
            &thread,
            &(struct shef_thread_params){
                .name = "modest", .policy = SHEF_POLICY_FIFO, .priority = 40, .cpu = -1 },
            look_around, &seen, &err) != SHEF_OK)
        return 3;
    shef_thread_join(&thread);
    return seen.policy == SCHED_OTHER && !thread.real_time_given ? 0 : 4;
}

static void test_where_real_time_is_not_allowed_the_thread_runs_normally(void)
{
    int status;
    pid_t pid;

    fflush(stdout);
    pid = fork();
    if (pid == 0)
        _exit(without_rights());
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_TRUE(WIFEXITED(status));
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
}

static void test_where_real_time_is_allowed_the_thread_has_it(void)
{
    run(&(struct shef_thread_params){
        .name = "quick", .policy = SHEF_POLICY_FIFO, .priority = 7, .cpu = -1 });
    if (!thread.real_time_given)
        TEST_IGNORE_MESSAGE("this user may not have real-time priorities");
    TEST_ASSERT_EQUAL_INT(SCHED_FIFO, seen.policy);
    TEST_ASSERT_EQUAL_INT(7, seen.priority);
}

static void wait_for_the_end(void *context)
{
    while (!atomic_load((_Atomic bool *)context))
        sched_yield();
}

static void test_a_thread_started_elsewhere_can_be_put_in_its_place(void)
{
    const struct shef_thread_params plain = { .name = "plain", .cpu = -1 };
    const struct shef_thread_params placed = {
        .name = "placed", .policy = SHEF_POLICY_FIFO, .priority = 9, .cpu = sched_getcpu()
    };
    const struct shef_thread_params nowhere = { .name = "nowhere", .cpu = 1000 };
    _Atomic bool may_end = false;
    struct sched_param param;
    cpu_set_t set;
    char name[16];
    bool given;
    int policy;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_thread_start(&thread, &plain, wait_for_the_end, &may_end, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_thread_adopt(thread.handle, &placed, &given, &err),
                              err.text);
    pthread_getname_np(thread.handle, name, sizeof name);
    TEST_ASSERT_EQUAL_STRING("placed", name);
    pthread_getaffinity_np(thread.handle, sizeof set, &set);
    TEST_ASSERT_EQUAL_INT(1, CPU_COUNT(&set));
    TEST_ASSERT_TRUE(CPU_ISSET(placed.cpu, &set));
    pthread_getschedparam(thread.handle, &policy, &param);
    TEST_ASSERT_EQUAL_INT(given ? SCHED_FIFO : SCHED_OTHER, policy);
    TEST_ASSERT_EQUAL_INT(given ? 9 : 0, param.sched_priority);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_thread_adopt(thread.handle, &nowhere, &given, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "no processor 1000"), err.text);
    atomic_store(&may_end, true);
    shef_thread_join(&thread);
}

static void test_the_configuration_names_policy_priority_and_processor(void)
{
    struct shef_config config;

    shef_config_defaults(&config);
    config.threads[SHEF_THREAD_FILTER].cpu = 1;

    const struct shef_thread_params params =
        shef_thread_params_of(&config, SHEF_THREAD_FILTER, "filter");

    TEST_ASSERT_EQUAL(SHEF_POLICY_FIFO, params.policy);
    TEST_ASSERT_EQUAL_INT32(45, params.priority);
    TEST_ASSERT_EQUAL_INT32(1, params.cpu);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_thread_has_the_stack_it_was_given_and_blocks_signals);
    RUN_TEST(test_without_a_wish_the_stack_is_the_usual_one);
    RUN_TEST(test_the_starter_keeps_its_own_signal_mask);
    RUN_TEST(test_a_running_thread_has_its_name_a_number_and_uses_time);
    RUN_TEST(test_a_thread_stays_on_its_processor);
    RUN_TEST(test_a_processor_that_is_not_there_is_one_sentence);
    RUN_TEST(test_where_real_time_is_not_allowed_the_thread_runs_normally);
    RUN_TEST(test_where_real_time_is_allowed_the_thread_has_it);
    RUN_TEST(test_a_thread_started_elsewhere_can_be_put_in_its_place);
    RUN_TEST(test_the_configuration_names_policy_priority_and_processor);
    return UNITY_END();
}
