#include "shefd/process.h"

#include <errno.h>
#include <malloc.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

enum shef_err shef_process_lock_memory(struct shef_error *err)
{
    struct rlimit limit;

    /* With a finite limit locking may succeed now, and a later allocation fail because of it. */
    if (geteuid() != 0 &&
        (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY))
        return shef_fail(err, SHEF_ERR_PERMISSION,
                         "the limit 'memlock' (ulimit -l) must be 'unlimited' for this user");
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
        return shef_fail_os(err, errno, "lock memory");
    /* Never give the heap's end back, never map single blocks: both would fault in again. */
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);
    return SHEF_OK;
}

enum shef_err shef_process_take_signals(int *out_fd, struct shef_error *err)
{
    sigset_t wanted;
    int fd;

    /* A client that has left is an error of write(), not a reason to die. */
    signal(SIGPIPE, SIG_IGN);
    sigemptyset(&wanted);
    sigaddset(&wanted, SIGTERM);
    sigaddset(&wanted, SIGINT);
    sigaddset(&wanted, SIGHUP);
    if (sigprocmask(SIG_BLOCK, &wanted, NULL) != 0)
        return shef_fail_os(err, errno, "block signals");
    fd = signalfd(-1, &wanted, SFD_CLOEXEC | SFD_NONBLOCK);
    if (fd < 0)
        return shef_fail_os(err, errno, "open a descriptor for signals");
    *out_fd = fd;
    return SHEF_OK;
}

int shef_process_next_signal(int fd)
{
    struct signalfd_siginfo info;

    return read(fd, &info, sizeof info) == (ssize_t)sizeof info ? (int)info.ssi_signo : 0;
}
