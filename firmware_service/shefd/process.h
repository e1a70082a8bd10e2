/* What shefd does to its own process before it starts. Thread: main, before any other thread. */
#ifndef SHEF_SHEFD_PROCESS_H
#define SHEF_SHEFD_PROCESS_H

#include <stdbool.h>

#include "core/error.h"

/* Keeps all memory, present and future, in RAM, and freed memory in the process, so that no
 * streaming thread waits for a page. SHEF_ERR_PERMISSION: not allowed; nothing has changed. */
SHEF_MUST_CHECK enum shef_err shef_process_lock_memory(struct shef_error *err);

/* Blocks the signals that shefd takes in turn and opens a descriptor for them (signalfd(2)).
 *   out_fd  readable when SIGTERM, SIGINT or SIGHUP came; the caller closes it */
SHEF_MUST_CHECK enum shef_err shef_process_take_signals(int *out_fd, struct shef_error *err);

/* The number of the next signal, 0 if none waits. */
int shef_process_next_signal(int fd);

#endif
