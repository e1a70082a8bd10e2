/* One connection to the control server: bytes in, lines, answers out. Internal to the server.
 * Thread: control. */
#ifndef SHEF_CONTROL_CLIENT_H
#define SHEF_CONTROL_CLIENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "control/command.h"
#include "control/loop.h"
#include "control/request.h"
#include "control/server.h"
#include "core/clock.h"

struct shef_control_client {
    /* Set by create, then read-only. */
    struct shef_control *control;
    struct shef_loop *loop;
    const struct shef_clock *clock;
    /* The server's list. */
    struct shef_control_client *next;
    /* The client's own. */
    struct shef_loop_watch watch;
    shef_host_time last_done; /* when it came, or a request or an answer was last complete */
    shef_host_time second;    /* when the present second of counting began */
    int32_t n_in_second;
    char *answer; /* being sent, or NULL */
    size_t n_answer;
    size_t n_sent;
    bool ends; /* dropped once the answer is out */
    size_t n_received;
    char received[SHEF_CONTROL_REQUEST_BYTES];
};

/* Starts to read from a connected, non-blocking socket, which it owns from then on.
 * NULL and a sentence in err: the socket is still the caller's. */
struct shef_control_client *shef_control_client_create(struct shef_control *control,
                                                       struct shef_loop *loop,
                                                       const struct shef_clock *clock, int fd,
                                                       struct shef_error *err);

/* Closes it, whatever was on its way. */
void shef_control_client_destroy(struct shef_control_client *client);

/* What the server gives its clients: the row of a command, or NULL; and the way out. */
const struct shef_control_command *shef_control_find(const struct shef_control *control,
                                                     const char *name, void **out_context);
void shef_control_drop(struct shef_control *control, struct shef_control_client *client);

#endif
