/* The command line of shefd. Thread: main. */
#ifndef SHEF_SHEFD_OPTIONS_H
#define SHEF_SHEFD_OPTIONS_H

#include <stdbool.h>
#include <stdio.h>

#include "config/config.h"
#include "core/error.h"

#define SHEF_SHEFD_MAX_OVERRIDES 32

enum shef_shefd_action {
    SHEF_SHEFD_RUN,
    SHEF_SHEFD_HELP,
    SHEF_SHEFD_VERSION,
    SHEF_SHEFD_CHECK_CONFIG,
    SHEF_SHEFD_LIST_SETTINGS,
    SHEF_SHEFD_WRITE_CONFIG,
};

/* Texts point into argv. */
struct shef_shefd_options {
    enum shef_shefd_action action;
    const char *config_path;                         /* NULL: the usual one, if it is there */
    const char *recording;                           /* NULL: as the configuration says */
    bool ends_with_source;                           /* leave when the recording is over */
    const char *overrides[SHEF_SHEFD_MAX_OVERRIDES]; /* "key=value" */
    int n_overrides;
};

/* SHEF_ERR_INVALID: an option or setting that is not there, a value that is missing or not allowed,
 * options that make no sense together. */
SHEF_MUST_CHECK enum shef_err shef_shefd_options_parse(int argc, char **argv,
                                                       struct shef_shefd_options *out_options,
                                                       struct shef_error *err);

void shef_shefd_options_help(FILE *out);

/* Reads the configuration that the options ask for: file, then what the command line overrides.
 * Without --config a usual file that is not there means all defaults. What is loaded passes every
 * check that can be made without a device, a recording or a network. */
SHEF_MUST_CHECK enum shef_err shef_shefd_config_load(const struct shef_shefd_options *options,
                                                     struct shef_config *out_config,
                                                     struct shef_error *err);

/* Reads the calibration that the settings name and looks whether its cameras are a stereo pair.
 * None named: it is the recording's affair. Errors of shef_calibration_read() and
 * shef_rectification_pair(). */
SHEF_MUST_CHECK enum shef_err shef_shefd_calibration_check(const struct shef_config *config,
                                                           struct shef_error *err);

#endif
