#include "core/wake.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum shef_err shef_wake_init(struct shef_wake *wake, struct shef_error *err)
{
    wake->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (wake->fd < 0)
        return shef_fail_os(err, errno, "open an eventfd to wake a thread");
    return SHEF_OK;
}

void shef_wake_deinit(struct shef_wake *wake)
{
    if (wake->fd >= 0)
        close(wake->fd);
    wake->fd = -1;
}

void shef_wake_signal(struct shef_wake *wake)
{
    const uint64_t one = 1;
    ssize_t n;

    do {
        n = write(wake->fd, &one, sizeof one);
    } while (n < 0 && errno == EINTR);
    /* EAGAIN: 2^64 - 2 signals wait already, which wakes as well. */
    assert(n == (ssize_t)sizeof one || errno == EAGAIN);
}

static bool take_signals(struct shef_wake *wake)
{
    uint64_t n_signals;

    return read(wake->fd, &n_signals, sizeof n_signals) == (ssize_t)sizeof n_signals;
}

bool shef_wake_wait(struct shef_wake *wake, int32_t timeout_ms)
{
    struct pollfd entry = { .fd = wake->fd, .events = POLLIN };

    /* Under load the signal is often there already: one system call instead of two. */
    if (take_signals(wake))
        return true;
    if (timeout_ms == 0 || poll(&entry, 1, timeout_ms) <= 0)
        return false;
    return take_signals(wake);
}
