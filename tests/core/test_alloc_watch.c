#include "support/alloc_watch.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "support/support.h"

/* The compiler may drop an allocation that nobody looks at. */
static void *volatile keep;

static void *allocate_here(void *argument)
{
    const int n = *(const int *)argument;

    pthread_setname_np(pthread_self(), "worker");
    for (int i = 0; i < n; i++) {
        keep = malloc(100);
        free(keep);
    }
    return NULL;
}

static void run_worker(int n)
{
    pthread_t thread;

    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, allocate_here, &n));
    pthread_join(thread, NULL);
}

static void test_what_is_not_watched_is_not_counted(void)
{
    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    shef_alloc_watch_stop();
    keep = malloc(10);
    free(keep);
    TEST_ASSERT_EQUAL_INT(0, shef_alloc_watch_count());
}

static void test_every_kind_of_call_is_counted(void)
{
    void *blocks[6];

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    blocks[0] = keep = malloc(1);
    blocks[1] = keep = calloc(2, 3);
    blocks[2] = keep = realloc(NULL, 10);
    blocks[3] = keep = aligned_alloc(64, 128);
    TEST_ASSERT_EQUAL_INT(0, posix_memalign(&blocks[4], 64, 200));
    blocks[5] = keep = strdup("from the C library");
    for (int i = 0; i < 6; i++)
        free(blocks[i]);
    free(NULL);
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(12, shef_alloc_watch_calls(NULL, false));
    TEST_ASSERT_EQUAL_INT(0, (int)((uintptr_t)blocks[3] % 64));
    TEST_ASSERT_EQUAL_INT(0, (int)((uintptr_t)blocks[4] % 64));
}

static void test_a_librarys_calls_are_told_from_ours(void)
{
    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    keep = strdup("allocated by the C library for us");
    shef_alloc_watch_stop();
    free(keep);
    TEST_ASSERT_EQUAL_UINT64(1, shef_alloc_watch_calls(NULL, false));
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls(NULL, true));
}

static void test_calls_are_attributed_to_their_thread(void)
{
    struct shef_alloc_entry entry;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    run_worker(7);
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(14, shef_alloc_watch_calls("worker", true));
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls("nobody", false));
    for (int i = 0; i < shef_alloc_watch_count(); i++) {
        entry = shef_alloc_watch_entry(i);
        if (strcmp(entry.thread, "worker") == 0 && entry.n_allocations > 0) {
            TEST_ASSERT_EQUAL_UINT64(7, entry.n_allocations);
            TEST_ASSERT_EQUAL_UINT64(700, entry.n_bytes);
            return;
        }
    }
    TEST_FAIL_MESSAGE("no entry of the worker's malloc()");
}

static void test_a_new_start_forgets_the_old_counts(void)
{
    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    run_worker(3);
    shef_alloc_watch_start();
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls(NULL, false));
}

static void test_many_threads_at_once_lose_no_call(void)
{
    pthread_t threads[8];
    int n = 1000;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    for (int i = 0; i < 8; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&threads[i], NULL, allocate_here, &n));
    for (int i = 0; i < 8; i++)
        pthread_join(threads[i], NULL);
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(8 * 2 * 1000, shef_alloc_watch_calls("worker", true));
}

static void test_the_report_names_thread_and_object(void)
{
    char *text = NULL;
    size_t n_text;
    FILE *out;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    run_worker(2);
    shef_alloc_watch_stop();
    out = open_memstream(&text, &n_text);
    shef_alloc_watch_print(out);
    fclose(out);
    TEST_ASSERT_NOT_NULL(strstr(text, "worker                 2 allocations"));
    TEST_ASSERT_NOT_NULL(strstr(text, "test_alloc_watch+0x"));
    free(text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_not_watched_is_not_counted);
    RUN_TEST(test_every_kind_of_call_is_counted);
    RUN_TEST(test_a_librarys_calls_are_told_from_ours);
    RUN_TEST(test_calls_are_attributed_to_their_thread);
    RUN_TEST(test_a_new_start_forgets_the_old_counts);
    RUN_TEST(test_many_threads_at_once_lose_no_call);
    RUN_TEST(test_the_report_names_thread_and_object);
    return UNITY_END();
}
