/* Memory is allocated by create() alone: match() neither takes nor gives back any, on any thread.
 *
 * Every allocation of the process is counted: by functions of this file in place of the C
 * library's, or by the sanitizer's hooks where one is built in. */
#include "pipeline/robust.h"

#include <errno.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "core/workers.h"
#include "robust_cases.h"

static _Atomic int64_t n_calls;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void *, size_t),
                                              void (*on_free)(const volatile void *));

static void count_malloc(const volatile void *memory, size_t n_bytes)
{
    (void)memory;
    (void)n_bytes;
    atomic_fetch_add(&n_calls, 1);
}

static void count_free(const volatile void *memory)
{
    atomic_fetch_add(&n_calls, memory != NULL);
}

static void start_counting(void)
{
    TEST_ASSERT_TRUE(__sanitizer_install_malloc_and_free_hooks(count_malloc, count_free) > 0);
}

#else

/* The C library's own names for what is replaced here. */
void *__libc_malloc(size_t n_bytes);
void *__libc_calloc(size_t n_items, size_t item_bytes);
void *__libc_realloc(void *memory, size_t n_bytes);
void *__libc_memalign(size_t alignment, size_t n_bytes);
void __libc_free(void *memory);

void *malloc(size_t n_bytes)
{
    atomic_fetch_add(&n_calls, 1);
    return __libc_malloc(n_bytes);
}

void *calloc(size_t n_items, size_t item_bytes)
{
    atomic_fetch_add(&n_calls, 1);
    return __libc_calloc(n_items, item_bytes);
}

void *realloc(void *memory, size_t n_bytes)
{
    atomic_fetch_add(&n_calls, 1);
    return __libc_realloc(memory, n_bytes);
}

void *aligned_alloc(size_t alignment, size_t n_bytes)
{
    atomic_fetch_add(&n_calls, 1);
    return __libc_memalign(alignment, n_bytes);
}

int posix_memalign(void **out_memory, size_t alignment, size_t n_bytes)
{
    atomic_fetch_add(&n_calls, 1);
    *out_memory = __libc_memalign(alignment, n_bytes);
    return *out_memory ? 0 : ENOMEM;
}

/* qsort() frees NULL where its list was short enough for the stack. */
void free(void *memory)
{
    atomic_fetch_add(&n_calls, memory != NULL);
    __libc_free(memory);
}

static void start_counting(void)
{
}

#endif

/* The thread sanitizer tells of no aligned allocation, but of every free. */
static void test_the_counter_sees_what_create_and_destroy_do(void)
{
    const struct shef_robust_params params = shef_robust_defaults(96, 64, SHEF_EDGE_UNSIGNED);
    const int64_t before = atomic_load(&n_calls);

    shef_robust_destroy(matcher_create(&params, NULL));
    TEST_ASSERT_GREATER_THAN_INT64(20, atomic_load(&n_calls) - before);
}

struct meeting {
    _Atomic int32_t n_present;
    int32_t n_expected;
};

static void wait_for_the_others(void *context, int32_t task, int32_t worker)
{
    struct meeting *meeting = context;

    (void)task;
    (void)worker;
    atomic_fetch_add(&meeting->n_present, 1);
    while (atomic_load(&meeting->n_present) < meeting->n_expected)
        sched_yield();
}

/* Every thread has started, and taken what memory the C library gives a thread. */
static struct shef_workers *create_working_threads(int32_t n_threads)
{
    struct shef_error err = { 0 };
    struct meeting meeting = { .n_expected = n_threads };
    struct shef_workers *workers = shef_workers_create(n_threads, &err);

    TEST_ASSERT_NOT_NULL_MESSAGE(workers, err.text);
    shef_workers_run(workers, wait_for_the_others, &meeting, n_threads);
    return workers;
}

/* Pairs with everything in use: alignment measured, bias, past, a second pair, a cut, a gap,
 * outlines. */
static void expect_no_allocation(enum shef_edge_kind kind, int32_t n_workers)
{
    struct shef_robust_params params = shef_robust_defaults(121, 83, kind);
    const struct shef_smooth_field bias = { .c = { 1.0 }, .width_px = 121, .height_px = 83 };
    struct shef_workers *workers = create_working_threads(n_workers);

    params.jump_reach_px = SHEF_ROBUST_MAX_REACH_PX;

    struct shef_robust *matcher = matcher_create(&params, workers);
    struct result result = result_create(121, 83);
    struct scene scene = { .kind = kind, .width_px = 121, .height_px = 83, .near_px = 20.0 };
    struct edges edges[2];
    struct shef_edge_pair pairs[2];

    for (int i = 0; i < 2; i++) {
        scene.texture = 50 + (uint64_t)i;
        edges[i] = edges_of_scene(&scene);
        pairs[i] = edges_pair(&edges[i]);
    }

    const int64_t before = atomic_load(&n_calls);

    shef_robust_align_auto(matcher);
    for (int32_t i = 0; i < 6; i++)
        shef_robust_match(matcher, &pairs[i / 3], 1, i, &result.images, &result.report);
    shef_robust_set_bias(matcher, &bias);
    shef_robust_align_fixed(matcher, &bias);
    shef_robust_match(matcher, pairs, 2, 9, &result.images, NULL);
    shef_robust_reset(matcher);
    shef_robust_match(matcher, pairs, 2, 10, &result.images, NULL);

    const int64_t n_in_match = atomic_load(&n_calls) - before;

    edges_destroy(&edges[0]);
    edges_destroy(&edges[1]);
    result_destroy(&result);
    shef_robust_destroy(matcher);
    shef_workers_destroy(workers);
    TEST_ASSERT_EQUAL_INT64(0, n_in_match);
}

static void test_match_allocates_nothing_on_one_thread(void)
{
    expect_no_allocation(SHEF_EDGE_UNSIGNED, 1);
    expect_no_allocation(SHEF_EDGE_TERNARY, 1);
    expect_no_allocation(SHEF_EDGE_GRADED, 1);
}

static void test_match_allocates_nothing_on_several_threads(void)
{
    expect_no_allocation(SHEF_EDGE_UNSIGNED, 2);
    expect_no_allocation(SHEF_EDGE_GRADED, 3);
}

int main(void)
{
    start_counting();
    UNITY_BEGIN();
    RUN_TEST(test_the_counter_sees_what_create_and_destroy_do);
    RUN_TEST(test_match_allocates_nothing_on_one_thread);
    RUN_TEST(test_match_allocates_nothing_on_several_threads);
    return UNITY_END();
}
