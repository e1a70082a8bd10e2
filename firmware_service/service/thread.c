#include "service/thread.h"

#include <assert.h>
#include <errno.h>
#include <sched.h>
#include <semaphore.h>
#include <signal.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "core/time.h"

/* What the new thread needs while its starter waits for it. */
struct start {
    struct shef_thread *thread;
    sem_t is_up;
};

struct shef_thread_params shef_thread_params_of(const struct shef_config *config,
                                                enum shef_config_thread id, const char *name)
{
    const struct shef_config_thread_row *row = &config->threads[id];

    return (struct shef_thread_params){
        .name = name, .policy = row->policy, .priority = row->priority, .cpu = row->cpu
    };
}

static __attribute__((noinline)) void touch_down(size_t n_bytes)
{
    volatile unsigned char bytes[4096];

    bytes[0] = 1;
    if (n_bytes > sizeof bytes)
        touch_down(n_bytes - sizeof bytes);
    bytes[1] = bytes[0]; /* keeps the call above from becoming a loop over one frame */
}

/* Touches what is left of the calling thread's stack: without this the first deep call would
 * fault pages in while data waits. Thread-local variables take a part of the stack, under a
 * sanitizer most of it, so the end is asked for and not computed. */
static void touch_stack(void)
{
    const size_t margin = 16 * 1024; /* for the frames' own overhead on the way down */
    pthread_attr_t attributes;
    void *end = NULL;
    size_t n_bytes;
    size_t n_left;

    if (pthread_getattr_np(pthread_self(), &attributes) != 0)
        return;
    pthread_attr_getstack(&attributes, &end, &n_bytes);
    pthread_attr_destroy(&attributes);
    n_left = (size_t)((char *)__builtin_frame_address(0) - (char *)end);
    if (n_left > 2 * margin)
        touch_down(n_left - margin);
}

static void *thread_main(void *argument)
{
    struct start *start = argument;
    struct shef_thread *thread = start->thread;

    thread->tid = (int32_t)syscall(SYS_gettid);
    touch_stack();
    sem_post(&start->is_up);
    thread->fn(thread->context);
    return NULL;
}

/* Where the process may run; kept by adopt() before it pins the thread that starts the others,
 * because they would inherit its place. */
static cpu_set_t all_processors;
static bool knows_all_processors;

static int set_processor(pthread_attr_t *attributes, int32_t cpu)
{
    cpu_set_t set;

    if (cpu < 0)
        return knows_all_processors
                   ? pthread_attr_setaffinity_np(attributes, sizeof all_processors, &all_processors)
                   : 0;
    CPU_ZERO(&set);
    CPU_SET(cpu, &set);
    return pthread_attr_setaffinity_np(attributes, sizeof set, &set);
}

static int create(struct shef_thread *thread, struct start *start, bool real_time)
{
    const struct sched_param priority = { .sched_priority =
                                              real_time ? thread->params.priority : 0 };
    pthread_attr_t attributes;
    int failure = pthread_attr_init(&attributes);

    if (failure != 0)
        return failure;
    failure = pthread_attr_setstacksize(&attributes, thread->params.stack_bytes);
    if (failure == 0)
        failure = set_processor(&attributes, thread->params.cpu);
    /* Explicit also for normal threads: their starter may have real time. */
    if (failure == 0)
        failure = pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    if (failure == 0)
        failure = pthread_attr_setschedpolicy(&attributes, real_time ? SCHED_FIFO : SCHED_OTHER);
    if (failure == 0)
        failure = pthread_attr_setschedparam(&attributes, &priority);
    if (failure == 0)
        failure = pthread_create(&thread->handle, &attributes, thread_main, start);
    pthread_attr_destroy(&attributes);
    return failure;
}

static enum shef_err fail_start(const struct shef_thread_params *params, int failure,
                                struct shef_error *err)
{
    if (failure == EINVAL && params->cpu >= 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "start thread '%s': there is no processor %d for it; see 'nproc --all' "
                         "and the setting threads.*.cpu",
                         params->name, params->cpu);
    return shef_fail_os(err, failure, "start thread '%s'", params->name);
}

enum shef_err shef_thread_start(struct shef_thread *thread, const struct shef_thread_params *params,
                                shef_thread_fn *fn, void *context, struct shef_error *err)
{
    struct start start = { .thread = thread };
    sigset_t all, earlier;

    assert(strlen(params->name) <= 15);
    *thread = (struct shef_thread){ .fn = fn, .context = context, .params = *params };
    if (thread->params.stack_bytes == 0)
        thread->params.stack_bytes = SHEF_THREAD_STACK_BYTES;
    assert(thread->params.stack_bytes >= 64 * 1024);
    sem_init(&start.is_up, 0, 0);

    /* Signals are for the control thread's signalfd; the new thread inherits the mask. */
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &earlier);

    bool real_time = thread->params.policy == SHEF_POLICY_FIFO;
    int failure = create(thread, &start, real_time);

    if (failure == EPERM && real_time) {
        real_time = false;
        failure = create(thread, &start, false);
    }
    pthread_sigmask(SIG_SETMASK, &earlier, NULL);
    if (failure == 0) {
        while (sem_wait(&start.is_up) != 0)
            ; /* EINTR */
        pthread_setname_np(thread->handle, thread->params.name);
        thread->is_running = true;
        thread->real_time_given = real_time;
    }
    sem_destroy(&start.is_up);
    return failure == 0 ? SHEF_OK : fail_start(&thread->params, failure, err);
}

void shef_thread_join(struct shef_thread *thread)
{
    if (!thread->is_running)
        return;
    pthread_join(thread->handle, NULL);
    thread->is_running = false;
}

enum shef_err shef_thread_adopt(pthread_t handle, const struct shef_thread_params *params,
                                bool *out_given, struct shef_error *err)
{
    const bool real_time = params->policy == SHEF_POLICY_FIFO;
    const struct sched_param priority = { .sched_priority = real_time ? params->priority : 0 };
    cpu_set_t set;

    assert(strlen(params->name) <= 15);
    pthread_setname_np(handle, params->name);
    if (params->cpu >= 0) {
        knows_all_processors =
            knows_all_processors ||
            pthread_getaffinity_np(pthread_self(), sizeof all_processors, &all_processors) == 0;
        CPU_ZERO(&set);
        CPU_SET(params->cpu, &set);

        const int failure = pthread_setaffinity_np(handle, sizeof set, &set);

        if (failure != 0)
            return fail_start(params, failure, err);
    }
    *out_given =
        pthread_setschedparam(handle, real_time ? SCHED_FIFO : SCHED_OTHER, &priority) == 0 ||
        !real_time;
    return SHEF_OK;
}

int64_t shef_thread_handle_cpu_ns(pthread_t handle)
{
    clockid_t clock;
    struct timespec used;

    if (pthread_getcpuclockid(handle, &clock) != 0 || clock_gettime(clock, &used) != 0)
        return -1;
    return used.tv_sec * SHEF_NS_PER_S + used.tv_nsec;
}

int64_t shef_thread_cpu_ns(const struct shef_thread *thread)
{
    return thread->is_running ? shef_thread_handle_cpu_ns(thread->handle) : -1;
}
