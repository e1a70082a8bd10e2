#include "control/loop.h"

#include <assert.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "core/wake.h"

struct shef_loop {
    int epoll_fd;
    struct shef_wake quit_wake;
    struct shef_loop_watch quit_watch;
    _Atomic bool quits;
};

static void drain_quit(void *context, uint32_t events)
{
    struct shef_loop *loop = context;

    (void)events;
    (void)shef_wake_wait(&loop->quit_wake, 0);
}

enum shef_err shef_loop_create(struct shef_loop **out_loop, struct shef_error *err)
{
    struct shef_loop *loop = calloc(1, sizeof *loop);
    enum shef_err code;

    if (!loop)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "control: out of memory");
    loop->quit_wake.fd = -1;
    loop->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
    if (loop->epoll_fd < 0)
        code = shef_fail_os(err, errno, "control: open an epoll descriptor");
    else
        code = shef_wake_init(&loop->quit_wake, err);
    if (code == SHEF_OK) {
        loop->quit_watch = (struct shef_loop_watch){ loop->quit_wake.fd, drain_quit, loop };
        code = shef_loop_watch(loop, &loop->quit_watch, EPOLLIN, err);
    }
    if (code != SHEF_OK) {
        shef_loop_destroy(loop);
        return code;
    }
    *out_loop = loop;
    return SHEF_OK;
}

void shef_loop_destroy(struct shef_loop *loop)
{
    if (!loop)
        return;
    shef_wake_deinit(&loop->quit_wake);
    if (loop->epoll_fd >= 0)
        close(loop->epoll_fd);
    free(loop);
}

enum shef_err shef_loop_watch(struct shef_loop *loop, struct shef_loop_watch *watch,
                              uint32_t events, struct shef_error *err)
{
    struct epoll_event event = { .events = events, .data.ptr = watch };

    if (epoll_ctl(loop->epoll_fd, EPOLL_CTL_ADD, watch->fd, &event) != 0)
        return shef_fail_os(err, errno, "control: wait for descriptor %d", watch->fd);
    return SHEF_OK;
}

void shef_loop_change(struct shef_loop *loop, struct shef_loop_watch *watch, uint32_t events)
{
    struct epoll_event event = { .events = events, .data.ptr = watch };
    const int status = epoll_ctl(loop->epoll_fd, EPOLL_CTL_MOD, watch->fd, &event);

    assert(status == 0);
    (void)status;
}

void shef_loop_unwatch(struct shef_loop *loop, struct shef_loop_watch *watch)
{
    const int status = epoll_ctl(loop->epoll_fd, EPOLL_CTL_DEL, watch->fd, NULL);

    assert(status == 0);
    (void)status;
}

void shef_loop_step(struct shef_loop *loop, int32_t timeout_ms)
{
    struct epoll_event event;

    /* One at a time: an event of a batch could belong to a watch that an earlier one removed. */
    if (epoll_wait(loop->epoll_fd, &event, 1, timeout_ms) == 1) {
        const struct shef_loop_watch *watch = event.data.ptr;

        watch->fn(watch->context, event.events);
    }
}

void shef_loop_run(struct shef_loop *loop)
{
    while (!atomic_exchange(&loop->quits, false))
        shef_loop_step(loop, -1);
}

void shef_loop_quit(struct shef_loop *loop)
{
    atomic_store(&loop->quits, true);
    shef_wake_signal(&loop->quit_wake);
}
