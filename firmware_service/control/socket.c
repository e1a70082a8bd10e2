#include "control/socket.h"

#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/log.h"

#define BACKLOG 16

/* Whether the path still leads to the file that is open, and not to one made since. */
static bool is_still_there(int fd, const char *path)
{
    struct stat open_file, named_file;

    return fstat(fd, &open_file) == 0 && stat(path, &named_file) == 0 &&
           open_file.st_dev == named_file.st_dev && open_file.st_ino == named_file.st_ino;
}

static enum shef_err fail_locked(const struct shef_control_socket *socket, int fd,
                                 struct shef_error *err)
{
    char pid[16] = "";
    const ssize_t n = pread(fd, pid, sizeof pid - 1, 0);

    pid[n > 0 ? strcspn(pid, "\n") : 0] = '\0';
    return shef_fail(err, SHEF_ERR_FULL,
                     "another shefd (process %s) serves '%s'; stop it first, or give this one a "
                     "control.socket of its own",
                     *pid ? pid : "unknown", socket->path);
}

static enum shef_err fail_to_open_lock(const struct shef_control_socket *socket, int os_errno,
                                       struct shef_error *err)
{
    struct stat info;

    if (os_errno == EACCES && lstat(socket->lock_path, &info) == 0)
        return shef_fail(err, SHEF_ERR_FULL,
                         "control socket '%s': its lock '%s' belongs to user %u; if no shefd of "
                         "that user runs any more, remove both, otherwise give this one a "
                         "control.socket of its own",
                         socket->path, socket->lock_path, (unsigned)info.st_uid);
    return shef_fail_os(err, os_errno,
                        "control socket '%s': create its lock (its folder must be there and "
                        "writable for this user; see control.socket)",
                        socket->path);
}

/* Takes PATH.lock. It is removed at a clean end, so a starter may have opened one that is gone
 * by the time it is locked: then the next round finds the new one. */
static enum shef_err lock(struct shef_control_socket *socket, struct shef_error *err)
{
    for (;;) {
        /* For this user only: whoever can open it can hold it against the next start. */
        const int fd = open(socket->lock_path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);

        if (fd < 0)
            return fail_to_open_lock(socket, errno, err);
        if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
            const enum shef_err code =
                errno == EWOULDBLOCK
                    ? fail_locked(socket, fd, err)
                    : shef_fail_os(err, errno, "control socket '%s': lock it", socket->path);

            close(fd);
            return code;
        }
        if (is_still_there(fd, socket->lock_path)) {
            if (ftruncate(fd, 0) != 0 || dprintf(fd, "%d\n", (int)getpid()) < 0)
                shef_log(SHEF_LOG_DEBUG, "the lock '%s' does not say whose it is",
                         socket->lock_path);
            socket->lock_fd = fd;
            return SHEF_OK;
        }
        close(fd);
    }
}

/* We hold the lock, so a socket at the path is one that a dead service left. */
static enum shef_err remove_stale(const char *path, struct shef_error *err)
{
    struct stat info;

    if (lstat(path, &info) != 0)
        return errno == ENOENT ? SHEF_OK : shef_fail_os(err, errno, "control socket '%s'", path);
    if (!S_ISSOCK(info.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "control socket '%s': something that is no socket is there; remove it or "
                         "choose another control.socket",
                         path);
    if (unlink(path) != 0)
        return shef_fail_os(err, errno, "control socket '%s': remove the one left behind", path);
    return SHEF_OK;
}

static enum shef_err listen_at(struct shef_control_socket *control_socket, gid_t group,
                               struct shef_error *err)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const char *path = control_socket->path;

    memcpy(address.sun_path, path, strlen(path) + 1); /* the caller has checked its length */
    control_socket->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (control_socket->fd < 0)
        return shef_fail_os(err, errno, "open the control socket '%s'", path);

    const mode_t earlier = umask(0117); /* 0660 from the first moment on */
    const int bound = bind(control_socket->fd, (const struct sockaddr *)&address, sizeof address);
    const int bind_errno = errno;

    umask(earlier);
    if (bound != 0)
        return shef_fail_os(err, bind_errno, "create the control socket '%s'", path);
    if (group != SHEF_CONTROL_NO_GROUP && group != getegid() && lchown(path, (uid_t)-1, group) != 0)
        shef_log(SHEF_LOG_INFO,
                 "control socket '%s': its group cannot be set, so root and this user only can "
                 "connect: %s",
                 path, strerror(errno));
    if (listen(control_socket->fd, BACKLOG) != 0)
        return shef_fail_os(err, errno, "listen at the control socket '%s'", path);
    return SHEF_OK;
}

enum shef_err shef_control_socket_open(const char *path, gid_t group,
                                       struct shef_control_socket *out_socket,
                                       struct shef_error *err)
{
    struct shef_control_socket opened = { .fd = -1, .lock_fd = -1 };
    const size_t longest = sizeof((struct sockaddr_un *)0)->sun_path - 1;
    enum shef_err code;

    if (strlen(path) > longest)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "control socket '%s': the path is longer than the %zu bytes that the "
                         "system allows for sockets",
                         path, longest);
    snprintf(opened.path, sizeof opened.path, "%s", path);
    snprintf(opened.lock_path, sizeof opened.lock_path, "%s.lock", path);
    code = lock(&opened, err);
    if (code == SHEF_OK)
        code = remove_stale(path, err);
    if (code == SHEF_OK)
        code = listen_at(&opened, group, err);
    if (code != SHEF_OK) {
        shef_control_socket_close(&opened);
        return code;
    }
    *out_socket = opened;
    return SHEF_OK;
}

void shef_control_socket_close(struct shef_control_socket *socket)
{
    if (socket->fd >= 0) {
        unlink(socket->path);
        close(socket->fd);
    }
    if (socket->lock_fd >= 0) {
        unlink(socket->lock_path);
        close(socket->lock_fd);
    }
    socket->fd = -1;
    socket->lock_fd = -1;
}

gid_t shef_control_group(const char *name)
{
    const struct group *group = *name ? getgrnam(name) : NULL;

    return group ? group->gr_gid : SHEF_CONTROL_NO_GROUP;
}

/* The kernel's word on the peer's supplementary groups (Linux 4.13 and later). */
static bool has_supplementary(int fd, gid_t group)
{
    socklen_t n_bytes = 0;
    bool found = false;
    gid_t *groups;

    if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, NULL, &n_bytes) == 0 || errno != ERANGE)
        return false;
    groups = malloc(n_bytes);
    if (groups && getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups, &n_bytes) == 0)
        for (size_t i = 0; i < n_bytes / sizeof groups[0]; i++)
            found = found || groups[i] == group;
    free(groups);
    return found;
}

enum shef_err shef_control_peer_of(int fd, gid_t group, struct shef_control_peer *out_peer,
                                   struct shef_error *err)
{
    struct ucred credentials;
    socklen_t n_bytes = sizeof credentials;

    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &n_bytes) != 0)
        return shef_fail_os(err, errno, "ask who is at the other end of the control socket");
    *out_peer = (struct shef_control_peer){ .uid = credentials.uid,
                                            .gid = credentials.gid,
                                            .pid = credentials.pid };
    out_peer->in_group = group != SHEF_CONTROL_NO_GROUP &&
                         (credentials.gid == group || has_supplementary(fd, group));
    return SHEF_OK;
}

bool shef_control_is_allowed(const struct shef_control_peer *peer, uid_t own_uid)
{
    return peer->uid == 0 || peer->uid == own_uid || peer->in_group;
}
