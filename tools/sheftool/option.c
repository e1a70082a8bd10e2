#include "sheftool/option.h"

#include <assert.h>
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/words.h"

#define MAX_OPTIONS 32
#define HELP_COLUMN 28
#define LAST_COLUMN 79
#define LONG_CHOICE 40  /* a longer list of words stands in the options' own lines only */
#define FIRST_ROW   256 /* what getopt returns for the first row of a table; letters lie below */

static enum shef_err refuse(const struct shef_option *option, const char *text,
                            struct shef_error *err)
{
    const char *unit = option->unit ? option->unit : "";
    const char *gap = option->unit ? " " : "";

    return shef_fail(err, SHEF_ERR_INVALID, "--%s %s: needs %s from %.10g to %.10g%s%s",
                     option->name, text,
                     option->kind == SHEF_OPTION_INT ? "a whole number" : "a number", option->min,
                     option->max, gap, unit);
}

static enum shef_err store_number(const struct shef_option *option, void *field, const char *text,
                                  struct shef_error *err)
{
    char *end;

    errno = 0;
    if (option->kind == SHEF_OPTION_INT) {
        const long long number = strtoll(text, &end, 10);

        if (errno || end == text || *end || (double)number < option->min ||
            (double)number > option->max)
            return refuse(option, text, err);
        *(int64_t *)field = number;
        return SHEF_OK;
    }
    const double number = strtod(text, &end);

    if (errno || end == text || *end || !isfinite(number) || number < option->min ||
        number > option->max)
        return refuse(option, text, err);
    *(double *)field = number;
    return SHEF_OK;
}

static enum shef_err store_choice(const struct shef_option *option, int32_t *field,
                                  const char *text, struct shef_error *err)
{
    char hint[SHEF_WORDS_HINT_BYTES];
    char word[64];

    for (int32_t i = 0; shef_words_at(option->choices, i, word, sizeof word); i++) {
        if (strcmp(word, text) == 0) {
            *field = i;
            return SHEF_OK;
        }
    }
    shef_words_hint(option->choices, text, hint);
    return shef_fail(err, SHEF_ERR_INVALID, "--%s %s: needs one of %s%s", option->name, text,
                     option->choices, hint);
}

static enum shef_err store(const struct shef_option *option, void *settings, const char *text,
                           struct shef_error *err)
{
    void *field = (char *)settings + option->field;

    switch (option->kind) {
    case SHEF_OPTION_FLAG:
        *(bool *)field = true;
        return SHEF_OK;
    case SHEF_OPTION_TEXT:
    case SHEF_OPTION_WORD:
        if (!*text)
            return shef_fail(err, SHEF_ERR_INVALID, "%s%s: the %s is empty",
                             option->kind == SHEF_OPTION_WORD ? "" : "--", option->name,
                             option->value);
        *(const char **)field = text;
        return SHEF_OK;
    case SHEF_OPTION_CHOICE:
        return store_choice(option, field, text, err);
    case SHEF_OPTION_INT:
    case SHEF_OPTION_REAL:
        break;
    }
    return store_number(option, field, text, err);
}

static enum shef_err store_presets(const struct shef_option *options, void *settings)
{
    struct shef_error err;

    for (const struct shef_option *option = options; option->name; option++) {
        if (!option->preset)
            continue;
        const enum shef_err code = store(option, settings, option->preset, &err);

        assert(code == SHEF_OK && "a default must pass its own check");
        if (code != SHEF_OK)
            return code;
    }
    return SHEF_OK;
}

/* The row of the n-th word, counted from 0, or NULL. */
static const struct shef_option *find_word(const struct shef_option *options, int n)
{
    for (; options->name; options++)
        if (options->kind == SHEF_OPTION_WORD && n-- == 0)
            return options;
    return NULL;
}

/* Stores the n-th word of the command line that is no option and no value of one. */
static enum shef_err store_word(const struct shef_option *options, void *settings, int n,
                                const char *text, bool *given, struct shef_error *err)
{
    const struct shef_option *option = find_word(options, n);

    if (!option)
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' belongs to no option; see --help", text);
    given[option - options] = true;
    return store(option, settings, text, err);
}

static enum shef_err check_given(const struct shef_option *options, const bool *given,
                                 struct shef_error *err)
{
    for (int i = 0; options[i].name; i++) {
        if (!options[i].required || given[i])
            continue;
        if (options[i].kind == SHEF_OPTION_WORD)
            return shef_fail(err, SHEF_ERR_INVALID, "%s is missing; see --help", options[i].name);
        return shef_fail(err, SHEF_ERR_INVALID, "--%s %s is missing; see --help", options[i].name,
                         options[i].value);
    }
    return SHEF_OK;
}

/* The table as getopt wants it, ended by zeros. Words are not in it. */
static void list_long_options(const struct shef_option *options,
                              struct option out_long[MAX_OPTIONS + 2])
{
    int n = 0;

    out_long[n++] = (struct option){ "help", no_argument, NULL, 'h' };
    for (int i = 0; options[i].name; i++) {
        assert(i < MAX_OPTIONS);
        if (options[i].kind == SHEF_OPTION_WORD)
            continue;
        out_long[n++] = (struct option){
            .name = options[i].name,
            .has_arg = options[i].kind == SHEF_OPTION_FLAG ? no_argument : required_argument,
            .val = FIRST_ROW + i,
        };
    }
    out_long[n] = (struct option){ .name = NULL };
}

