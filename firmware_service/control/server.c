#include "control/server.h"

#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "control/client.h"
#include "control/request.h"
#include "control/socket.h"
#include "core/log.h"

#define MAX_TABLES 8

struct table {
    const struct shef_control_command *commands;
    int n_commands;
    void *context;
};

struct shef_control {
    struct shef_loop *loop;
    const struct shef_clock *clock;
    gid_t group;
    int32_t max_clients;
    int32_t timeout_s;
    struct shef_control_socket socket;
    struct shef_loop_watch socket_watch;
    struct shef_loop_watch timer_watch;
    struct shef_control_client *clients;
    int n_clients;
    shef_host_time last_refusal_logged;
    uint64_t n_refused; /* clients that may not */
    struct table tables[MAX_TABLES];
    int n_tables;
};

const struct shef_control_command *shef_control_find(const struct shef_control *control,
                                                     const char *name, void **out_context)
{
    for (int t = 0; t < control->n_tables; t++) {
        const struct table *table = &control->tables[t];

        for (int i = 0; i < table->n_commands; i++) {
            if (strcmp(table->commands[i].name, name) == 0) {
                *out_context = table->context;
                return &table->commands[i];
            }
        }
    }
    return NULL;
}

void shef_control_drop(struct shef_control *control, struct shef_control_client *client)
{
    struct shef_control_client **link = &control->clients;

    while (*link != client)
        link = &(*link)->next;
    *link = client->next;
    control->n_clients--;
    shef_control_client_destroy(client);
}

/* For who is not let in: one try, then the door closes. */
static void turn_away(int fd, const struct shef_error *err)
{
    char *line = shef_control_refusal(err, true);

    if (line && send(fd, line, strlen(line), MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
        shef_log(SHEF_LOG_DEBUG, "a refused client did not hear why");
    free(line);
    close(fd);
}

/* Once in this time at most: whoever knocks in a loop shall not fill the journal. */
#define REFUSAL_LOG_NS (60 * SHEF_NS_PER_S)

static void log_refusal(struct shef_control *control, const struct shef_control_peer *peer)
{
    const shef_host_time now = shef_clock_now(control->clock);

    control->n_refused++;
    if (control->last_refusal_logged.ns != 0 &&
        shef_host_time_since(now, control->last_refusal_logged) < REFUSAL_LOG_NS)
        return;
    control->last_refusal_logged = now;
    shef_log(SHEF_LOG_WARNING,
             "control: user %u (process %d) is not allowed, refused; %" PRIu64
             " refused since the start, said once a minute",
             (unsigned)peer->uid, (int)peer->pid, control->n_refused);
}

static enum shef_err check_peer(struct shef_control *control, int fd, struct shef_error *err)
{
    struct shef_control_peer peer;
    const enum shef_err code = shef_control_peer_of(fd, control->group, &peer, err);

    if (code != SHEF_OK)
        return code;
    if (!shef_control_is_allowed(&peer, geteuid())) {
        log_refusal(control, &peer);
        return shef_fail(err, SHEF_ERR_PERMISSION,
                         "user %u may not control this service; root, its own user and members of "
                         "its control.group may",
                         (unsigned)peer.uid);
    }
    if (control->n_clients >= control->max_clients)
        return shef_fail(
            err, SHEF_ERR_FULL,
            "the limit of %d connections is reached (control.max_clients); try again later",
            control->max_clients);
    return SHEF_OK;
}

static enum shef_err add_client(struct shef_control *control, int fd, struct shef_error *err)
{
    struct shef_control_client *client =
        shef_control_client_create(control, control->loop, control->clock, fd, err);

    if (!client)
        return err->code;
    client->next = control->clients;
    control->clients = client;
    control->n_clients++;
    return SHEF_OK;
}

static void on_socket(void *context, uint32_t events)
{
    struct shef_control *control = context;
    struct shef_error err = { 0 };
    const int fd = accept4(control->socket.fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);

    (void)events;
    if (fd < 0) {
        /* Out of descriptors: the client would keep us awake. The timer looks again. */
        if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS)
            shef_loop_change(control->loop, &control->socket_watch, 0);
        return;
    }
    if (check_peer(control, fd, &err) != SHEF_OK || add_client(control, fd, &err) != SHEF_OK)
        turn_away(fd, &err);
}

void shef_control_expire(struct shef_control *control)
{
    const shef_host_time now = shef_clock_now(control->clock);

    for (struct shef_control_client *client = control->clients, *next; client; client = next) {
        next = client->next;
        if (shef_host_time_since(now, client->last_done) > control->timeout_s * SHEF_NS_PER_S)
            shef_control_drop(control, client);
    }
}

static void on_timer(void *context, uint32_t events)
{
    struct shef_control *control = context;
    uint64_t n_ticks;
    const ssize_t n = read(control->timer_watch.fd, &n_ticks, sizeof n_ticks);

    (void)events;
    (void)n;
    shef_control_expire(control);
    shef_loop_change(control->loop, &control->socket_watch, EPOLLIN);
}

static enum shef_err help(void *context, const json_t *arguments, json_t *answer,
                          struct shef_error *err)
{
    const struct shef_control *control = context;
    json_t *list = json_array();

    (void)arguments;
    (void)err;
    for (int t = 0; t < control->n_tables; t++)
        for (int i = 0; i < control->tables[t].n_commands; i++)
            json_array_append_new(list, json_pack("{s:s, s:s}", "name",
                                                  control->tables[t].commands[i].name, "help",
                                                  control->tables[t].commands[i].help));
    json_object_set_new(answer, "commands", list);
    return SHEF_OK;
}

static const struct shef_control_command own_commands[] = {
    { "help", "lists the commands", help },
};

static enum shef_err start_timer(struct shef_control *control, struct shef_error *err)
{
    const struct itimerspec every_second = { .it_interval = { 1, 0 }, .it_value = { 1, 0 } };
    const int fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);

    if (fd < 0 || timerfd_settime(fd, 0, &every_second, NULL) != 0) {
        const enum shef_err code = shef_fail_os(err, errno, "control: start a timer");

        if (fd >= 0)
            close(fd);
        return code;
    }
    control->timer_watch = (struct shef_loop_watch){ fd, on_timer, control };
    return shef_loop_watch(control->loop, &control->timer_watch, EPOLLIN, err);
}

