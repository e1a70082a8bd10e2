/* The control socket as a file: one service only, and who may talk to it.
 * Thread: setup; allowed() and credentials: control. */
#ifndef SHEF_CONTROL_SOCKET_H
#define SHEF_CONTROL_SOCKET_H

#include <stdbool.h>
#include <sys/types.h>

#include "config/config.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CONTROL_NO_GROUP ((gid_t)-1)

struct shef_control_socket {
    int fd;      /* listening; -1: closed */
    int lock_fd; /* PATH.lock, held while the service lives; -1: none */
    char path[SHEF_CONFIG_PATH_BYTES];
    char lock_path[SHEF_CONFIG_PATH_BYTES + 8];
};

/* Locks, replaces a socket that a dead service left, and listens. The socket's mode is 0660 and
 * its group is `group`, where that may be set.
 *   group  members may connect, or SHEF_CONTROL_NO_GROUP
 * SHEF_ERR_FULL: another service, or another user, holds it. SHEF_ERR_INVALID: the path is too long
 * for a socket, or something else is there. SHEF_ERR_NOT_FOUND, PERMISSION, IO: the folder. */
SHEF_MUST_CHECK enum shef_err shef_control_socket_open(const char *path, gid_t group,
                                                       struct shef_control_socket *out_socket,
                                                       struct shef_error *err);

/* Removes socket and lock. A closed one, with both descriptors -1, is allowed. */
void shef_control_socket_close(struct shef_control_socket *socket);

/* The number of a group by name; SHEF_CONTROL_NO_GROUP for "" and for a group that is not there. */
gid_t shef_control_group(const char *name);

/* Who is at the other end, as the kernel says. */
struct shef_control_peer {
    uid_t uid;
    gid_t gid;
    pid_t pid;
    bool in_group; /* gid or one of the supplementary groups is the allowed one */
};

SHEF_MUST_CHECK enum shef_err shef_control_peer_of(int fd, gid_t group,
                                                   struct shef_control_peer *out_peer,
                                                   struct shef_error *err);

/* root, the service's own user, and members of the group may. */
bool shef_control_is_allowed(const struct shef_control_peer *peer, uid_t own_uid);

#ifdef __cplusplus
}
#endif

#endif
