#include "core/log.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <pty.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "support/support.h"

static char seen[65536];
static int real_stderr = -1;
static bool is_journal; /* what captures standard error pretends to be */

void tearDown(void)
{
    shef_log_set_level(SHEF_LOG_INFO);
    is_journal = false;
}

static void pretend(int fd)
{
    char text[64];
    struct stat info;

    TEST_ASSERT_EQUAL_INT(0, fstat(fd, &info));
    snprintf(text, sizeof text, "%llu:%llu", (unsigned long long)info.st_dev,
             (unsigned long long)info.st_ino + !is_journal);
    setenv("JOURNAL_STREAM", text, 1);
}

/* From here to end_capture(), standard error is fd. */
static void begin_capture(int fd)
{
    pretend(fd);
    real_stderr = dup(STDERR_FILENO);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, dup2(fd, STDERR_FILENO));
}

static void end_capture(void)
{
    dup2(real_stderr, STDERR_FILENO);
    close(real_stderr);
}

static int open_capture_file(void)
{
    const int fd = open(shef_test_temp_path("stderr"), O_RDWR | O_CREAT | O_TRUNC | O_APPEND, 0600);

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    return fd;
}

/* Puts what the capture file holds into seen and closes it. */
static void read_back(int fd)
{
    const ssize_t n_bytes = pread(fd, seen, sizeof seen - 1, 0);

    TEST_ASSERT_GREATER_OR_EQUAL_INT64(0, n_bytes);
    seen[n_bytes] = '\0';
    close(fd);
}

#define CAPTURE(...)                                                                               \
    do {                                                                                           \
        const int capture_fd = open_capture_file();                                                \
        begin_capture(capture_fd);                                                                 \
        __VA_ARGS__;                                                                               \
        end_capture();                                                                             \
        read_back(capture_fd);                                                                     \
    } while (0)

static void test_the_journal_gets_one_line_with_its_priority(void)
{
    is_journal = true;
    CAPTURE(shef_log(SHEF_LOG_WARNING, "%d frames lost", 3));
    TEST_ASSERT_EQUAL_STRING("<4>3 frames lost\n", seen);
    CAPTURE(shef_log(SHEF_LOG_ERROR, "a"); shef_log(SHEF_LOG_INFO, "b"));
    TEST_ASSERT_EQUAL_STRING("<3>a\n<6>b\n", seen);
}

static void test_others_get_the_levels_name(void)
{
    CAPTURE(shef_log(SHEF_LOG_WARNING, "%d frames lost", 3));
    TEST_ASSERT_EQUAL_STRING("warning: 3 frames lost\n", seen);
    unsetenv("JOURNAL_STREAM");
    CAPTURE(shef_log(SHEF_LOG_ERROR, "a"); shef_log(SHEF_LOG_INFO, "b"));
    TEST_ASSERT_EQUAL_STRING("error: a\ninfo: b\n", seen);
}

static void test_a_terminal_gets_the_levels_name(void)
{
    int master, terminal;
    char line[100] = "";

    if (openpty(&master, &terminal, NULL, NULL, NULL) != 0)
        TEST_IGNORE_MESSAGE("no pseudo-terminal to be had: /dev/pts is not mounted");
    begin_capture(terminal);
    shef_log(SHEF_LOG_WARNING, "no real-time rights");
    end_capture();
    TEST_ASSERT_GREATER_THAN_INT64(0, read(master, line, sizeof line - 1));
    /* The terminal itself turns the line end into two characters. */
    TEST_ASSERT_EQUAL_STRING("warning: no real-time rights\r\n", line);
    close(master);
    close(terminal);
}

static void test_only_levels_up_to_the_chosen_one_are_shown(void)
{
    CAPTURE(shef_log(SHEF_LOG_DEBUG, "hidden"));
    TEST_ASSERT_EQUAL_STRING("", seen);
    shef_log_set_level(SHEF_LOG_DEBUG);
    CAPTURE(shef_log(SHEF_LOG_DEBUG, "shown"));
    TEST_ASSERT_EQUAL_STRING("debug: shown\n", seen);
    shef_log_set_level(SHEF_LOG_ERROR);
    CAPTURE(shef_log(SHEF_LOG_WARNING, "hidden"); shef_log(SHEF_LOG_ERROR, "shown"));
    TEST_ASSERT_EQUAL_STRING("error: shown\n", seen);
}

static void test_a_message_stays_one_line_whatever_is_in_it(void)
{
    CAPTURE(shef_log(SHEF_LOG_INFO, "file '%s'", "evil\nname\r<3>\033[2J\xc2\x9b"));
    TEST_ASSERT_EQUAL_STRING("info: file 'evil name <3>?[2J?"
                             "?'\n",
                             seen);
}

static void test_long_messages_are_cut_visibly(void)
{
    char text[SHEF_LOG_LINE_BYTES + 2];

    memset(text, 'x', sizeof text);
    text[SHEF_LOG_LINE_BYTES] = '\0';
    CAPTURE(shef_log(SHEF_LOG_INFO, "%s", text));
    TEST_ASSERT_EQUAL_size_t(6 + SHEF_LOG_LINE_BYTES + 1, strlen(seen));
    TEST_ASSERT_NULL(strstr(seen, "..."));
    text[SHEF_LOG_LINE_BYTES] = 'x';
    text[SHEF_LOG_LINE_BYTES + 1] = '\0';
    CAPTURE(shef_log(SHEF_LOG_INFO, "%s", text));
    TEST_ASSERT_EQUAL_size_t(6 + SHEF_LOG_LINE_BYTES + 1, strlen(seen));
    TEST_ASSERT_EQUAL_STRING("x...\n", seen + strlen(seen) - 5);
}

static void test_errno_survives_a_message(void)
{
    const int full = open("/dev/full", O_WRONLY);
    int after;

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, full);
    begin_capture(full);
    errno = ENOENT;
    shef_log(SHEF_LOG_INFO, "lost");
    after = errno;
    end_capture();
    close(full);
    TEST_ASSERT_EQUAL_INT(ENOENT, after);
}

static void *log_many(void *argument)
{
    for (int i = 0; i < 200; i++)
        shef_log(SHEF_LOG_INFO, "%s", (const char *)argument);
    return NULL;
}

static void test_lines_of_two_threads_do_not_mix(void)
{
    static char first[] = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";
    static char second[] = "bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb";
    pthread_t thread;
    int n_lines = 0;
    char *rest = NULL;

    CAPTURE(TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, log_many, first));
            log_many(second); pthread_join(thread, NULL));
    for (char *line = strtok_r(seen, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        n_lines++;
        TEST_ASSERT_TRUE(strcmp(line + 6, first) == 0 || strcmp(line + 6, second) == 0);
    }
    TEST_ASSERT_EQUAL_INT(400, n_lines);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_journal_gets_one_line_with_its_priority);
    RUN_TEST(test_others_get_the_levels_name);
    RUN_TEST(test_a_terminal_gets_the_levels_name);
    RUN_TEST(test_only_levels_up_to_the_chosen_one_are_shown);
    RUN_TEST(test_a_message_stays_one_line_whatever_is_in_it);
    RUN_TEST(test_long_messages_are_cut_visibly);
    RUN_TEST(test_errno_survives_a_message);
    RUN_TEST(test_lines_of_two_threads_do_not_mix);
    return UNITY_END();
}