enum shef_err shef_control_create(const struct shef_control_params *params,
                                  struct shef_control **out_control, struct shef_error *err)
{
    struct shef_control *control = calloc(1, sizeof *control);
    enum shef_err code;

    if (!control)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "control: out of memory");
    *control = (struct shef_control){ .loop = params->loop,
                                      .clock = params->clock,
                                      .group = shef_control_group(params->group),
                                      .max_clients = params->max_clients,
                                      .timeout_s = params->timeout_s,
                                      .socket = { .fd = -1, .lock_fd = -1 },
                                      .timer_watch = { .fd = -1 } };
    code = shef_control_socket_open(params->path, control->group, &control->socket, err);
    if (code == SHEF_OK) {
        control->socket_watch = (struct shef_loop_watch){ control->socket.fd, on_socket, control };
        code = shef_loop_watch(control->loop, &control->socket_watch, EPOLLIN, err);
    }
    if (code == SHEF_OK)
        code = start_timer(control, err);
    if (code == SHEF_OK)
        code = shef_control_register(control, own_commands, 1, control, err);
    if (code != SHEF_OK) {
        shef_control_destroy(control);
        return code;
    }
    *out_control = control;
    return SHEF_OK;
}

void shef_control_destroy(struct shef_control *control)
{
    if (!control)
        return;
    while (control->clients)
        shef_control_drop(control, control->clients);
    /* A closed descriptor leaves the loop by itself. */
    if (control->timer_watch.fd >= 0)
        close(control->timer_watch.fd);
    shef_control_socket_close(&control->socket);
    free(control);
}

enum shef_err shef_control_register(struct shef_control *control,
                                    const struct shef_control_command *commands, int n_commands,
                                    void *context, struct shef_error *err)
{
    void *other;

    if (control->n_tables == MAX_TABLES)
        return shef_fail(err, SHEF_ERR_FULL, "control: more than %d tables of commands",
                         MAX_TABLES);
    for (int i = 0; i < n_commands; i++)
        if (shef_control_find(control, commands[i].name, &other))
            return shef_fail(err, SHEF_ERR_INVALID, "control: there are two commands '%s'",
                             commands[i].name);
    control->tables[control->n_tables++] = (struct table){ commands, n_commands, context };
    return SHEF_OK;
}

int shef_control_client_count(const struct shef_control *control)
{
    return control->n_clients;
}
