/* The real shefd and the real shefctl, as ordinary programs. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/file.h"
#include "support/process.h"
#include "support/support.h"

static struct shef_test_process daemon_process;
static struct shef_test_process other;
static char config_path[512];
static char socket_path[512];

void setUp(void)
{
    snprintf(config_path, sizeof config_path, "%s", shef_test_temp_path("shefd.yaml"));
    snprintf(socket_path, sizeof socket_path, "%s", shef_test_temp_path("s"));
    memset(&daemon_process, 0, sizeof daemon_process);
    memset(&other, 0, sizeof other);
}

void tearDown(void)
{
    if (daemon_process.pid != 0)
        shef_test_process_end(&daemon_process, SIGKILL);
    /* A killed one leaves its socket and the lock beside it. */
    unlink(config_path);
    unlink(socket_path);
    unlink(shef_test_temp_path("s.lock"));
}

static void write_config(const char *more)
{
    char text[1024];

    snprintf(text, sizeof text, "control:\n  socket: %s\n  group: \"\"\n%s", socket_path, more);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(config_path, text, strlen(text), NULL));
}

static void start_daemon(const struct shef_test_process_manner *manner)
{
    shef_test_process_start(&daemon_process, "shefd", manner, "--config %s", config_path);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_wait_for(&daemon_process, "is up"),
                             daemon_process.err);
}

static void ask(const char *words)
{
    shef_test_process_run(&other, "shefctl", NULL, "--socket %s %s", socket_path, words);
}

static void test_it_answers_and_leaves_nothing_behind_when_told_to_end(void)
{
    write_config("");
    start_daemon(NULL);
    ask("status");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, other.status, other.err);
    TEST_ASSERT_NOT_NULL(strstr(other.out, "idle"));
    shef_test_process_end(&daemon_process, SIGTERM);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, daemon_process.status, daemon_process.err);
    TEST_ASSERT_EQUAL_INT(1, shef_test_temp_count()); /* the configuration */
    ask("status");
    TEST_ASSERT_EQUAL_INT(2, other.status);
    TEST_ASSERT_NOT_NULL(strstr(other.err, "no shefd serves"));
    TEST_ASSERT_TRUE(shef_test_process_said_one_sentence(&other));
}

static void test_an_interrupt_ends_it_as_well(void)
{
    write_config("");
    start_daemon(NULL);
    shef_test_process_end(&daemon_process, SIGINT);
    TEST_ASSERT_EQUAL_INT(0, daemon_process.status);
}

static void test_a_second_one_is_refused_and_the_first_goes_on(void)
{
    write_config("");
    start_daemon(NULL);
    shef_test_process_run(&other, "shefd", NULL, "--config %s", config_path);
    TEST_ASSERT_EQUAL_INT(1, other.status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, "another shefd (process"), other.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&other), other.err);
    ask("status");
    TEST_ASSERT_EQUAL_INT(0, other.status);
}

static void test_after_a_crash_it_starts_again(void)
{
    write_config("");
    start_daemon(NULL);
    shef_test_process_end(&daemon_process, SIGKILL);
    TEST_ASSERT_EQUAL_INT(0, access(socket_path, F_OK));
    start_daemon(NULL);
    ask("status");
    TEST_ASSERT_EQUAL_INT(0, other.status);
}

static void expect_no_start(int status, const char *config, const char *words)
{
    write_config(config);
    shef_test_process_run(&other, "shefd", NULL, "--config %s", config_path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, other.status, other.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, words), other.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&other), other.err);
    TEST_ASSERT_EQUAL_INT(1, shef_test_temp_count());
}

static void test_mistakes_in_the_settings_are_one_sentence(void)
{
    expect_no_start(2, "depth:\n  speed: 3\n", "line 5: there is no setting 'depth.speed'");
    expect_no_start(2, "depth:\n  workers: 0\n", "line 5: depth.workers: '0' must be");
    expect_no_start(2, "depth: \"x\n", "this is no YAML");
    expect_no_start(1, "threads:\n  control:\n    cpu: 1000\n", "processor 1000");
}

static void test_a_folder_without_room_for_the_socket_is_one_sentence(void)
{
    shef_test_process_run(&other, "shefd", NULL, "-s control.socket=/no/such/folder/s");
    TEST_ASSERT_EQUAL_INT(1, other.status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, "/no/such/folder/s"), other.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&other), other.err);
}

