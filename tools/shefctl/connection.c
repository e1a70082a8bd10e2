#include "shefctl/connection.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#define MAX_ANSWER_BYTES ((size_t)64 << 20)

static enum shef_ctl_status fail_connect(const char *path, int os_errno, struct shef_error *err)
{
    if (os_errno == EACCES || os_errno == EPERM) {
        (void)shef_fail(err, SHEF_ERR_PERMISSION,
                        "'%s': this user may not talk to shefd; members of its control.group "
                        "may ('adduser %s shef', then log in again)",
                        path, getenv("USER") ? getenv("USER") : "NAME");
        return SHEF_CTL_REFUSED;
    }
    if (os_errno == ENOENT || os_errno == ECONNREFUSED)
        (void)shef_fail(err, SHEF_ERR_NOT_FOUND,
                        "no shefd serves '%s'; start it ('systemctl start shefd'), or name its "
                        "socket with --socket",
                        path);
    else if (os_errno == EAGAIN)
        (void)shef_fail(
            err, SHEF_ERR_TIMEOUT,
            "shefd at '%s' has taken no connection for %d s; it hangs, or too many want "
            "something of it",
            path, SHEF_CTL_TIMEOUT_S);
    else
        (void)shef_fail_os(err, os_errno, "connect to shefd at '%s'", path);
    return SHEF_CTL_UNREACHABLE;
}

static enum shef_ctl_status connect_to(const char *path, int *out_fd, struct shef_error *err)
{
    const struct timeval timeout = { .tv_sec = SHEF_CTL_TIMEOUT_S };
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);

    if (fd < 0)
        return fail_connect(path, errno, err);
    if (strlen(path) >= sizeof address.sun_path) {
        close(fd);
        return fail_connect(path, ENAMETOOLONG, err);
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        const int os_errno = errno;

        close(fd);
        return fail_connect(path, os_errno, err);
    }
    *out_fd = fd;
    return SHEF_CTL_OK;
}

/* A refusal may already wait for us while we send, so failing to send is not the end. */
static void send_request(int fd, const char *command, json_t *arguments)
{
    json_t *request = json_pack("{s:s}", "command", command);
    char *text;

    if (arguments)
        json_object_set(request, "arguments", arguments);
    text = json_dumps(request, JSON_COMPACT);
    json_decref(request);
    for (size_t sent = 0, n = text ? strlen(text) : 0; sent < n;) {
        const ssize_t n_now = send(fd, text + sent, n - sent, MSG_NOSIGNAL);

        if (n_now < 0)
            break;
        sent += (size_t)n_now;
    }
    if (send(fd, "\n", 1, MSG_NOSIGNAL) < 0)
        shutdown(fd, SHUT_WR);
    free(text);
}

/* Reads one line. NULL: none came; err says why. */
static char *read_line(int fd, struct shef_error *err)
{
    size_t n_read = 0, capacity = 65536;
    char *line = malloc(capacity + 1);

    while (line) {
        ssize_t n;

        if (n_read == capacity) {
            char *larger = capacity < MAX_ANSWER_BYTES ? realloc(line, 2 * capacity + 1) : NULL;

            if (!larger)
                break;
            line = larger;
            capacity *= 2;
        }
        n = recv(fd, line + n_read, capacity - n_read, 0);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            if (n < 0 && errno == EAGAIN)
                (void)shef_fail(err, SHEF_ERR_TIMEOUT, "shefd has not answered for %d s",
                                SHEF_CTL_TIMEOUT_S);
            else
                (void)shef_fail(err, SHEF_ERR_GONE,
                                "shefd closed the connection without an "
                                "answer");
            free(line);
            return NULL;
        }
        n_read += (size_t)n;
        if (line[n_read - 1] == '\n') {
            line[n_read] = '\0';
            return line;
        }
    }
    free(line);
    (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "shefd's answer is too large");
    return NULL;
}

/* The class of a refusal in the answer. */
static enum shef_ctl_status take_refusal(const json_t *root, struct shef_error *err)
{
    const json_t *error = json_object_get(root, "error");
    const char *code = json_string_value(json_object_get(error, "code"));
    const char *text = json_string_value(json_object_get(error, "text"));

    if (!code || !text) {
        (void)shef_fail(err, SHEF_ERR_FORMAT, "this is no answer of shefd; is it another program?");
        return SHEF_CTL_FAILED;
    }
    (void)shef_fail(err, shef_err_of_name(code), "%s", text);
    return json_is_true(json_object_get(error, "closes")) &&
                   (err->code == SHEF_ERR_PERMISSION || err->code == SHEF_ERR_FULL)
               ? SHEF_CTL_REFUSED
               : SHEF_CTL_FAILED;
}

enum shef_ctl_status shef_ctl_ask(const char *socket_path, const char *command, json_t *arguments,
                                  json_t **out_answer, struct shef_error *err)
{
    int fd = -1;
    char *line;
    json_t *root;
    json_t *answer;
    enum shef_ctl_status status = connect_to(socket_path, &fd, err);

    if (status != SHEF_CTL_OK)
        return status;
    send_request(fd, command, arguments);
    line = read_line(fd, err);
    close(fd);
    if (!line)
        return SHEF_CTL_UNREACHABLE;
    root = json_loads(line, 0, NULL);
    free(line);
    answer = json_object_get(root, "answer");
    if (json_is_true(json_object_get(root, "ok")) && json_is_object(answer))
        *out_answer = json_incref(answer);
    else
        status = take_refusal(root, err);
    json_decref(root);
    return status;
}
