/* Command-line options as a table: one row per option, read by the parser and by the help.
 *
 * A command describes its settings as a struct and lists one row per field. Defaults are texts
 * that go through the same parser and the same range check as what the user types, so the help
 * cannot promise a default that the program would refuse. Thread: main. */
#ifndef SHEFTOOL_OPTION_H
#define SHEFTOOL_OPTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/error.h"

enum shef_option_kind {
    SHEF_OPTION_FLAG,   /* bool: true when given */
    SHEF_OPTION_INT,    /* int64_t within min..max */
    SHEF_OPTION_REAL,   /* double within min..max */
    SHEF_OPTION_TEXT,   /* const char *: a path, a list; points into argv */
    SHEF_OPTION_CHOICE, /* int32_t: index of the word in choices, counted from 0 */
    SHEF_OPTION_WORD,   /* const char *: given without dashes, in the order of the rows */
};

struct shef_option {
    const char *name; /* without the dashes, "max-disparity"; of a word "FILE" */
    enum shef_option_kind kind;
    bool required;
    size_t field;        /* offset in the command's settings */
    const char *value;   /* what the help calls the value, "N"; NULL for flags and choices */
    const char *choices; /* "robust|paper-ds"; NULL for other kinds */
    double min, max;     /* of numbers, both allowed */
    const char *unit;    /* "px"; NULL: none */
    const char *preset;  /* the default as text; NULL: zero, false or NULL */
    const char *help;    /* one sentence without a full stop */
};

#define SHEF_OPT_FLAG(name_, type_, field_, help_)                                                 \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_FLAG, .field = offsetof(type_, field_), .help = help_   \
    }
#define SHEF_OPT_INT(name_, type_, field_, preset_, min_, max_, unit_, help_)                      \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_INT, .field = offsetof(type_, field_), .value = "N",    \
        .min = min_, .max = max_, .unit = unit_, .preset = preset_, .help = help_                  \
    }
#define SHEF_OPT_REAL(name_, type_, field_, preset_, min_, max_, unit_, help_)                     \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_REAL, .field = offsetof(type_, field_), .value = "X",   \
        .min = min_, .max = max_, .unit = unit_, .preset = preset_, .help = help_                  \
    }
#define SHEF_OPT_TEXT(name_, type_, field_, value_, preset_, help_)                                \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_TEXT, .field = offsetof(type_, field_),                 \
        .value = value_, .preset = preset_, .help = help_                                          \
    }
#define SHEF_OPT_NEEDED(name_, type_, field_, value_, help_)                                       \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_TEXT, .required = true,                                 \
        .field = offsetof(type_, field_), .value = value_, .help = help_                           \
    }
#define SHEF_OPT_CHOICE(name_, type_, field_, choices_, preset_, help_)                            \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_CHOICE, .field = offsetof(type_, field_),               \
        .choices = choices_, .preset = preset_, .help = help_                                      \
    }
#define SHEF_OPT_WORD(name_, type_, field_, required_, help_)                                      \
    {                                                                                              \
        .name = name_, .kind = SHEF_OPTION_WORD, .required = required_,                            \
        .field = offsetof(type_, field_), .value = name_, .help = help_                            \
    }
#define SHEF_OPT_END                                                                               \
    {                                                                                              \
        .name = NULL                                                                               \
    }

/* Fills a settings struct: the defaults, then what argv says.
 *   options    rows, ended by SHEF_OPT_END
 *   settings   the command's struct; texts in it point into argv
 *   argc,argv  argv[0] is the command's own name
 *   out_help   true when --help was asked for; then nothing else is checked
 * SHEF_ERR_INVALID: an unknown option, a missing or impossible value, a word that belongs to no
 * option; the sentence names it and says what is allowed. */
SHEF_MUST_CHECK enum shef_err shef_options_parse(const struct shef_option *options, void *settings,
                                                 int argc, char **argv, bool *out_help,
                                                 struct shef_error *err);

/* Writes the options' part of a command's help, in 80 columns: name, value, meaning, unit, range,
 * default. */
void shef_options_help(const struct shef_option *options, FILE *out);

/* Writes the one-line synopsis: required options bare, the others in brackets, folded at 80
 * columns with `indent` spaces before the following lines. */
void shef_options_synopsis(const struct shef_option *options, int indent, FILE *out);

/* Writes a description, in 80 columns: paragraphs are folded anew, indented lines stay. */
void shef_options_description(const char *text, FILE *out);

#endif
