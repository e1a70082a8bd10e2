#include "core/workers.h"

#include <assert.h>
#include <limits.h>
#include <linux/futex.h>
#include <pthread.h>
#include <stdalign.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#define MAX_THREADS 64

struct worker {
    struct shef_workers *team;
    pthread_t thread;
    int32_t index; /* 1..n_threads-1; the caller is worker 0 */
};

struct shef_workers {
    /* Set by create, then read-only. */
    int32_t n_threads;
    struct worker *helpers; /* n_threads - 1 */

    /* Written by the caller between two rounds, while every helper sleeps; read by helpers
     * during a round. Published by `round`. */
    shef_task_fn *fn;
    void *context;
    int32_t n_tasks;
    bool quit;

    /* The number of the running or last round; helpers sleep on it. Own cache line. */
    alignas(64) _Atomic uint32_t round;
    /* The next task nobody has taken. Own cache line. */
    alignas(64) _Atomic int32_t next_task;
    /* Helpers still inside the round; the caller sleeps on it. Own cache line. */
    alignas(64) _Atomic uint32_t n_busy;
};

/* A futex is a plain 32-bit word to the kernel. */
static void sleep_while(_Atomic uint32_t *word, uint32_t value)
{
    /* EAGAIN (the value has changed already) and EINTR are the caller's loop to judge. */
    syscall(SYS_futex, word, FUTEX_WAIT_PRIVATE, value, NULL, NULL, 0);
}

static void wake(_Atomic uint32_t *word, int n_sleepers)
{
    syscall(SYS_futex, word, FUTEX_WAKE_PRIVATE, n_sleepers, NULL, NULL, 0);
}

static void work(struct shef_workers *team, int32_t worker)
{
    for (;;) {
        /* Relaxed: only who gets which task; the job itself was published by `round`. */
        const int32_t task = atomic_fetch_add_explicit(&team->next_task, 1, memory_order_relaxed);

        if (task >= team->n_tasks)
            return;
        team->fn(team->context, task, worker);
    }
}

static void *helper_main(void *argument)
{
    const struct worker *self = argument;
    struct shef_workers *team = self->team;
    uint32_t done_round = 0;

    for (;;) {
        /* Acquire: the job's fields become visible with the round's number. */
        while (atomic_load_explicit(&team->round, memory_order_acquire) == done_round)
            sleep_while(&team->round, done_round);
        done_round++;
        if (team->quit)
            return NULL;
        work(team, self->index);
        /* Release: this helper's output becomes visible before it counts as finished. The
         * release sequence carries the other helpers' output along. */
        if (atomic_fetch_sub_explicit(&team->n_busy, 1, memory_order_release) == 1)
            wake(&team->n_busy, 1);
    }
}

/* Every helper takes part in every round, so none can still be reading the job's fields when
 * the caller writes the next one. */
static void start_round(struct shef_workers *team)
{
    atomic_store_explicit(&team->n_busy, (uint32_t)team->n_threads - 1, memory_order_relaxed);
    /* Release: the job's fields become visible before the round's number. */
    atomic_fetch_add_explicit(&team->round, 1, memory_order_release);
    wake(&team->round, INT_MAX);
}

static int start_helper(struct worker *helper, size_t stack_bytes)
{
    pthread_attr_t attributes;
    int failure = pthread_attr_init(&attributes);

    if (failure != 0)
        return failure;
    if (stack_bytes > 0)
        failure = pthread_attr_setstacksize(&attributes, stack_bytes);
    if (failure == 0)
        failure = pthread_create(&helper->thread, &attributes, helper_main, helper);
    pthread_attr_destroy(&attributes);
    return failure;
}

/* stack_bytes 0: as large as the system makes them. */
static struct shef_workers *create(int32_t n_threads, size_t stack_bytes, struct shef_error *err)
{
    if (n_threads < 1 || n_threads > MAX_THREADS) {
        (void)shef_fail(err, SHEF_ERR_INVALID, "%d worker threads: must be 1 to %d", n_threads,
                        MAX_THREADS);
        return NULL;
    }

    struct shef_workers *team = aligned_alloc(alignof(struct shef_workers), sizeof *team);
    struct worker *helpers = calloc((size_t)n_threads, sizeof *helpers);

    if (!team || !helpers) {
        free(team);
        free(helpers);
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "%d worker threads: out of memory", n_threads);
        return NULL;
    }
    memset(team, 0, sizeof *team);
    team->helpers = helpers;
    team->n_threads = 1;
    while (team->n_threads < n_threads) {
        struct worker *helper = &helpers[team->n_threads - 1];

        *helper = (struct worker){ .team = team, .index = team->n_threads };

        const int failure = start_helper(helper, stack_bytes);

        if (failure != 0) {
            (void)shef_fail_os(err, failure, "start worker thread %d of %d", team->n_threads + 1,
                               n_threads);
            shef_workers_destroy(team);
            return NULL;
        }
        team->n_threads++;
    }
    return team;
}

struct shef_workers *shef_workers_create(int32_t n_threads, struct shef_error *err)
{
    return create(n_threads, 0, err);
}

struct shef_workers *shef_workers_create_sized(int32_t n_threads, size_t stack_bytes,
                                               struct shef_error *err)
{
    assert(stack_bytes >= 65536);
    return create(n_threads, stack_bytes, err);
}

pthread_t shef_workers_handle(const struct shef_workers *workers, int32_t worker)
{
    assert(worker >= 1 && worker < workers->n_threads);
    return workers->helpers[worker - 1].thread;
}

int32_t shef_workers_count(const struct shef_workers *workers)
{
    return workers ? workers->n_threads : 1;
}

void shef_workers_run(struct shef_workers *workers, shef_task_fn *fn, void *context,
                      int32_t n_tasks)
{
    assert(n_tasks >= 0 && n_tasks <= INT32_MAX - MAX_THREADS);

    /* With one thread or one task there is nothing to share, and nobody to wake. */
    if (!workers || workers->n_threads == 1 || n_tasks <= 1) {
        for (int32_t task = 0; task < n_tasks; task++)
            fn(context, task, 0);
        return;
    }
    workers->fn = fn;
    workers->context = context;
    workers->n_tasks = n_tasks;
    atomic_store_explicit(&workers->next_task, 0, memory_order_relaxed);
    start_round(workers);
    work(workers, 0);
    for (;;) {
        /* Acquire: every helper's output is visible once none is busy. */
        const uint32_t n_busy = atomic_load_explicit(&workers->n_busy, memory_order_acquire);

        if (n_busy == 0)
            return;
        sleep_while(&workers->n_busy, n_busy);
    }
}

void shef_workers_destroy(struct shef_workers *workers)
{
    if (!workers)
        return;
    workers->quit = true;
    start_round(workers);
    for (int32_t i = 0; i < workers->n_threads - 1; i++)
        pthread_join(workers->helpers[i].thread, NULL);
    free(workers->helpers);
    free(workers);
}
