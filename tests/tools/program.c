#include "tools/program.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support/support.h"

#define MAX_WORDS 48

static struct program_result result;

/* The program lies beside the folder of the tests. */
static void find_program(char *out_path, size_t n_bytes)
{
    char self[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);

    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, (int)n, "cannot tell where this test lies");
    self[n] = '\0';
    *strrchr(self, '/') = '\0';
    TEST_ASSERT_LESS_THAN_INT((int)n_bytes,
                              snprintf(out_path, n_bytes, "%s/../bin/sheftool", self));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, access(out_path, X_OK), "bin/sheftool is not built");
}

static void read_back(int fd, char *out_text, size_t n_bytes)
{
    const ssize_t n = pread(fd, out_text, n_bytes - 1, 0);

    out_text[n > 0 ? n : 0] = '\0';
    close(fd);
}

const struct program_result *program_run(const char *fmt, ...)
{
    static char line[16384];
    char path[PATH_MAX + 64];
    char *words[MAX_WORDS + 1] = { path };
    int n_words = 1;
    int status;
    va_list args;

    va_start(args, fmt);
    vsnprintf(line, sizeof line, fmt, args);
    va_end(args);
    find_program(path, sizeof path);
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
        TEST_ASSERT_LESS_THAN_INT(MAX_WORDS, n_words);
        words[n_words++] = word;
    }

    const int out_fd = memfd_create("out", 0);
    const int err_fd = memfd_create("err", 0);
    const pid_t pid = fork();

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, (int)pid);
    if (pid == 0) {
        dup2(out_fd, STDOUT_FILENO);
        dup2(err_fd, STDERR_FILENO);
        execv(path, words);
        _exit(127);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    read_back(out_fd, result.out, sizeof result.out);
    read_back(err_fd, result.err, sizeof result.err);
    return &result;
}

const char *program_make_data(const char *name, int n_pairs)
{
    static char path[PATH_MAX];

    snprintf(path, sizeof path, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        0, program_run("synth --out %s --pairs %d --width 160 --height 120", path, n_pairs)->status,
        result.err);
    return path;
}

void program_expect_failure(int status, const char *word, const char *other_word, int n_entries)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, result.status, result.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result.err, word), result.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result.err, other_word), result.err);
    TEST_ASSERT_EQUAL_STRING("", result.out);

    const char *end = strchr(result.err, '\n');

    TEST_ASSERT_NOT_NULL_MESSAGE(end, result.err);
    TEST_ASSERT_EQUAL_STRING_MESSAGE("", end + 1, "more than one line of complaint");
    TEST_ASSERT_EQUAL_INT_MESSAGE(n_entries, shef_test_temp_count(), "something stayed behind");
}
