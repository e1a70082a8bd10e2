#include "shefctl/show.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/error.h"

#define TEXT_BYTES   1024
#define MAX_COLUMNS  24
#define INDENT       2
#define LINE_COLUMNS 80

/* How numbers with this unit are printed. */
static const struct {
    const char *suffix; /* of the key */
    const char *unit;   /* as printed */
    int decimals;       /* of fractions */
    double factor;      /* from the JSON's number to the printed one */
} units[] = {
    { "_ns", "ns", 0, 1 },     { "_us", "us", 1, 1 },       { "_ms", "ms", 2, 1 },
    { "_s", "s", 1, 1 },       { "_hz", "Hz", 1, 1 },       { "_bytes", "MB", 1, 1e-6 },
    { "_share", "%", 1, 100 }, { "_px", "px", 2, 1 },       { "_mm", "mm", 1, 1 },
    { "_m", "m", 3, 1 },       { "_mev_s", "Mev/s", 2, 1 },
};

#define N_UNITS ((int)(sizeof units / sizeof units[0]))

/* The row of the longest suffix that fits, or -1. */
static int find_unit(const char *key)
{
    const size_t n_key = strlen(key);
    size_t n_best = 0;
    int best = -1;

    for (int i = 0; i < N_UNITS; i++) {
        const size_t n = strlen(units[i].suffix);

        if (n > n_best && n_key > n && strcmp(key + n_key - n, units[i].suffix) == 0) {
            best = i;
            n_best = n;
        }
    }
    return best;
}

const char *shef_show_unit(const char *key, char *out_name, size_t n_bytes)
{
    const int unit = find_unit(key);
    const size_t n_key = strlen(key) - (unit >= 0 ? strlen(units[unit].suffix) : 0);
    const size_t from = strncmp(key, "n_", 2) == 0 ? 2 : 0;

    snprintf(out_name, n_bytes, "%.*s", (int)(n_key - from), key + from);
    for (char *byte = out_name; *byte; byte++)
        if (*byte == '_' || (unsigned char)*byte < ' ')
            *byte = ' ';
    return unit >= 0 ? units[unit].unit : "";
}

