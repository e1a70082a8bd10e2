/* Starts the project's own programs beside the test and looks at what they print.
 * Thread: the test's main thread. */
#ifndef SHEF_TESTS_PROCESS_H
#define SHEF_TESTS_PROCESS_H

#include <stdbool.h>
#include <sys/types.h>

struct shef_test_process {
    pid_t pid;  /* 0: not running */
    int out_fd; /* what it prints, from the start */
    int err_fd;
    int status;       /* exit status once it has ended; 128 + signal if one ended it */
    char out[262144]; /* filled by end(), and by look() meanwhile; cut at the end */
    char err[65536];
};

/* How it starts, beside its arguments. Zeroed: as this test itself. */
struct shef_test_process_manner {
    uid_t uid;                  /* not 0: as this user, without groups and real-time rights */
    const char *environment[4]; /* "NAME=value", ended by NULL */
    const char *out_path;       /* where standard output goes instead of `out`; NULL: there */
};

/* Starts build/<preset>/bin/PROGRAM with words separated by single spaces. */
void shef_test_process_start(struct shef_test_process *process, const char *program,
                             const struct shef_test_process_manner *manner, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

/* Reads what it has printed so far. */
void shef_test_process_look(struct shef_test_process *process);

/* Waits until it has printed this on standard error. False: it ended, or 20 s went by. */
bool shef_test_process_wait_for(struct shef_test_process *process, const char *text);

/* Sends a signal, 0 for none, and waits for its end. */
void shef_test_process_end(struct shef_test_process *process, int signal);

/* start() and end(), for programs that end by themselves. */
void shef_test_process_run(struct shef_test_process *process, const char *program,
                           const struct shef_test_process_manner *manner, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

/* Standard error holds one line; the journal's "<3>" before it does not count. */
bool shef_test_process_said_one_sentence(const struct shef_test_process *process);

#endif
