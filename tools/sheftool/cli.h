/* What the programs of this folder and its neighbours have in common: they find a command in a
 * table, parse its options, run it, and say in one sentence what went wrong.
 *
 * Understands COMMAND [OPTIONS], COMMAND --help, help COMMAND, --help and --version.
 * Thread: main. */
#ifndef SHEFTOOL_CLI_H
#define SHEFTOOL_CLI_H

#include "sheftool/command.h"

struct shef_program {
    const char *name;    /* "sheftool" */
    const char *summary; /* what it is, one line without a full stop */
    const struct shef_command *const *commands;
    int n_commands;
};

/* Returns the exit status: 0 done, 1 failed, 2 the command line is wrong, 130 stopped by a
 * signal. */
int shef_cli_main(const struct shef_program *program, int argc, char **argv);

#endif
