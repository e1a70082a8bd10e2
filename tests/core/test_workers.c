#include "core/workers.h"

#include <pthread.h>
#include <string.h>

#include "support/support.h"

#define MAX_TASKS 1000

static struct shef_workers *workers;

void tearDown(void)
{
    shef_workers_destroy(workers);
    workers = NULL;
}

static void start(int32_t n_threads)
{
    struct shef_error err = { 0 };

    workers = shef_workers_create(n_threads, &err);
    TEST_ASSERT_NOT_NULL_MESSAGE(workers, err.text);
    TEST_ASSERT_EQUAL_INT32(n_threads, shef_workers_count(workers));
}

/* Plain memory on purpose: the thread sanitizer sees it if run() fails to order it. */
struct tally {
    int32_t runs[MAX_TASKS];
    int32_t worker[MAX_TASKS];
    int32_t round;
};

static void count_task(void *context, int32_t task, int32_t worker)
{
    struct tally *tally = context;

    tally->runs[task] += tally->round;
    tally->worker[task] = worker;
}

static void expect_each_task_once_a_round(int32_t n_threads, int32_t n_tasks)
{
    struct tally tally = { 0 };
    int32_t expected = 0;

    for (tally.round = 1; tally.round <= 50; tally.round++) {
        shef_workers_run(workers, count_task, &tally, n_tasks);
        expected += tally.round;
        for (int32_t task = 0; task < n_tasks; task++) {
            TEST_ASSERT_EQUAL_INT32(expected, tally.runs[task]);
            TEST_ASSERT_GREATER_OR_EQUAL_INT32(0, tally.worker[task]);
            TEST_ASSERT_LESS_THAN_INT32(n_threads, tally.worker[task]);
        }
        for (int32_t task = n_tasks; task < MAX_TASKS; task++)
            TEST_ASSERT_EQUAL_INT32(0, tally.runs[task]);
    }
}

static void test_every_task_runs_once_in_every_round(void)
{
    static const int32_t threads[] = { 1, 2, 3, 8 };
    static const int32_t tasks[] = { 0, 1, 2, 7, MAX_TASKS };

    for (size_t i = 0; i < sizeof threads / sizeof threads[0]; i++) {
        start(threads[i]);
        for (size_t j = 0; j < sizeof tasks / sizeof tasks[0]; j++)
            expect_each_task_once_a_round(threads[i], tasks[j]);
        tearDown();
    }
}

static void record_order(void *context, int32_t task, int32_t worker)
{
    int32_t *order = context;

    TEST_ASSERT_EQUAL_INT32(0, worker);
    order[1 + order[0]++] = task;
}

static void expect_tasks_in_order(struct shef_workers *team)
{
    int32_t order[1 + 5] = { 0 };
    const int32_t expected[1 + 5] = { 5, 0, 1, 2, 3, 4 };

    shef_workers_run(team, record_order, order, 5);
    TEST_ASSERT_EQUAL_INT32_ARRAY(expected, order, 6);
}

static void test_no_team_and_a_team_of_one_run_in_order_on_the_caller(void)
{
    expect_tasks_in_order(NULL);
    TEST_ASSERT_EQUAL_INT32(1, shef_workers_count(NULL));
    start(1);
    expect_tasks_in_order(workers);
}

struct meeting {
    pthread_mutex_t mutex;
    pthread_cond_t arrived;
    int32_t n_present;
};

static void wait_for_the_others(void *context, int32_t task, int32_t worker)
{
    struct meeting *meeting = context;

    (void)task;
    (void)worker;
    pthread_mutex_lock(&meeting->mutex);
    meeting->n_present++;
    pthread_cond_broadcast(&meeting->arrived);
    while (meeting->n_present < 4)
        pthread_cond_wait(&meeting->arrived, &meeting->mutex);
    pthread_mutex_unlock(&meeting->mutex);
}

static void test_all_threads_work_at_the_same_time(void)
{
    struct meeting meeting = { PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, 0 };

    start(4);
    /* Each of the 4 tasks waits for the other 3: a team that used fewer threads would hang. */
    shef_workers_run(workers, wait_for_the_others, &meeting, 4);
    TEST_ASSERT_EQUAL_INT32(4, meeting.n_present);
}

static void test_stacks_can_have_a_stated_size(void)
{
    pthread_attr_t attributes;
    size_t n_bytes;

    workers = shef_workers_create_sized(3, 128 * 1024, NULL);
    TEST_ASSERT_NOT_NULL(workers);
    for (int32_t worker = 1; worker < 3; worker++) {
        TEST_ASSERT_EQUAL_INT(
            0, pthread_getattr_np(shef_workers_handle(workers, worker), &attributes));
        pthread_attr_getstacksize(&attributes, &n_bytes);
        pthread_attr_destroy(&attributes);
#ifdef __SANITIZE_THREAD__ /* which enlarges every stack for its own needs */
        TEST_ASSERT_GREATER_OR_EQUAL_size_t(128 * 1024, n_bytes);
#else
        TEST_ASSERT_EQUAL_size_t(128 * 1024, n_bytes);
#endif
    }
    expect_each_task_once_a_round(3, 100);
}

static void test_impossible_team_sizes_are_refused_with_a_sentence(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_NULL(shef_workers_create(0, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
    TEST_ASSERT_NOT_NULL(strstr(err.text, "must be 1 to 64"));
    TEST_ASSERT_NULL(shef_workers_create(65, &err));
    TEST_ASSERT_NULL(shef_workers_create(-1, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_task_runs_once_in_every_round);
    RUN_TEST(test_no_team_and_a_team_of_one_run_in_order_on_the_caller);
    RUN_TEST(test_all_threads_work_at_the_same_time);
    RUN_TEST(test_stacks_can_have_a_stated_size);
    RUN_TEST(test_impossible_team_sizes_are_refused_with_a_sentence);
    return UNITY_END();
}
