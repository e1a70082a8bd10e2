/* Scores the result of `sheftool run` against the truth of its recording. Thread: main. */
#ifndef SHEFTOOL_RUN_EVAL_H
#define SHEFTOOL_RUN_EVAL_H

#include <stdbool.h>

#include "core/error.h"

struct shef_run_eval_settings {
    const char *run;       /* the result's folder */
    const char *recording; /* NULL: the one that the result names */
    bool json;
    bool pictures;
    const char *pictures_dir; /* NULL: beside the result */
};

/* Scores and reports on standard output.
 * SHEF_ERR_NOT_FOUND: no run.json, no maps, or a recording without truth. SHEF_ERR_FORMAT: run.json
 * is not a run's. Errors of the readers. */
SHEF_MUST_CHECK enum shef_err shef_run_eval(const struct shef_run_eval_settings *settings,
                                            struct shef_error *err);

#endif
