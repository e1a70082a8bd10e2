/* A progress bar on standard error, only on a terminal and only for work over a second.
 *
 * Belongs to the thread that calls it. With no terminal every call does nothing. */
#ifndef SHEFTOOL_PROGRESS_H
#define SHEFTOOL_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

struct shef_progress {
    const char *what; /* "matching" */
    int64_t n_total;
    int64_t start_ns; /* of CLOCK_MONOTONIC */
    int64_t drawn_ns; /* when the bar was last drawn; 0: never */
    bool terminal;
};

/* Starts counting towards n_total steps; draws nothing yet. */
void shef_progress_begin(struct shef_progress *progress, const char *what, int64_t n_total);

/* Says that n_done steps are done. Draws at most ten times a second, and only once the whole
 * work is known to take more than a second. */
void shef_progress_step(struct shef_progress *progress, int64_t n_done);

/* Wipes the bar from the terminal. */
void shef_progress_end(struct shef_progress *progress);

#endif
