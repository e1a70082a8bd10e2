/* The control server: takes requests from shefctl and calls the registered commands.
 *
 * Everything happens on the thread that runs the loop; nothing here blocks. A client may send
 * one request after the other; each is answered before the next is read. Whoever is not allowed,
 * sends no JSON, sends too much or too fast, or does not read, is told once and dropped.
 * Thread: control. */
#ifndef SHEF_CONTROL_SERVER_H
#define SHEF_CONTROL_SERVER_H

#include "control/command.h"
#include "control/loop.h"
#include "core/clock.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A client that asks more often than this within one second is dropped. */
#define SHEF_CONTROL_REQUESTS_PER_S 100

struct shef_control;

struct shef_control_params {
    const char *path;  /* of the socket */
    const char *group; /* whose members are allowed; "": no group */
    int32_t max_clients;
    int32_t timeout_s; /* without a whole request, or with an answer that is not read to its end */
    struct shef_loop *loop;
    const struct shef_clock *clock;
};

/* Opens the socket and starts to listen; see shef_control_socket_open() for its errors. */
SHEF_MUST_CHECK enum shef_err shef_control_create(const struct shef_control_params *params,
                                                  struct shef_control **out_control,
                                                  struct shef_error *err);

/* Drops the clients, removes the socket. NULL is allowed. */
void shef_control_destroy(struct shef_control *control);

/* Adds commands; the table is kept, not copied.
 * SHEF_ERR_INVALID: a name is taken. SHEF_ERR_FULL: too many tables. */
SHEF_MUST_CHECK enum shef_err shef_control_register(struct shef_control *control,
                                                    const struct shef_control_command *commands,
                                                    int n_commands, void *context,
                                                    struct shef_error *err);

/* Drops clients that were silent for too long. The server calls it every second itself; tests
 * with a clock of their own call it when they have moved it. */
void shef_control_expire(struct shef_control *control);

/* How many clients are connected. */
int shef_control_client_count(const struct shef_control *control);

#ifdef __cplusplus
}
#endif

#endif
