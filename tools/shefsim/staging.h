/* A folder that gets its name when it is complete.
 *
 * Until then it lies beside it as NAME.part-PID. A program that is killed leaves that, never half
 * a result under the right name. Thread: main. */
#ifndef SHEFSIM_STAGING_H
#define SHEFSIM_STAGING_H

#include <limits.h>

#include "core/error.h"

struct sim_staging {
    char final[PATH_MAX];
    char path[PATH_MAX]; /* to write to; "": nothing to clean up */
};

/* Picks the place; the caller makes the folder at ->path.
 *   final  must not exist, or be an empty folder
 * SHEF_ERR_INVALID: there is something. Errors of the system. */
SHEF_MUST_CHECK enum shef_err sim_staging_begin(struct sim_staging *staging, const char *final,
                                                struct shef_error *err);

/* Gives the folder its name. Errors of the system: discard() may follow. */
SHEF_MUST_CHECK enum shef_err sim_staging_commit(struct sim_staging *staging,
                                                 struct shef_error *err);

/* Removes the folder and all that is in it. After commit(), or on a zeroed one, nothing. */
void sim_staging_discard(struct sim_staging *staging);

#endif
