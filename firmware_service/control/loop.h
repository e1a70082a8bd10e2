/* Waits for several file descriptors at once and calls whoever watches the one that is ready.
 *
 * The control thread's only waiting place: sockets, signals, timers and wake-ups all come here.
 * One event is handled at a time, so a watcher may unwatch anything, itself included.
 * Thread: one, unless noted. */
#ifndef SHEF_CONTROL_LOOP_H
#define SHEF_CONTROL_LOOP_H

#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_loop;

/*   events  EPOLLIN, EPOLLOUT, EPOLLHUP, ... as epoll_wait(2) reports them */
typedef void shef_loop_fn(void *context, uint32_t events);

/* Owned by who watches; must stay where it is until it is unwatched. */
struct shef_loop_watch {
    int fd;
    shef_loop_fn *fn;
    void *context;
};

SHEF_MUST_CHECK enum shef_err shef_loop_create(struct shef_loop **out_loop, struct shef_error *err);

/* NULL is allowed. The descriptors stay open. */
void shef_loop_destroy(struct shef_loop *loop);

/* Calls watch->fn whenever one of the events is there, until unwatch().
 *   events  EPOLLIN, EPOLLOUT; errors and hang-ups are always reported */
SHEF_MUST_CHECK enum shef_err shef_loop_watch(struct shef_loop *loop, struct shef_loop_watch *watch,
                                              uint32_t events, struct shef_error *err);

/* Waits for other events from now on. */
void shef_loop_change(struct shef_loop *loop, struct shef_loop_watch *watch, uint32_t events);

/* Call it before the descriptor is closed. */
void shef_loop_unwatch(struct shef_loop *loop, struct shef_loop_watch *watch);

/* Handles events until quit(). */
void shef_loop_run(struct shef_loop *loop);

/* Handles at most one event; waits for it no longer than timeout_ms (-1: forever). */
void shef_loop_step(struct shef_loop *loop, int32_t timeout_ms);

/* Ends the running run(), or the next one.                        Thread: any. */
void shef_loop_quit(struct shef_loop *loop);

#ifdef __cplusplus
}
#endif

#endif