enum shef_err shef_options_parse(const struct shef_option *options, void *settings, int argc,
                                 char **argv, bool *out_help, struct shef_error *err)
{
    struct option long_options[MAX_OPTIONS + 2];
    bool given[MAX_OPTIONS] = { false };
    int n_words = 0;
    int found;
    enum shef_err code = store_presets(options, settings);

    list_long_options(options, long_options);
    *out_help = false;
    opterr = 0;
    optind = 0; /* glibc: forget an earlier scan */
    /* '-': words come one by one, as the option 1. */
    while (code == SHEF_OK && (found = getopt_long(argc, argv, "-:h", long_options, NULL)) != -1) {
        if (found == 'h') {
            *out_help = true;
            return SHEF_OK;
        }
        if (found == ':')
            return shef_fail(err, SHEF_ERR_INVALID, "%s needs a value; see --help",
                             argv[optind - 1]);
        if (found == 1) {
            code = store_word(options, settings, n_words++, optarg, given, err);
            continue;
        }
        if (found < FIRST_ROW)
            return shef_fail(err, SHEF_ERR_INVALID, "%s is no option of this command; see --help",
                             argv[optind - 1]);
        given[found - FIRST_ROW] = true;
        code = store(&options[found - FIRST_ROW], settings, optarg, err);
    }
    /* What follows "--". */
    while (code == SHEF_OK && optind < argc)
        code = store_word(options, settings, n_words++, argv[optind++], given, err);
    return code == SHEF_OK ? check_given(options, given, err) : code;
}

/* Prints n_text bytes of words from column `at` on, folded, each new line starting at `indent`. */
static void print_folded(const char *text, size_t n_text, int at, int indent, FILE *out)
{
    const char *end = text + n_text;

    for (bool first = true; text < end; first = false) {
        const int n = (int)strcspn(text, " \n");

        if (!first && at + 1 + n > LAST_COLUMN)
            at = fprintf(out, "\n%*s", indent, "") - 1;
        else if (!first)
            at += fprintf(out, " ");
        at += fprintf(out, "%.*s", n, text);
        text += n + 1;
    }
    fputc('\n', out);
}

/* How many bytes of text make a paragraph: lines up to an empty or an indented one, which, like
 * the line end before it, does not belong to it. */
static size_t paragraph_bytes(const char *text)
{
    const char *end = text + strcspn(text, "\n");

    while (end > text && *text != ' ' && *end && end[1] && !strchr(" \n", end[1]))
        end += 1 + strcspn(end + 1, "\n");
    return (size_t)(end - text);
}

void shef_options_description(const char *text, FILE *out)
{
    while (*text) {
        const size_t n_text = paragraph_bytes(text);

        if (*text == ' ') /* a table: as it is */
            fprintf(out, "%.*s\n", (int)n_text, text);
        else
            print_folded(text, n_text, 0, 0, out);
        text += n_text;
        text += *text == '\n';
    }
}

static void name_and_value(const struct shef_option *option, char *out, size_t n_bytes)
{
    if (option->kind == SHEF_OPTION_FLAG)
        snprintf(out, n_bytes, "--%s", option->name);
    else if (option->kind == SHEF_OPTION_WORD)
        snprintf(out, n_bytes, "%s", option->name);
    else if (option->kind == SHEF_OPTION_CHOICE)
        snprintf(out, n_bytes, "--%s %s", option->name, option->choices);
    else
        snprintf(out, n_bytes, "--%s %s", option->name, option->value);
}

void shef_options_help(const struct shef_option *options, FILE *out)
{
    for (const struct shef_option *option = options; option->name; option++) {
        char head[160];
        char text[640];
        int used;

        name_and_value(option, head, sizeof head);
        used = snprintf(text, sizeof text, "%s", option->help);
        if (option->kind == SHEF_OPTION_INT || option->kind == SHEF_OPTION_REAL)
            used += snprintf(text + used, sizeof text - (size_t)used, "; %.10g to %.10g%s%s",
                             option->min, option->max, option->unit ? " " : "",
                             option->unit ? option->unit : "");
        if (option->required)
            used += snprintf(text + used, sizeof text - (size_t)used, " (required)");
        else if (option->preset)
            used +=
                snprintf(text + used, sizeof text - (size_t)used, " (default %s)", option->preset);
        assert((size_t)used < sizeof text);

        const int n = fprintf(out, "  %s", head);

        if (n >= HELP_COLUMN)
            fprintf(out, "\n%*s", HELP_COLUMN, "");
        else
            fprintf(out, "%*s", HELP_COLUMN - n, "");
        print_folded(text, strlen(text), HELP_COLUMN, HELP_COLUMN, out);
    }
    fprintf(out, "  %-*s%s\n", HELP_COLUMN - 2, "--help", "print this help");
}

void shef_options_synopsis(const struct shef_option *options, int indent, FILE *out)
{
    int at = indent;

    for (const struct shef_option *option = options; option->name; option++) {
        char head[160];

        name_and_value(option, head, sizeof head);
        if (option->kind == SHEF_OPTION_CHOICE && strlen(option->choices) > LONG_CHOICE)
            snprintf(head, sizeof head, "--%s WORD", option->name);
        const int n = (int)strlen(head) + (option->required ? 1 : 3);

        if (at + n > LAST_COLUMN)
            at = fprintf(out, "\n%*s", indent, "") - 1;
        at += fprintf(out, option->required ? " %s" : " [%s]", head);
    }
    fputc('\n', out);
}
