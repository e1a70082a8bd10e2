#include "control/socket.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support/support.h"

static struct shef_control_socket first, second;
static struct shef_error err;

void setUp(void)
{
    first = second = (struct shef_control_socket){ .fd = -1, .lock_fd = -1 };
}

void tearDown(void)
{
    shef_control_socket_close(&first);
    shef_control_socket_close(&second);
}

static enum shef_err open_at(const char *path, struct shef_control_socket *out_socket)
{
    memset(&err, 0, sizeof err);
    return shef_control_socket_open(path, SHEF_CONTROL_NO_GROUP, out_socket, &err);
}

static int connect_to(const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);

    TEST_ASSERT_LESS_THAN_size_t(sizeof address.sun_path, strlen(path));
    memcpy(address.sun_path, path, strlen(path) + 1);
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
        return fd;
    close(fd);
    return -1;
}

static void test_an_open_socket_takes_connections_and_leaves_nothing(void)
{
    const char *path = shef_test_temp_path("s");
    struct stat info;
    int fd;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, open_at(path, &first), err.text);
    TEST_ASSERT_EQUAL_INT(0, stat(path, &info));
    TEST_ASSERT_EQUAL_INT(0660, info.st_mode & 0777);
    /* Who could open it could hold it when this service has died. */
    TEST_ASSERT_EQUAL_INT(0, stat(shef_test_temp_path("s.lock"), &info));
    TEST_ASSERT_EQUAL_INT(0600, info.st_mode & 0777);
    fd = connect_to(path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    close(fd);
    shef_control_socket_close(&first);
    TEST_ASSERT_EQUAL_INT(0, shef_test_temp_count());
}

static void test_a_second_service_is_refused_and_the_first_goes_on(void)
{
    const char *path = shef_test_temp_path("s");
    char pid[32];
    int fd;

    TEST_ASSERT_EQUAL(SHEF_OK, open_at(path, &first));
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, open_at(path, &second));
    snprintf(pid, sizeof pid, "process %d", (int)getpid());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "another shefd"), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, pid), err.text);
    fd = connect_to(path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    close(fd);
}

static void test_a_socket_left_by_a_dead_service_is_replaced(void)
{
    const char *path = shef_test_temp_path("s");
    int status, fd;
    const pid_t pid = fork();

    if (pid == 0) {
        /* Dies without closing, as after a crash. */
        _exit(open_at(path, &first) == SHEF_OK ? 0 : 1);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
    TEST_ASSERT_EQUAL_INT(2, shef_test_temp_count());
    TEST_ASSERT_EQUAL_INT(-1, connect_to(path));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, open_at(path, &first), err.text);
    fd = connect_to(path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    close(fd);
}

static int try_as_nobody(const char *path)
{
    char user[32];

    snprintf(user, sizeof user, "belongs to user %u", (unsigned)geteuid());
    if (setuid(65534) != 0)
        return 2;
    if (open_at(path, &second) != SHEF_ERR_FULL)
        return 3;
    return strstr(err.text, user) && strstr(err.text, "control.socket of its own") ? 0 : 4;
}

static void test_the_lock_of_another_user_is_named(void)
{
    const char *path = shef_test_temp_path("s");
    int status;
    pid_t pid;

    if (geteuid() != 0)
        TEST_IGNORE_MESSAGE("only root can try to be somebody else");
    TEST_ASSERT_EQUAL_INT(0, chmod(shef_test_temp_folder(), 01777));
    TEST_ASSERT_EQUAL(SHEF_OK, open_at(path, &first));
    pid = fork();
    if (pid == 0)
        _exit(try_as_nobody(path));
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
}

static void test_something_else_at_the_path_is_kept(void)
{
    const char *path = shef_test_temp_path("precious");
    FILE *file = fopen(path, "w");

    TEST_ASSERT_NOT_NULL(file);
    fclose(file);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, open_at(path, &first));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "no socket is there"), err.text);
    TEST_ASSERT_EQUAL_INT(0, access(path, F_OK));
    TEST_ASSERT_EQUAL_INT(1, shef_test_temp_count());
    unlink(path);
}

