#include "support/namespaces.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include "support/support.h"

static bool write_text(const char *path, const char *text)
{
    const int fd = open(path, O_WRONLY | O_CLOEXEC);

    if (fd < 0)
        return false;

    const bool is_written = write(fd, text, strlen(text)) == (ssize_t)strlen(text);

    close(fd);
    return is_written;
}

/* Without a map, files made inside have no owner and the kernel refuses to make them. */
static bool become_root_inside(uid_t user, gid_t group)
{
    char user_map[64];
    char group_map[64];

    snprintf(user_map, sizeof user_map, "0 %u 1", user);
    snprintf(group_map, sizeof group_map, "0 %u 1", group);
    return write_text("/proc/self/uid_map", user_map) &&
           write_text("/proc/self/setgroups", "deny") &&
           write_text("/proc/self/gid_map", group_map);
}

bool shef_test_enter_namespaces(int flags)
{
    const uid_t user = geteuid();
    const gid_t group = getegid();

    if (unshare(flags) != 0 &&
        (unshare(CLONE_NEWUSER | flags) != 0 || !become_root_inside(user, group)))
        return false;
    return (flags & CLONE_NEWNS) == 0 || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) == 0;
}

void shef_test_set_loopback(bool is_up)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    struct ifreq request = { .ifr_flags = (short)(is_up ? IFF_UP | IFF_RUNNING : 0) };

    strcpy(request.ifr_name, "lo");
    TEST_ASSERT_EQUAL_INT(0, ioctl(fd, SIOCSIFFLAGS, &request));
    close(fd);
}

void shef_test_add_route(const char *to)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    char device[] = "lo";
    struct rtentry route = { .rt_flags = RTF_UP | RTF_HOST, .rt_dev = device };
    struct sockaddr_in address = { .sin_family = AF_INET };

    TEST_ASSERT_EQUAL_INT(1, inet_pton(AF_INET, to, &address.sin_addr));
    memcpy(&route.rt_dst, &address, sizeof address);
    TEST_ASSERT_EQUAL_INT(0, ioctl(fd, SIOCADDRT, &route));
    close(fd);
}
