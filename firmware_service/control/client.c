#include "control/client.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/words.h"

/* Sends what the socket takes. False: the client is gone. */
static bool send_some(struct shef_control_client *client)
{
    while (client->n_sent < client->n_answer) {
        const ssize_t n = send(client->watch.fd, client->answer + client->n_sent,
                               client->n_answer - client->n_sent, MSG_NOSIGNAL | MSG_DONTWAIT);

        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno == EAGAIN;
        client->n_sent += (size_t)n;
    }
    free(client->answer);
    client->answer = NULL;
    client->last_done = shef_clock_now(client->clock);
    return true;
}

/* Takes the line over. False: the client is gone. */
static bool answer_with(struct shef_control_client *client, char *line)
{
    if (!line)
        return false;
    assert(!client->answer);
    client->answer = line;
    client->n_answer = strlen(line);
    client->n_sent = 0;
    return send_some(client);
}

static bool refuse(struct shef_control_client *client, const struct shef_error *err)
{
    return answer_with(client, shef_control_refusal(err, client->ends));
}

/* An argument with a slip in its name would be left out in silence. */
static enum shef_err check_arguments(const struct shef_control_command *command, json_t *arguments,
                                     struct shef_error *err)
{
    const char *list = command->arguments ? command->arguments : "";
    const char *name;
    json_t *value;

    json_object_foreach(arguments, name, value)
    {
        char word[SHEF_CONTROL_NAME_BYTES];
        bool is_known = false;

        (void)value;
        for (int32_t i = 0; shef_words_at(list, i, word, sizeof word); i++)
            is_known = is_known || strcmp(word, name) == 0;
        if (!is_known)
            return shef_fail(err, SHEF_ERR_INVALID, "%s: there is no argument '%.40s'; it takes %s",
                             command->name, name, *list ? list : "none");
    }
    return SHEF_OK;
}

static enum shef_err find_and_call(struct shef_control_client *client,
                                   const struct shef_control_request *request, json_t *answer,
                                   struct shef_error *err)
{
    void *context = NULL;
    const struct shef_control_command *command =
        shef_control_find(client->control, request->command, &context);
    enum shef_err code;

    if (!answer)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "answer a request: out of memory");
    if (!command)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "there is no command '%s'; 'help' lists those there are",
                         request->command);
    code = check_arguments(command, request->arguments, err);
    return code == SHEF_OK ? command->handler(context, request->arguments, answer, err) : code;
}

static bool run_command(struct shef_control_client *client,
                        const struct shef_control_request *request)
{
    struct shef_error err = { 0 };
    json_t *answer = json_object();
    bool alive;

    if (find_and_call(client, request, answer, &err) == SHEF_OK)
        alive = answer_with(client, shef_control_answer(answer));
    else
        alive = refuse(client, &err);
    json_decref(answer);
    return alive;
}

/* A second's requests are counted, so that no client keeps the thread for itself. */
static bool is_too_fast(struct shef_control_client *client)
{
    const shef_host_time now = shef_clock_now(client->clock);

    if (shef_host_time_since(now, client->second) >= SHEF_NS_PER_S) {
        client->second = now;
        client->n_in_second = 0;
    }
    return ++client->n_in_second > SHEF_CONTROL_REQUESTS_PER_S;
}

static bool handle_line(struct shef_control_client *client, const char *line, size_t n_bytes)
{
    struct shef_control_request request;
    struct shef_error err = { 0 };
    bool alive;

    if (is_too_fast(client)) {
        (void)shef_fail(&err, SHEF_ERR_FULL, "more than %d requests in a second",
                        SHEF_CONTROL_REQUESTS_PER_S);
        client->ends = true;
        return refuse(client, &err);
    }
    if (shef_control_request_parse(line, n_bytes, &request, &err) != SHEF_OK) {
        /* What is no JSON has no reliable end of line either. */
        client->ends = err.code == SHEF_ERR_FORMAT;
        return refuse(client, &err);
    }
    alive = run_command(client, &request);
    json_decref(request.arguments);
    return alive;
}

/* Handles the first whole line, if there is one. False: the client is gone. */
static bool handle_received(struct shef_control_client *client)
{
    char *end = memchr(client->received, '\n', client->n_received);
    struct shef_error err;

    if (end) {
        const size_t n_line = (size_t)(end - client->received);
        const bool alive = handle_line(client, client->received, n_line);

        client->last_done = shef_clock_now(client->clock);
        client->n_received -= n_line + 1;
        memmove(client->received, end + 1, client->n_received);
        return alive;
    }
    if (client->n_received < sizeof client->received)
        return true;
    (void)shef_fail(&err, SHEF_ERR_INVALID, "the request is longer than %d bytes",
                    SHEF_CONTROL_REQUEST_BYTES);
    client->ends = true;
    return refuse(client, &err);
}

/* The client has said all it has to say. False: it is gone. */
static bool hear_the_end(struct shef_control_client *client)
{
    struct shef_error err;

    if (client->n_received == 0)
        return false;
    (void)shef_fail(&err, SHEF_ERR_FORMAT,
                    "the request has no end: %zu bytes came, but no newline behind them",
                    client->n_received);
    client->n_received = 0;
    client->ends = true;
    return refuse(client, &err);
}

static bool receive(struct shef_control_client *client)
{
    const ssize_t n = recv(client->watch.fd, client->received + client->n_received,
                           sizeof client->received - client->n_received, MSG_DONTWAIT);

    if (n < 0)
        return errno == EAGAIN || errno == EINTR;
    if (n == 0)
        return hear_the_end(client);
    client->n_received += (size_t)n;
    return true;
}

static bool has_line(const struct shef_control_client *client)
{
    return memchr(client->received, '\n', client->n_received) != NULL;
}

static void on_client(void *context, uint32_t events)
{
    struct shef_control_client *client = context;
    bool alive = (events & EPOLLERR) == 0;

    if (alive && client->answer)
        alive = send_some(client);
    /* One request a turn: the others get theirs in between. */
    if (alive && !client->answer && !client->ends) {
        if (!has_line(client) && (events & (EPOLLIN | EPOLLHUP)))
            alive = receive(client);
        if (alive && !client->ends)
            alive = handle_received(client);
    }
    if (!alive || (client->ends && !client->answer)) {
        shef_control_drop(client->control, client);
        return;
    }
    /* While an answer is on its way, or a whole request waits here, wait for room to write:
     * the second comes back at once, after the others had their turn. */
    shef_loop_change(client->loop, &client->watch,
                     client->answer || has_line(client) ? EPOLLOUT : EPOLLIN);
}

struct shef_control_client *shef_control_client_create(struct shef_control *control,
                                                       struct shef_loop *loop,
                                                       const struct shef_clock *clock, int fd,
                                                       struct shef_error *err)
{
    struct shef_control_client *client = calloc(1, sizeof *client);

    if (!client) {
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "control: out of memory for one more client");
        return NULL;
    }
    client->control = control;
    client->loop = loop;
    client->clock = clock;
    client->watch = (struct shef_loop_watch){ fd, on_client, client };
    client->last_done = shef_clock_now(clock);
    client->second = client->last_done;
    if (shef_loop_watch(loop, &client->watch, EPOLLIN, err) != SHEF_OK) {
        free(client);
        return NULL;
    }
    return client;
}

void shef_control_client_destroy(struct shef_control_client *client)
{
    shef_loop_unwatch(client->loop, &client->watch);
    close(client->watch.fd);
    free(client->answer);
    free(client);
}