static void test_a_folder_that_is_not_there_or_not_writable_is_one_sentence(void)
{
    const char *path = shef_test_temp_path("none/s");

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, open_at(path, &first));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, path), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "must be there and writable"), err.text);
    if (geteuid() == 0) {
        int status;
        const pid_t pid = fork();

        if (pid == 0) {
            const bool refused = setuid(65534) == 0 &&
                                 open_at("/shefd.sock", &first) == SHEF_ERR_PERMISSION &&
                                 strstr(err.text, "must be there and writable");

            _exit(refused ? 0 : 1);
        }
        TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
        TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
    } else {
        TEST_ASSERT_EQUAL(SHEF_ERR_PERMISSION, open_at("/shefd.sock", &first));
    }
}

static void test_a_path_too_long_for_a_socket_is_refused(void)
{
    char path[200];

    snprintf(path, sizeof path, "/tmp/%0150d", 0);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, open_at(path, &first));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "107 bytes"), err.text);
}

static void test_root_the_own_user_and_the_group_are_allowed_and_nobody_else(void)
{
    const uid_t own = 900;

    TEST_ASSERT_TRUE(shef_control_is_allowed(&(struct shef_control_peer){ .uid = 0 }, own));
    TEST_ASSERT_TRUE(shef_control_is_allowed(&(struct shef_control_peer){ .uid = 900 }, own));
    TEST_ASSERT_TRUE(
        shef_control_is_allowed(&(struct shef_control_peer){ .uid = 1000, .in_group = true }, own));
    TEST_ASSERT_FALSE(shef_control_is_allowed(&(struct shef_control_peer){ .uid = 1000 }, own));
    TEST_ASSERT_FALSE(
        shef_control_is_allowed(&(struct shef_control_peer){ .uid = 1000, .gid = 0 }, own));
}

static void test_the_kernel_says_who_is_at_the_other_end(void)
{
    struct shef_control_peer peer;
    int pair[2];

    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM, 0, pair));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_peer_of(pair[0], getgid(), &peer, &err));
    TEST_ASSERT_EQUAL_UINT(getuid(), peer.uid);
    TEST_ASSERT_EQUAL_INT(getpid(), peer.pid);
    TEST_ASSERT_TRUE(peer.in_group);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_peer_of(pair[0], SHEF_CONTROL_NO_GROUP, &peer, &err));
    TEST_ASSERT_FALSE(peer.in_group);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_peer_of(pair[0], 54321, &peer, &err));
    TEST_ASSERT_FALSE(peer.in_group);
    close(pair[0]);
    close(pair[1]);
}

static void test_groups_are_found_by_name(void)
{
    TEST_ASSERT_EQUAL_UINT(0, shef_control_group("root"));
    TEST_ASSERT_EQUAL_UINT(SHEF_CONTROL_NO_GROUP, shef_control_group("no-such-group"));
    TEST_ASSERT_EQUAL_UINT(SHEF_CONTROL_NO_GROUP, shef_control_group(""));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_open_socket_takes_connections_and_leaves_nothing);
    RUN_TEST(test_a_second_service_is_refused_and_the_first_goes_on);
    RUN_TEST(test_a_socket_left_by_a_dead_service_is_replaced);
    RUN_TEST(test_the_lock_of_another_user_is_named);
    RUN_TEST(test_something_else_at_the_path_is_kept);
    RUN_TEST(test_a_folder_that_is_not_there_or_not_writable_is_one_sentence);
    RUN_TEST(test_a_path_too_long_for_a_socket_is_refused);
    RUN_TEST(test_root_the_own_user_and_the_group_are_allowed_and_nobody_else);
    RUN_TEST(test_the_kernel_says_who_is_at_the_other_end);
    RUN_TEST(test_groups_are_found_by_name);
    return UNITY_END();
}