static void print_number(const char *key, const json_t *value, char *out_text, size_t n_bytes)
{
    const int unit = find_unit(key);
    const double factor = unit >= 0 ? units[unit].factor : 1;

    if (json_is_integer(value) && factor == 1.0)
        snprintf(out_text, n_bytes, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
    else if (unit >= 0)
        snprintf(out_text, n_bytes, "%.*f", units[unit].decimals,
                 json_number_value(value) * factor);
    else
        snprintf(out_text, n_bytes, "%.4g", json_number_value(value));
}

/* One line: arrays of single values, separated by commas. */
static void print_list(const char *key, const json_t *list, char *out_text, size_t n_bytes)
{
    size_t used = 0;

    out_text[0] = '\0';
    for (size_t i = 0; i < json_array_size(list) && used + 1 < n_bytes; i++) {
        char item[TEXT_BYTES];

        shef_show_value(key, json_array_get(list, i), item, sizeof item);
        used += (size_t)snprintf(out_text + used, n_bytes - used, "%s%s", i > 0 ? ", " : "", item);
    }
}

void shef_show_value(const char *key, const json_t *value, char *out_text, size_t n_bytes)
{
    switch (json_typeof(value)) {
    case JSON_STRING:
        snprintf(out_text, n_bytes, "%s",
                 json_string_length(value) > 0 ? json_string_value(value) : "\"\"");
        break;
    case JSON_INTEGER:
    case JSON_REAL:
        print_number(key, value, out_text, n_bytes);
        break;
    case JSON_TRUE:
        snprintf(out_text, n_bytes, "yes");
        break;
    case JSON_FALSE:
        snprintf(out_text, n_bytes, "no");
        break;
    case JSON_NULL:
        snprintf(out_text, n_bytes, "-");
        break;
    case JSON_ARRAY:
        print_list(key, value, out_text, n_bytes);
        break;
    case JSON_OBJECT:
        snprintf(out_text, n_bytes, "{...}");
        break;
    }
    shef_keep_printable(out_text);
}

/* Characters, not bytes: UTF-8 continuations take no room. */
static int width_of(const char *text)
{
    int n = 0;

    for (; *text; text++)
        n += ((unsigned char)*text & 0xc0) != 0x80;
    return n;
}

static void print_padded(const char *text, int width, bool to_the_right, FILE *out)
{
    const int gap = width - width_of(text);

    if (to_the_right)
        fprintf(out, "%*s%s", gap > 0 ? gap : 0, "", text);
    else
        fprintf(out, "%s%*s", text, gap > 0 ? gap : 0, "");
}

struct table {
    const json_t *rows;
    char keys[MAX_COLUMNS][64];
    int widths[MAX_COLUMNS];
    bool are_numbers[MAX_COLUMNS];
    int n_columns;
};

static void add_column(struct table *table, const char *key, size_t n_key)
{
    char name[64];

    snprintf(name, sizeof name, "%.*s", (int)n_key, key);
    for (int i = 0; i < table->n_columns; i++)
        if (strcmp(table->keys[i], name) == 0)
            return;
    if (table->n_columns < MAX_COLUMNS)
        memcpy(table->keys[table->n_columns++], name, sizeof name);
}

static bool has_column(const struct table *table, const char *key, size_t n_key)
{
    size_t i;
    json_t *row;

    json_array_foreach(table->rows, i, row)
    {
        if (json_object_getn(row, key, n_key))
            return true;
    }
    return false;
}

/* The wanted columns that there are, or those of any row in the order in which they first
 * appear. */
static void find_columns(struct table *table, const char *columns)
{
    size_t i;
    json_t *row;

    for (; columns && *columns; columns += strcspn(columns, ","), columns += *columns == ',')
        if (has_column(table, columns, strcspn(columns, ",")))
            add_column(table, columns, strcspn(columns, ","));
    if (table->n_columns > 0)
        return;
    json_array_foreach(table->rows, i, row)
    {
        for (void *at = json_object_iter(row); at; at = json_object_iter_next(row, at))
            add_column(table, json_object_iter_key(at), strlen(json_object_iter_key(at)));
    }
}

static void head_of(const char *key, char *out_text, size_t n_bytes)
{
    char name[64];
    const char *unit = shef_show_unit(key, name, sizeof name);

    snprintf(out_text, n_bytes, "%s%s%s", name, *unit ? " " : "", unit);
}

static void cell_of(const struct table *table, size_t row, int column, char *out_text,
                    size_t n_bytes)
{
    const json_t *value = json_object_get(json_array_get(table->rows, row), table->keys[column]);

    out_text[0] = '\0';
    if (value)
        shef_show_value(table->keys[column], value, out_text, n_bytes);
}

static void measure(struct table *table)
{
    char text[TEXT_BYTES];

    for (int c = 0; c < table->n_columns; c++) {
        table->are_numbers[c] = false;
        head_of(table->keys[c], text, sizeof text);
        table->widths[c] = width_of(text);
        for (size_t r = 0; r < json_array_size(table->rows); r++) {
            const json_t *value = json_object_get(json_array_get(table->rows, r), table->keys[c]);

            table->are_numbers[c] = table->are_numbers[c] || json_is_number(value);
            cell_of(table, r, c, text, sizeof text);
            if (width_of(text) > table->widths[c])
                table->widths[c] = width_of(text);
        }
    }
}

static void print_table(const json_t *rows, const char *columns, int indent, FILE *out)
{
    struct table table = { .rows = rows };
    char text[TEXT_BYTES];

    find_columns(&table, columns);
    measure(&table);
    for (size_t r = 0; r <= json_array_size(rows); r++) {
        fprintf(out, "%*s", indent, "");
        for (int c = 0; c < table.n_columns; c++) {
            const bool is_last = c + 1 == table.n_columns;

            if (r == 0)
                head_of(table.keys[c], text, sizeof text);
            else
                cell_of(&table, r - 1, c, text, sizeof text);
            print_padded(text, is_last && !table.are_numbers[c] ? 0 : table.widths[c],
                         table.are_numbers[c], out);
            if (!is_last)
                fputs("  ", out);
        }
        fputc('\n', out);
    }
}

static bool is_table(const json_t *value)
{
    return json_is_object(json_array_get(value, 0));
}

static bool is_sentences(const json_t *value)
{
    return json_is_string(json_array_get(value, 0)) && json_array_size(value) > 0 &&
           strchr(json_string_value(json_array_get(value, 0)), ' ');
}

/* Whether a value stands on the line of its name. */
static bool is_inline(const json_t *value)
{
    return !json_is_object(value) && !is_table(value) && !is_sentences(value);
}

static void print_object(json_t *object, const char *columns, int indent, FILE *out);

static void print_below(json_t *value, const char *columns, int indent, FILE *out)
{
    if (json_is_object(value)) {
        print_object(value, columns, indent, out);
        return;
    }
    if (is_table(value)) {
        print_table(value, columns, indent, out);
        return;
    }
    for (size_t i = 0; i < json_array_size(value); i++) {
        char text[TEXT_BYTES];

        shef_show_value("", json_array_get(value, i), text, sizeof text);
        fprintf(out, "%*s%s\n", indent, "", text);
    }
}

/* Names and values one after the other, folded before the line's end. */
struct run {
    FILE *out;
    int indent; /* of the lines that follow the first */
    int at;     /* the column reached */
    bool is_begun;
};

static void add_to_run(struct run *run, const char *name, const char *key, const json_t *value)
{
    char text[TEXT_BYTES];
    char item[2 * TEXT_BYTES];
    char unused[64];
    const char *unit = shef_show_unit(key, unused, sizeof unused);

    shef_show_value(key, value, text, sizeof text);
    snprintf(item, sizeof item, "%s %s%s%s", name, text, json_is_number(value) && *unit ? " " : "",
             json_is_number(value) ? unit : "");
    if (run->is_begun && run->at + 2 + width_of(item) >= LINE_COLUMNS) {
        fprintf(run->out, ",\n%*s", run->indent, "");
        run->at = run->indent;
    } else if (run->is_begun) {
        fputs(", ", run->out);
        run->at += 2;
    }
    fputs(item, run->out);
    run->at += width_of(item);
    run->is_begun = true;
}

/* Single values, but sentences and lists, which have commas of their own. */
static bool fits_run(const json_t *value)
{
    return !json_is_object(value) && !json_is_array(value) &&
           !(json_is_string(value) && strchr(json_string_value(value), ' '));
}

static bool is_run(json_t *object)
{
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at))
        if (!fits_run(json_object_iter_value(at)))
            return false;
    return json_object_size(object) > 0;
}