static void expect_setting(const char *key, const char *value)
{
    char line[256];
    const char *found;

    ask("config");
    TEST_ASSERT_EQUAL_INT(0, other.status);
    found = strstr(other.out, key);
    TEST_ASSERT_NOT_NULL(found);
    snprintf(line, sizeof line, "%.*s", (int)strcspn(found, "\n"), found);
    found = line + strlen(key);
    found += strspn(found, " ");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, strncmp(found, value, strlen(value)), line);
    TEST_ASSERT_EQUAL_INT_MESSAGE(' ', found[strlen(value)], line);
}

static void reload_and_wait_for(const char *words)
{
    kill(daemon_process.pid, SIGHUP);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_wait_for(&daemon_process, words),
                             daemon_process.err);
}

static void test_a_reload_takes_over_live_settings(void)
{
    write_config("depth:\n  mode: ternary\n");
    start_daemon(NULL);
    expect_setting("depth.mode", "ternary");
    write_config("depth:\n  mode: unsigned\nlcm:\n  cloud: true\n");
    reload_and_wait_for("settings read again, 2 changed");
    expect_setting("depth.mode", "unsigned");
    expect_setting("lcm.cloud", "true");
}

static void test_a_reload_that_needs_a_restart_changes_nothing(void)
{
    write_config("depth:\n  mode: ternary\n");
    start_daemon(NULL);
    write_config("depth:\n  mode: unsigned\n  workers: 3\n");
    reload_and_wait_for("settings stay as they were: depth.workers has changed, which needs a "
                        "restart");
    expect_setting("depth.mode", "ternary");
    write_config("depth:\n  mood: unsigned\n");
    reload_and_wait_for("there is no setting 'depth.mood'");
    expect_setting("depth.mode", "ternary");
}

static int notify_fd;

static void open_notify_socket(char *out_environment, size_t n_bytes)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const char *path = shef_test_temp_path("notify");

    TEST_ASSERT_LESS_THAN_size_t(sizeof address.sun_path, strlen(path));
    memcpy(address.sun_path, path, strlen(path) + 1);
    notify_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    TEST_ASSERT_EQUAL_INT(0, bind(notify_fd, (const struct sockaddr *)&address, sizeof address));
    snprintf(out_environment, n_bytes, "NOTIFY_SOCKET=%s", path);
}

static const char *next_message(void)
{
    static char text[4096];
    const struct timeval patience = { .tv_sec = 20 };
    ssize_t n;

    setsockopt(notify_fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    n = recv(notify_fd, text, sizeof text - 1, 0);
    text[n > 0 ? n : 0] = '\0';
    return text;
}

static void expect_message(const char *line)
{
    const char *message;

    do {
        message = next_message();
        TEST_ASSERT_NOT_EQUAL_CHAR_MESSAGE('\0', *message, line);
    } while (!strstr(message, line));
}

static void test_systemd_hears_of_start_progress_reload_and_end(void)
{
    static char notify[600];
    static char watchdog[] = "WATCHDOG_USEC=200000";
    const struct shef_test_process_manner manner = { .environment = { notify, watchdog } };

    open_notify_socket(notify, sizeof notify);
    write_config("");
    start_daemon(&manner);
    TEST_ASSERT_NOT_NULL(strstr(next_message(), "READY=1\nSTATUS=idle, no source"));
    for (int i = 0; i < 3; i++)
        expect_message("WATCHDOG=1");
    kill(daemon_process.pid, SIGHUP);
    expect_message("RELOADING=1");
    expect_message("READY=1");
    kill(daemon_process.pid, SIGTERM);
    expect_message("STOPPING=1");
    shef_test_process_end(&daemon_process, 0);
    TEST_ASSERT_EQUAL_INT(0, daemon_process.status);
    close(notify_fd);
    unlink(shef_test_temp_path("notify"));
}

#define NOBODY 65534

static const struct shef_test_process_manner as_nobody = { .uid = NOBODY };

static void need_root(void)
{
    if (geteuid() != 0)
        TEST_IGNORE_MESSAGE("only root can try to be somebody else");
    TEST_ASSERT_EQUAL_INT(0, chmod(shef_test_temp_folder(), 0777));
    shef_test_process_run(&other, "shefctl", &as_nobody, "--version");
    if (other.status != 0)
        TEST_IGNORE_MESSAGE("the build folder is closed to other users");
}

static void test_an_ordinary_user_can_run_it_and_is_warned_once(void)
{
    const char *warning;

    need_root();
    write_config("");
    TEST_ASSERT_EQUAL_INT(0, chmod(config_path, 0644));
    start_daemon(&as_nobody);
    shef_test_process_look(&daemon_process);
    warning = strstr(daemon_process.err, "memory is not locked");
    TEST_ASSERT_NOT_NULL_MESSAGE(warning, daemon_process.err);
    TEST_ASSERT_NULL(strstr(warning + 1, "memory is not locked"));
    ask("status");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, other.status, other.err);
    shef_test_process_end(&daemon_process, SIGTERM);
    TEST_ASSERT_EQUAL_INT(0, daemon_process.status);
}

