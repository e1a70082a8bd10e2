#include "support/process.h"

#include <fcntl.h>
#include <grp.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "support/support.h"

#define MAX_WORDS  64
#define PATIENCE_S 20

/* The programs lie beside the folder of the tests. */
static void find_program(const char *program, char *out_path, size_t n_bytes)
{
    char self[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);

    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, (int)n, "cannot tell where this test lies");
    self[n] = '\0';
    *strrchr(self, '/') = '\0';
    snprintf(out_path, n_bytes, "%s/../bin/%s", self, program);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, access(out_path, X_OK), out_path);
}

static void become(const struct shef_test_process_manner *manner)
{
    const struct rlimit none = { 0, 0 };

    for (int i = 0; manner && i < 4 && manner->environment[i]; i++)
        putenv((char *)(uintptr_t)manner->environment[i]);
    if (!manner || manner->uid == 0)
        return;
    setrlimit(RLIMIT_RTPRIO, &none);
    setrlimit(RLIMIT_MEMLOCK, &none);
    if (setgroups(0, NULL) != 0 || setgid(manner->uid) != 0 || setuid(manner->uid) != 0)
        _exit(126);
}

static void start(struct shef_test_process *process, const char *program,
                  const struct shef_test_process_manner *manner, const char *fmt, va_list args)
{
    static char line[16384];
    char path[PATH_MAX + 64];
    char *words[MAX_WORDS + 1] = { path };
    int n_words = 1;

    vsnprintf(line, sizeof line, fmt, args);
    find_program(program, path, sizeof path);
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
        TEST_ASSERT_LESS_THAN_INT(MAX_WORDS, n_words);
        words[n_words++] = word;
    }
    process->out_fd = memfd_create("out", 0);
    process->err_fd = memfd_create("err", 0);
    process->status = -1;
    process->pid = fork();
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, (int)process->pid);
    if (process->pid == 0) {
        dup2(manner && manner->out_path ? open(manner->out_path, O_WRONLY) : process->out_fd,
             STDOUT_FILENO);
        dup2(process->err_fd, STDERR_FILENO);
        become(manner);
        execv(path, words);
        _exit(127);
    }
}

void shef_test_process_start(struct shef_test_process *process, const char *program,
                             const struct shef_test_process_manner *manner, const char *fmt, ...)
{
    va_list args;

    va_start(args, fmt);
    start(process, program, manner, fmt, args);
    va_end(args);
}

static void read_back(int fd, char *out_text, size_t n_bytes)
{
    const ssize_t n = pread(fd, out_text, n_bytes - 1, 0);

    out_text[n > 0 ? n : 0] = '\0';
}

void shef_test_process_look(struct shef_test_process *process)
{
    read_back(process->out_fd, process->out, sizeof process->out);
    read_back(process->err_fd, process->err, sizeof process->err);
}

static void take_status(struct shef_test_process *process, int status)
{
    process->status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    process->pid = 0;
}

bool shef_test_process_wait_for(struct shef_test_process *process, const char *text)
{
    const struct timespec pause = { 0, 5000000 };
    int status;

    for (int i = 0; i < PATIENCE_S * 200; i++) {
        shef_test_process_look(process);
        if (strstr(process->err, text))
            return true;
        if (process->pid != 0 && waitpid(process->pid, &status, WNOHANG) == process->pid)
            take_status(process, status);
        if (process->pid == 0)
            break;
        nanosleep(&pause, NULL);
    }
    shef_test_process_look(process);
    return strstr(process->err, text) != NULL;
}

void shef_test_process_end(struct shef_test_process *process, int signal)
{
    int status;

    if (process->pid != 0) {
        if (signal != 0)
            kill(process->pid, signal);
        TEST_ASSERT_EQUAL_INT(process->pid, waitpid(process->pid, &status, 0));
        take_status(process, status);
    }
    shef_test_process_look(process);
    close(process->out_fd);
    close(process->err_fd);
}

void shef_test_process_run(struct shef_test_process *process, const char *program,
                           const struct shef_test_process_manner *manner, const char *fmt, ...)
{
    va_list args;

    va_start(args, fmt);
    start(process, program, manner, fmt, args);
    va_end(args);
    shef_test_process_end(process, 0);
}

bool shef_test_process_said_one_sentence(const struct shef_test_process *process)
{
    const char *end = strchr(process->err, '\n');

    return end && end[1] == '\0' && end > process->err;
}
