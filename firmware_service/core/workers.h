/* A team of worker threads that runs the independent parts of one job.
 *
 * The caller cuts a job into tasks 0..n_tasks-1 that touch disjoint output; the team takes them in
 * any order, the calling thread works too, and run() returns when all are done. Which thread ran
 * which task never shows in the result. A team of one thread has no threads of its own and runs
 * the tasks in order. Idle workers sleep on a futex; run() allocates nothing and holds no lock. */
#ifndef SHEF_CORE_WORKERS_H
#define SHEF_CORE_WORKERS_H

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_workers;

/* One task.   context  as given to run()
 *             task     0..n_tasks-1
 *             worker   0..n_threads-1, for scratch memory of one's own */
typedef void shef_task_fn(void *context, int32_t task, int32_t worker);

/* Starts n_threads - 1 threads (1..64 threads in all).            Thread: setup.
 * Returns NULL and a sentence in err on failure. */
struct shef_workers *shef_workers_create(int32_t n_threads, struct shef_error *err);

/* The same with stacks of a stated size, where all memory is locked and the system's usual 8 MB
 * would be paid in full.
 *   stack_bytes  whole pages, 65536 or more */
struct shef_workers *shef_workers_create_sized(int32_t n_threads, size_t stack_bytes,
                                               struct shef_error *err);

/* A thread of the team, to set its name, priority or processor.
 *   worker  1..n_threads-1; worker 0 is whoever calls run() */
pthread_t shef_workers_handle(const struct shef_workers *workers, int32_t worker);

/* How many threads work, the caller included. */
int32_t shef_workers_count(const struct shef_workers *workers);

/* Runs fn for every task and returns when all are done.           Thread: one caller at a time.
 *   workers  may be NULL: the caller runs all tasks itself, as worker 0 */
void shef_workers_run(struct shef_workers *workers, shef_task_fn *fn, void *context,
                      int32_t n_tasks);

/* Stops and joins the threads. NULL is allowed. */
void shef_workers_destroy(struct shef_workers *workers);

#ifdef __cplusplus
}
#endif

#endif
