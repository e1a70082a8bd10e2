/* What `cmake --install` puts where, and what systemd says about it. */
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/file.h"
#include "support/support.h"

static char build[PATH_MAX]; /* the build folder this test lies in */
static char prefix[PATH_MAX];
static char output[65536];

/* Runs a shell's line and keeps what it prints. */
static int run(const char *line)
{
    FILE *pipe = popen(line, "r");
    size_t n;
    int status;

    TEST_ASSERT_NOT_NULL(pipe);
    n = fread(output, 1, sizeof output - 1, pipe);
    output[n] = '\0';
    status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void find_build(void)
{
    ssize_t n = readlink("/proc/self/exe", build, sizeof build - 1);

    TEST_ASSERT_GREATER_THAN_INT(0, (int)n);
    build[n] = '\0';
    for (int i = 0; i < 2; i++)
        *strrchr(build, '/') = '\0';
}

static void find_prefix(void)
{
    char line[PATH_MAX + 128];

    snprintf(line, sizeof line,
             "sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' '%s/CMakeCache.txt' | tr -d '\\n'", build);
    TEST_ASSERT_EQUAL_INT(0, run(line));
    snprintf(prefix, sizeof prefix, "%.1000s", output);
    TEST_ASSERT_EQUAL_CHAR('/', prefix[0]);
}

static void install_to(const char *folder)
{
    char line[2 * PATH_MAX + 128];

    snprintf(line, sizeof line, "DESTDIR='%s' cmake --install '%s' 2>&1", folder, build);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(line), output);
}

static char root[PATH_MAX]; /* what everything is installed into */

static void expect_installed(const char *below_prefix, mode_t mode)
{
    char path[3 * PATH_MAX];
    struct stat info;

    snprintf(path, sizeof path, "%s%s%s", root, strncmp(below_prefix, "/etc", 4) == 0 ? "" : prefix,
             below_prefix);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, stat(path, &info), path);
    TEST_ASSERT_EQUAL_HEX_MESSAGE(mode, info.st_mode & 0777, path);
    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, (int)info.st_size, path);
}

static const char *const installed[] = {
    "/lib/systemd/system/shefd.service",
    "/lib/sysusers.d/shef.conf",
    "/lib/sysctl.d/60-shef-lcm.conf",
    "/etc/shef/shefd.yaml",
    "/share/man/man1/sheftool.1",
    "/share/man/man1/shefctl.1",
    "/share/doc/shef/copyright",
    "/share/doc/shef/control.md",
    "/share/doc/shef/examples/subscriber.c",
    "/share/man/man8/shefd.8",
    "/share/man/man5/shefd.yaml.5",
    "/share/doc/shef/control.md",
    "/share/doc/shef/accuracy/modes.svg",
    "/share/doc/shef/recording.md",
    "/share/doc/shef/calibration.example.yaml",
};

static void test_everything_lands_where_debian_expects_it(void)
{
    expect_installed("/sbin/shefd", 0755);
    expect_installed("/bin/shefctl", 0755);
    expect_installed("/bin/sheftool", 0755);
    expect_installed("/bin/shefsim", 0755);
    for (size_t i = 0; i < sizeof installed / sizeof installed[0]; i++)
        expect_installed(installed[i], 0644);
}

static void test_edited_settings_survive_a_second_installation(void)
{
    char path[2 * PATH_MAX];
    uint8_t *bytes;
    size_t n_bytes;

    snprintf(path, sizeof path, "%s/etc/shef/shefd.yaml", root);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "depth:\n", 7, NULL));
    install_to(root);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 20, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_STRING("depth:\n", (char *)bytes);
    free(bytes);
}

static void test_the_installed_program_starts(void)
{
    char line[3 * PATH_MAX];

    snprintf(line, sizeof line, "'%s%s/sbin/shefd' --version", root, prefix);
    TEST_ASSERT_EQUAL_INT(0, run(line));
    TEST_ASSERT_EQUAL_INT(0, strncmp(output, "shefd ", 6));
    snprintf(line, sizeof line, "'%s%s/sbin/shefd' --check-config -c '%s/config/shefd.yaml'", root,
             prefix, shef_test_source("."));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(line), output);
}

static void need_systemd_analyze(void)
{
    if (run("systemd-analyze --version 2>&1") != 0)
        TEST_IGNORE_MESSAGE("there is no systemd-analyze on this machine");
}

/* A unit names a program that only exists once it is installed: here the copy in the build
 * folder stands for it. */
static void write_checkable_unit(char *out_path, size_t n_bytes)
{
    char line[6 * PATH_MAX];

    snprintf(out_path, n_bytes, "%s/shefd.service", shef_test_temp_folder());
    snprintf(line, sizeof line,
             "sed 's|^\\(Exec[A-Za-z]*=\\)[^ ]*/shefd|\\1%s/bin/shefd|' "
             "'%s%s/lib/systemd/system/shefd.service' > '%s'",
             build, root, prefix, out_path);
    TEST_ASSERT_EQUAL_INT(0, run(line));
}

static void test_systemd_finds_no_fault_in_the_unit(void)
{
    char path[PATH_MAX + 32];
    char line[2 * PATH_MAX];

    need_systemd_analyze();
    write_checkable_unit(path, sizeof path);
    snprintf(line, sizeof line, "systemd-analyze verify --man=no '%s' 2>&1", path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(line), output);
    TEST_ASSERT_EQUAL_STRING("", output);
}

/* `systemctl reload` only says how its commands ended, and a signal always ends well. */
static void test_a_reload_looks_at_the_settings_first(void)
{
    char line[3 * PATH_MAX];

    snprintf(line, sizeof line, "grep '^ExecReload=' '%s%s/lib/systemd/system/shefd.service'", root,
             prefix);
    TEST_ASSERT_EQUAL_INT(0, run(line));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(output, "/shefd --check-config\nExecReload=/bin/kill -HUP"),
                                 output);
}

static void test_the_unit_is_as_closed_as_the_documentation_says(void)
{
    char path[PATH_MAX + 32];
    char line[2 * PATH_MAX];

    need_systemd_analyze();
    write_checkable_unit(path, sizeof path);
    /* docs/service.md says 1.5; other versions of systemd weigh a little differently. */
    snprintf(line, sizeof line,
             "systemd-analyze security --no-pager --offline=yes --threshold=20 '%s' 2>&1 | "
             "grep Overall",
             path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(line), output);
    printf("%s", output);
    snprintf(line, sizeof line,
             "systemd-analyze security --no-pager --offline=yes --threshold=20 '%s' 2>&1 "
             ">/dev/null",
             path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(line), output);
}

int main(void)
{
    UNITY_BEGIN();
    find_build();
    find_prefix();
    snprintf(root, sizeof root, "%s", shef_test_temp_path("root"));
    install_to(root);
    RUN_TEST(test_everything_lands_where_debian_expects_it);
    RUN_TEST(test_edited_settings_survive_a_second_installation);
    RUN_TEST(test_the_installed_program_starts);
    RUN_TEST(test_systemd_finds_no_fault_in_the_unit);
    RUN_TEST(test_a_reload_looks_at_the_settings_first);
    RUN_TEST(test_the_unit_is_as_closed_as_the_documentation_says);
    return UNITY_END();
}
