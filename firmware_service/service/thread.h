/* Starts a thread with everything about it stated: name, stack, policy, priority, processor.
 *
 * Real-time scheduling is asked for and not insisted on: where the user may not have it, the
 * thread runs normally and says so. Thread: setup, unless noted. */
#ifndef SHEF_SERVICE_THREAD_H
#define SHEF_SERVICE_THREAD_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Enough for every thread of the service; with memory locked it is paid in full. */
#define SHEF_THREAD_STACK_BYTES ((size_t)256 * 1024)

struct shef_thread_params {
    const char *name;   /* at most 15 bytes, as ps and top show it */
    int32_t policy;     /* enum shef_config_policy */
    int32_t priority;   /* 1..99, for fifo */
    int32_t cpu;        /* -1: any */
    size_t stack_bytes; /* 65536 or more; 0: SHEF_THREAD_STACK_BYTES */
};

typedef void shef_thread_fn(void *context);

struct shef_thread {
    /* Set by start, then read-only. */
    pthread_t handle;
    shef_thread_fn *fn;
    void *context;
    struct shef_thread_params params;
    int32_t tid;          /* the kernel's number, for /proc and for processor time */
    bool is_running;      /* between start and join */
    bool real_time_given; /* fifo was asked for and granted */
};

/* The row of the configuration as parameters.
 *   name  kept, not copied */
struct shef_thread_params shef_thread_params_of(const struct shef_config *config,
                                                enum shef_config_thread id, const char *name);

/* Starts fn(context); its stack is touched before fn runs, all signals are blocked in it.
 * *thread must stay where it is until join.
 * SHEF_ERR_INVALID: that processor does not exist or is not ours. SHEF_ERR_NO_MEMORY, IO. */
SHEF_MUST_CHECK enum shef_err shef_thread_start(struct shef_thread *thread,
                                                const struct shef_thread_params *params,
                                                shef_thread_fn *fn, void *context,
                                                struct shef_error *err);

/* Waits for its end; a thread that does not run is allowed. */
void shef_thread_join(struct shef_thread *thread);

/* Puts name, policy, priority and processor on a thread that somebody else has started, e.g. the
 * main thread or a worker.
 *   out_given  whether real time was granted, or not asked for
 * SHEF_ERR_INVALID: that processor does not exist or is not ours. */
SHEF_MUST_CHECK enum shef_err shef_thread_adopt(pthread_t handle,
                                                const struct shef_thread_params *params,
                                                bool *out_given, struct shef_error *err);

/* Processor time that a running thread has used so far, in ns; -1 if unknown. Thread: any. */
int64_t shef_thread_cpu_ns(const struct shef_thread *thread);

/* The same for a thread that has not been joined, whoever started it. */
int64_t shef_thread_handle_cpu_ns(pthread_t handle);

#ifdef __cplusplus
}
#endif

#endif