static void test_shefctl_tells_a_foreign_user_why_not(void)
{
    need_root();
    write_config("");
    start_daemon(NULL);
    shef_test_process_run(&other, "shefctl", &as_nobody, "--socket %s status", socket_path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, other.status, other.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, "may not talk to shefd"), other.err);
    TEST_ASSERT_EQUAL_INT(0, chmod(socket_path, 0666));
    shef_test_process_run(&other, "shefctl", &as_nobody, "--socket %s status", socket_path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, other.status, other.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, "user 65534 may not"), other.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&other), other.err);
}

static void test_what_the_service_declines_is_exit_status_4(void)
{
    write_config("");
    start_daemon(NULL);
    ask("play /no/such/recording");
    TEST_ASSERT_EQUAL_INT(4, other.status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(other.err, "/no/such/recording"), other.err);
    ask("dance");
    TEST_ASSERT_EQUAL_INT(1, other.status);
}

static void test_the_kernels_are_listed_with_their_instruction_set(void)
{
    write_config("");
    start_daemon(NULL);
    ask("kernels");
    TEST_ASSERT_EQUAL_INT(0, other.status);
    TEST_ASSERT_NOT_NULL(strstr(other.out, "correlates edge maps"));
    ask("--json kernels");
    TEST_ASSERT_EQUAL_CHAR('{', other.out[0]);
}

static void test_a_lesser_instruction_set_can_be_asked_for(void)
{
    write_config("kernels:\n  isa: c\n");
    start_daemon(NULL);
    ask("kernels");
    TEST_ASSERT_EQUAL_INT(0, other.status);
    TEST_ASSERT_NULL_MESSAGE(strstr(other.out, "avx"), other.out);
    TEST_ASSERT_NULL_MESSAGE(strstr(other.out, "neon"), other.out);
    TEST_ASSERT_NOT_NULL(strstr(other.out, "correlates edge maps"));
}

static void test_an_instruction_set_that_is_not_there_is_one_sentence(void)
{
#if defined(__aarch64__)
    expect_no_start(1, "kernels:\n  isa: avx2\n", "kernels.isa: this processor has no avx2");
#else
    expect_no_start(1, "kernels:\n  isa: neon\n", "kernels.isa: this processor has no neon");
#endif
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_answers_and_leaves_nothing_behind_when_told_to_end);
    RUN_TEST(test_an_interrupt_ends_it_as_well);
    RUN_TEST(test_a_second_one_is_refused_and_the_first_goes_on);
    RUN_TEST(test_after_a_crash_it_starts_again);
    RUN_TEST(test_mistakes_in_the_settings_are_one_sentence);
    RUN_TEST(test_a_folder_without_room_for_the_socket_is_one_sentence);
    RUN_TEST(test_a_reload_takes_over_live_settings);
    RUN_TEST(test_a_reload_that_needs_a_restart_changes_nothing);
    RUN_TEST(test_systemd_hears_of_start_progress_reload_and_end);
    RUN_TEST(test_an_ordinary_user_can_run_it_and_is_warned_once);
    RUN_TEST(test_shefctl_tells_a_foreign_user_why_not);
    RUN_TEST(test_what_the_service_declines_is_exit_status_4);
    RUN_TEST(test_the_kernels_are_listed_with_their_instruction_set);
    RUN_TEST(test_a_lesser_instruction_set_can_be_asked_for);
    RUN_TEST(test_an_instruction_set_that_is_not_there_is_one_sentence);
    return UNITY_END();
}
