/* Runs the real sheftool and looks at what it leaves. Thread: the test's main thread. */
#ifndef SHEF_TESTS_TOOLS_PROGRAM_H
#define SHEF_TESTS_TOOLS_PROGRAM_H

/* What a run printed and how it ended. */
struct program_result {
    int status;      /* exit status, or -1 if a signal ended it */
    char out[65536]; /* standard output, cut at the end */
    char err[4096];  /* standard error, the same */
};

/* Runs build/<preset>/bin/sheftool with words separated by single spaces.
 * The result is valid until the next call. */
const struct program_result *program_run(const char *fmt, ...)
    __attribute__((format(printf, 1, 2)));

/* A data folder of that name in the temporary folder with n synthetic pairs of 160 x 120 px. */
const char *program_make_data(const char *name, int n_pairs);

/* The run failed: exit status, one sentence on one line of standard error that contains both
 * words, nothing on standard output, and the temporary folder has as many entries as before. */
void program_expect_failure(int status, const char *word, const char *other_word, int n_entries);

#endif
