#include "support/small_disk.h"

#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "support/namespaces.h"
#include "support/support.h"

#define NO_MOUNT 77

void shef_test_on_small_disk(const char *name, const char *size, void run(const char *folder))
{
    char mount_point[4200];
    char folder[4300];
    char options[32];
    int status;

    snprintf(mount_point, sizeof mount_point, "%s", shef_test_temp_path(name));
    snprintf(folder, sizeof folder, "%s/recording", mount_point);
    snprintf(options, sizeof options, "size=%s", size);
    TEST_ASSERT_EQUAL_INT(0, mkdir(mount_point, 0777));

    const pid_t pid = fork();

    TEST_ASSERT_TRUE(pid >= 0);
    if (pid == 0) {
        if (!shef_test_enter_namespaces(CLONE_NEWNS) ||
            mount("none", mount_point, "tmpfs", 0, options) != 0)
            _exit(NO_MOUNT);
        run(folder);
        _exit(0);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == NO_MOUNT)
        TEST_IGNORE_MESSAGE("this user may not mount a small file system to fill");
    TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
}
