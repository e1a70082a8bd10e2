/* The table of sheftool's commands.
 *
 * A command is its name, its help, the table of its options and two functions. main parses the
 * options into a zeroed settings struct and calls run. What check refuses is a usage mistake
 * (exit 2); what run refuses is a failure (exit 1). */
#ifndef SHEFTOOL_COMMAND_H
#define SHEFTOOL_COMMAND_H

#include <stddef.h>

#include "core/error.h"
#include "sheftool/option.h"

struct shef_command {
    const char *name;        /* one word, or two: "align fit" */
    const char *summary;     /* one line without a full stop */
    const char *description; /* paragraphs of the long help, folded by hand at 78 columns */
    const struct shef_option *options;
    size_t settings_bytes; /* of the struct that options point into */
    /* Refuses combinations that no single row can refuse. May be NULL. */
    enum shef_err (*check)(const void *settings, struct shef_error *err);
    /* Does the work: results on standard output or in files, one sentence in err on failure. */
    enum shef_err (*run)(const void *settings, struct shef_error *err);
};

/* In the order of the help. */
#define SHEF_N_COMMANDS 14
extern const struct shef_command *const shef_commands[SHEF_N_COMMANDS];

extern const struct shef_command shef_command_run;
extern const struct shef_command shef_command_study;
extern const struct shef_command shef_command_match;
extern const struct shef_command shef_command_eval;
extern const struct shef_command shef_command_table;
extern const struct shef_command shef_command_align_fit;
extern const struct shef_command shef_command_bias_fit;
extern const struct shef_command shef_command_bench_correlate;
extern const struct shef_command shef_command_bench_frame;
extern const struct shef_command shef_command_synth;
extern const struct shef_command shef_command_events_info;
extern const struct shef_command shef_command_events_convert;
extern const struct shef_command shef_command_events_render;
extern const struct shef_command shef_command_events_bench;

/* True once SIGINT or SIGTERM arrived. Long work asks between two pairs, removes what it has
 * half written and returns shef_fail_interrupted(). Thread: any. */
bool shef_interrupted(void);

/* The sentence for work that the user stopped. */
enum shef_err shef_fail_interrupted(struct shef_error *err);

/* Installs the handler behind shef_interrupted(). Thread: main, once. */
void shef_interrupt_install(void);

#endif