static void run_members(struct run *run, json_t *object)
{
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        char name[128];

        if (!fits_run(json_object_iter_value(at)))
            continue;
        shef_show_unit(json_object_iter_key(at), name, sizeof name);
        add_to_run(run, name, json_object_iter_key(at), json_object_iter_value(at));
    }
}

/* The key of the only value beside "name" in each row, or NULL. */
static const char *key_of_pairs(json_t *rows)
{
    const char *key = NULL;
    size_t i;
    json_t *row;

    json_array_foreach(rows, i, row)
    {
        if (json_object_size(row) != 2 || !json_is_string(json_object_get(row, "name")))
            return NULL;
        for (void *at = json_object_iter(row); at; at = json_object_iter_next(row, at)) {
            if (strcmp(json_object_iter_key(at), "name") == 0)
                continue;
            if (!fits_run(json_object_iter_value(at)) ||
                (key && strcmp(key, json_object_iter_key(at)) != 0))
                return NULL;
            key = json_object_iter_key(at);
        }
    }
    return key;
}

static void run_pairs(struct run *run, json_t *rows, const char *key)
{
    size_t i;
    json_t *row;

    json_array_foreach(rows, i, row)
    {
        char name[TEXT_BYTES];

        shef_show_value("name", json_object_get(row, "name"), name, sizeof name);
        add_to_run(run, name, key, json_object_get(row, key));
    }
}

static void print_member(const char *key, json_t *value, const char *columns, int indent,
                         int name_width, FILE *out)
{
    char name[128];
    char text[TEXT_BYTES];
    const char *unit = shef_show_unit(key, name, sizeof name);
    const char *pairs = is_table(value) ? key_of_pairs(value) : NULL;

    fprintf(out, "%*s", indent, "");
    if (pairs || (json_is_object(value) && is_run(value))) {
        const int n_head = fprintf(out, "%s:  ", name);
        struct run run = { .out = out, .indent = indent + INDENT, .at = indent + n_head };

        if (pairs)
            run_pairs(&run, value, pairs);
        else
            run_members(&run, value);
        fputc('\n', out);
        return;
    }
    if (!is_inline(value)) {
        fprintf(out, "%s:\n", name);
        print_below(value, columns, indent + INDENT, out);
        return;
    }
    print_padded(name, name_width, false, out);
    shef_show_value(key, value, text, sizeof text);
    if (json_is_array(value) && json_array_size(value) == 0)
        snprintf(text, sizeof text, "none");
    fprintf(out, "  %s%s%s\n", text, json_is_number(value) && *unit ? " " : "",
            json_is_number(value) ? unit : "");
}

/* The outermost object has a line for each value; inside, single values share lines. */
static void print_object(json_t *object, const char *columns, int indent, FILE *out)
{
    const bool is_inside = indent > 0;
    struct run run = { .out = out, .indent = indent, .at = indent };
    int name_width = 0;
    char name[128];

    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        const json_t *value = json_object_iter_value(at);

        shef_show_unit(json_object_iter_key(at), name, sizeof name);
        if (is_inside && fits_run(value) && !run.is_begun) {
            fprintf(out, "%*s", indent, "");
            run_members(&run, object);
            fputc('\n', out);
        } else if (is_inline(value) && !(is_inside && fits_run(value)) &&
                   width_of(name) > name_width) {
            name_width = width_of(name);
        }
    }
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at))
        if (!is_inside || !fits_run(json_object_iter_value(at)))
            print_member(json_object_iter_key(at), json_object_iter_value(at), columns, indent,
                         name_width, out);
}

void shef_show(json_t *answer, const char *columns, FILE *out)
{
    print_below(answer, columns, 0, out);
}
