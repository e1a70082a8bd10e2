/* A result file under a temporary name, which gets its own when it is complete. Thread: main. */
#ifndef SHEFTOOL_EVENTS_DRAFT_H
#define SHEFTOOL_EVENTS_DRAFT_H

#include <stdio.h>

#include "core/error.h"
#include "sheftool/paths.h"

struct shef_draft {
    char path[SHEF_PATH_BYTES]; /* the name to be */
    char part[SHEF_PATH_BYTES]; /* path.part, "" when there is nothing to remove */
    FILE *file;                 /* NULL: not open */
};

/* Creates PATH.part. A zeroed draft is closed. */
SHEF_MUST_CHECK enum shef_err shef_draft_open(struct shef_draft *draft, const char *path,
                                              struct shef_error *err);

/* The sentence for a write to draft->file that failed, with errno as it was left. */
enum shef_err shef_draft_fail(const struct shef_draft *draft, struct shef_error *err);

/* Closes the file and gives it its name; what was there is replaced. On failure it is gone. */
SHEF_MUST_CHECK enum shef_err shef_draft_commit(struct shef_draft *draft, struct shef_error *err);

/* Removes what was written. After commit(), or when closed, it does nothing. */
void shef_draft_discard(struct shef_draft *draft);

#endif
