#include "sheftool/option.h"

#include <assert.h>
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_OPTIONS 32
#define HELP_COLUMN 28
#define LAST_COLUMN 99

bool shef_option_choice(const char *choices, int32_t n, char *out_word, size_t n_bytes)
{
    const char *word = choices;

    for (; n > 0 && word; n--) {
        word = strchr(word, '|');
        if (word)
            word++;
    }
    if (!word)
        return false;
    snprintf(out_word, n_bytes, "%.*s", (int)strcspn(word, "|"), word);
    return true;
}

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
    char word[64];

    for (int32_t i = 0; shef_option_choice(option->choices, i, word, sizeof word); i++) {
        if (strcmp(word, text) == 0) {
            *field = i;
            return SHEF_OK;
        }
    }
    return shef_fail(err, SHEF_ERR_INVALID, "--%s %s: needs one of %s", option->name, text,
                     option->choices);
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
        if (!*text)
            return shef_fail(err, SHEF_ERR_INVALID, "--%s: the %s is empty", option->name,
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

enum shef_err shef_options_parse(const struct shef_option *options, void *settings, int argc,
                                 char **argv, bool *out_help, struct shef_error *err)
{
    struct option long_options[MAX_OPTIONS + 2] = { { "help", no_argument, NULL, 0 } };
    bool given[MAX_OPTIONS] = { false };
    int n_options = 0;
    int index;
    int found;

    for (; options[n_options].name; n_options++) {
        assert(n_options < MAX_OPTIONS);
        long_options[n_options + 1] = (struct option){
            .name = options[n_options].name,
            .has_arg =
                options[n_options].kind == SHEF_OPTION_FLAG ? no_argument : required_argument,
        };
    }
    enum shef_err code = store_presets(options, settings);

    *out_help = false;
    opterr = 0;
    optind = 0; /* glibc: forget an earlier scan */
    while (code == SHEF_OK &&
           (found = getopt_long(argc, argv, "+:h", long_options, &index)) != -1) {
        if (found == 'h' || (found == 0 && index == 0)) {
            *out_help = true;
            return SHEF_OK;
        }
        if (found == ':')
            return shef_fail(err, SHEF_ERR_INVALID, "%s needs a value; see --help",
                             argv[optind - 1]);
        if (found != 0)
            return shef_fail(err, SHEF_ERR_INVALID, "%s is no option of this command; see --help",
                             argv[optind - 1]);
        given[index - 1] = true;
        code = store(&options[index - 1], settings, optarg, err);
    }
    if (code != SHEF_OK)
        return code;
    if (optind < argc)
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' belongs to no option; see --help",
                         argv[optind]);
    for (int i = 0; i < n_options; i++)
        if (options[i].required && !given[i])
            return shef_fail(err, SHEF_ERR_INVALID, "--%s %s is missing; see --help",
                             options[i].name, options[i].value);
    return SHEF_OK;
}

/* Prints words of text from column `at` on, folded, each new line starting at `indent`. */
static void print_folded(const char *text, int at, int indent, FILE *out)
{
    for (bool first = true; *text; first = false) {
        const int n = (int)strcspn(text, " ");

        if (!first && at + 1 + n > LAST_COLUMN)
            at = fprintf(out, "\n%*s", indent, "") - 1;
        else if (!first)
            at += fprintf(out, " ");
        at += fprintf(out, "%.*s", n, text);
        text += n;
        text += *text == ' ';
    }
    fputc('\n', out);
}

static void name_and_value(const struct shef_option *option, char *out, size_t n_bytes)
{
    if (option->kind == SHEF_OPTION_FLAG)
        snprintf(out, n_bytes, "--%s", option->name);
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
        print_folded(text, HELP_COLUMN, HELP_COLUMN, out);
    }
    fprintf(out, "  %-*s%s\n", HELP_COLUMN - 2, "--help", "print this help");
}

void shef_options_synopsis(const struct shef_option *options, int indent, FILE *out)
{
    int at = indent;

    for (const struct shef_option *option = options; option->name; option++) {
        char head[160];

        name_and_value(option, head, sizeof head);
        const int n = (int)strlen(head) + (option->required ? 1 : 3);

        if (at + n > LAST_COLUMN)
            at = fprintf(out, "\n%*s", indent, "") - 1;
        at += fprintf(out, option->required ? " %s" : " [%s]", head);
    }
    fputc('\n', out);
}
