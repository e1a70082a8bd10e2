#include "config/config_text.h"

#include <inttypes.h>
#include <string.h>

#define LAST_COLUMN 98

void shef_config_describe_range(const struct shef_config_row *row, char *out_text, size_t n_bytes)
{
    switch (row->kind) {
    case SHEF_CONFIG_BOOL:
        snprintf(out_text, n_bytes, "true or false");
        return;
    case SHEF_CONFIG_INT:
        snprintf(out_text, n_bytes, "%" PRId64 " to %" PRId64 "%s%s%s%s", row->min, row->max,
                 row->unit ? " " : "", row->unit ? row->unit : "", row->zero ? "; 0: " : "",
                 row->zero ? row->zero : "");
        return;
    case SHEF_CONFIG_CHOICE:
    case SHEF_CONFIG_WORD:
        snprintf(out_text, n_bytes, "%s", row->choices);
        return;
    case SHEF_CONFIG_TEXT:
        snprintf(out_text, n_bytes, row->min > 0 ? "text, not empty" : "text");
        return;
    }
}

/* Prints words of text after a lead, folded; the lead comes again on each line. */
static void print_folded(const char *lead, const char *text, FILE *out)
{
    int at = fprintf(out, "%s", lead);
    const int start = at;

    while (*text) {
        const int n = (int)strcspn(text, " ");

        if (at > start && at + 1 + n > LAST_COLUMN) {
            fputc('\n', out);
            at = fprintf(out, "%s", lead);
        } else if (at > start) {
            at += fprintf(out, " ");
        }
        at += fprintf(out, "%.*s", n, text);
        text += n;
        text += *text == ' ';
    }
    fputc('\n', out);
}

/* The part of the key that the previous row's key has too, in whole sections. */
static size_t shared_sections(const char *key, const char *earlier)
{
    size_t n_shared = 0;

    for (size_t i = 0; key[i] && key[i] == earlier[i]; i++)
        if (key[i] == '.')
            n_shared = i + 1;
    return n_shared;
}

static int depth_at(const char *key, size_t n_bytes)
{
    int depth = 0;

    for (size_t i = 0; i < n_bytes; i++)
        depth += key[i] == '.';
    return depth;
}

/* Double quotes read any text back as it is, with the two escapes below. */
static void print_value(const struct shef_config_row *row, const char *text, FILE *out)
{
    if (row->kind != SHEF_CONFIG_TEXT) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

void shef_config_write_yaml(const struct shef_config *config, FILE *out)
{
    const char *earlier = "";

    fprintf(out, "# Settings of shefd. What is left out has its default, which is what stands "
                 "here.\n# A change takes effect when the service starts again; settings marked "
                 "(live) also on\n# 'systemctl reload shefd'. See shefd.yaml(5).\n");
    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        char value[SHEF_CONFIG_PATH_BYTES];
        char range[256];
        char text[1024];
        char lead[32];
        size_t from = shared_sections(row->key, earlier);

        for (const char *dot; (dot = strchr(row->key + from, '.'));
             from = (size_t)(dot - row->key) + 1) {
            const int depth = depth_at(row->key, from);

            fprintf(out, "%s%*s%.*s:\n", depth == 0 ? "\n" : "", 2 * depth, "",
                    (int)(dot - row->key - (ptrdiff_t)from), row->key + from);
        }
        shef_config_get(config, row, value, sizeof value);
        shef_config_describe_range(row, range, sizeof range);
        snprintf(text, sizeof text, "%s (%s)%s", row->help, range, row->is_live ? " (live)" : "");
        snprintf(lead, sizeof lead, "%*s# ", 2 * depth_at(row->key, from), "");
        print_folded(lead, text, out);
        fprintf(out, "%*s%s: ", 2 * depth_at(row->key, from), "", row->key + from);
        print_value(row, value, out);
        fputc('\n', out);
        earlier = row->key;
    }
}

void shef_config_write_list(const struct shef_config *config, FILE *out)
{
    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        char value[SHEF_CONFIG_PATH_BYTES];
        char range[256];
        char text[1024];

        shef_config_get(config, row, value, sizeof value);
        shef_config_describe_range(row, range, sizeof range);
        fprintf(out, "%s = %s\n", row->key, *value ? value : "\"\"");
        snprintf(text, sizeof text, "%s (%s; default %s)%s", row->help, range,
                 *row->preset ? row->preset : "empty", row->is_live ? " (live)" : "");
        print_folded("    ", text, out);
    }
}

/* A leading dot or quote would be a command, '-' a hyphen of another kind. */
static void print_man_text(const char *text, FILE *out)
{
    for (; *text; text++) {
        if (*text == '-')
            fputs("\\-", out);
        else if (*text == '\\')
            fputs("\\e", out);
        else
            fputc(*text, out);
    }
}

void shef_config_write_man(FILE *out)
{
    const char *earlier = "";

    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        const size_t n_section = strcspn(row->key, ".");
        char range[256];

        if (strncmp(row->key, earlier, n_section + 1) != 0)
            fprintf(out, ".SS %.*s\n", (int)n_section, row->key);
        fprintf(out, ".TP\n.B ");
        print_man_text(row->key, out);
        fprintf(out, "\n");
        print_man_text(row->help, out);
        fprintf(out, ".\n.br\n");
        shef_config_describe_range(row, range, sizeof range);
        print_man_text(range, out);
        fprintf(out, "; default ");
        print_man_text(*row->preset ? row->preset : "empty", out);
        fprintf(out, "%s.\n", row->is_live ? "; live" : "");
        earlier = row->key;
    }
}
