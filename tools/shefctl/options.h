/* The command line of shefctl: one table of commands. Thread: main. */
#ifndef SHEFCTL_OPTIONS_H
#define SHEFCTL_OPTIONS_H

#include <stdbool.h>
#include <stdio.h>

#include <jansson.h>

#include "core/error.h"

#define SHEF_CTL_DEFAULT_SOCKET "/run/shef/shefd.sock"

struct shef_ctl_options;

struct shef_ctl_command {
    const char *name;    /* as typed and as sent: "record start" */
    const char *words;   /* what may follow, for the help: "[NAME]" */
    const char *options; /* letters of the options that only some commands know: "in" */
    int min_words;
    int max_words;
    const char *columns;  /* of tables, NULL: all */
    const char *argument; /* under which name the word is sent; NULL: not sent */
    bool word_is_path;    /* sent as a full path, because shefd runs elsewhere */
    const char *help;
};

struct shef_ctl_options {
    const struct shef_ctl_command *command; /* NULL: version, or help in general, was asked for */
    const char *word;                       /* NULL: none */
    const char *socket;
    bool json;
    bool help;
    bool version;
    bool loop;
    const char *pace;  /* NULL: as configured */
    double interval_s; /* of top */
    long count;        /* of top; 0: until interrupted */
};

/* SHEF_ERR_INVALID: the sentence says what is wrong with the command line; then only
 * out_options->json is set, for how to say it. Texts point into argv and the environment. */
SHEF_MUST_CHECK enum shef_err shef_ctl_options_parse(int argc, char **argv,
                                                     struct shef_ctl_options *out_options,
                                                     struct shef_error *err);

/*   command  the one to explain; NULL: list them all */
void shef_ctl_options_help(const struct shef_ctl_command *command, FILE *out);

/* What to send with the command; json_decref() it.
 * SHEF_ERR_NOT_FOUND, ...: a path that leads nowhere. */
SHEF_MUST_CHECK enum shef_err shef_ctl_arguments(const struct shef_ctl_options *options,
                                                 json_t **out_arguments, struct shef_error *err);

#endif
