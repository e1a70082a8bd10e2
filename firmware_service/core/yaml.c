#include "core/yaml.h"

#include <ctype.h>
#include <cyaml/cyaml.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#define TEXT_BYTES 200

/* What libcyaml has said: the trouble, then the places it was in, the innermost first. */
struct complaint {
    char text[TEXT_BYTES];
    char path[TEXT_BYTES]; /* "frame_camera.focal_px.1" */
    uint32_t line;         /* of the innermost place */
    int n_places;
};

/* Texts of a stranger's file: one line, printable. */
static void make_printable(char *text)
{
    for (size_t n = strlen(text); n > 0 && isspace((unsigned char)text[n - 1]); n--)
        text[n - 1] = '\0';
    shef_keep_printable(text);
}

static void note_place(struct complaint *complaint, const char *line)
{
    const char *name = strchr(line, '\'');
    const char *name_end = name ? strrchr(line, '\'') : NULL;
    const char *number = strstr(line, "(line: ");
    char rest[TEXT_BYTES];
    long entry;

    if (complaint->n_places++ == 0 && number)
        complaint->line = (uint32_t)strtoul(number + 7, NULL, 10);
    if (!name || name_end == name)
        return;
    memcpy(rest, complaint->path, sizeof rest);
    /* Entries count from 1 there, from 0 here. */
    entry = strstr(line, "sequence entry") ? strtol(name + 1, NULL, 10) - 1 : -1;
    if (entry >= 0)
        snprintf(complaint->path, TEXT_BYTES, "%ld%s%.150s", entry, *rest ? "." : "", rest);
    else
        snprintf(complaint->path, TEXT_BYTES, "%.*s%s%.100s", (int)(name_end - name - 1), name + 1,
                 *rest ? "." : "", rest);
}

static void hear(cyaml_log_t level, void *context, const char *fmt, va_list args)
{
    struct complaint *complaint = context;
    char line[TEXT_BYTES];

    (void)level;
    vsnprintf(line, sizeof line, fmt, args);
    make_printable(line);
    if (strncmp(line, "  in ", 5) == 0)
        note_place(complaint, line);
    else if (strstr(line, "Backtrace:") == NULL && !*complaint->text)
        snprintf(complaint->text, TEXT_BYTES, "%s",
                 strncmp(line, "Load: ", 6) == 0 ? line + 6 : line);
}

static cyaml_config_t config_for(struct complaint *complaint)
{
    return (cyaml_config_t){
        .log_fn = complaint ? hear : NULL,
        .log_ctx = complaint,
        .log_level = CYAML_LOG_ERROR,
        .mem_fn = cyaml_mem,
        .flags = CYAML_CFG_NO_ALIAS,
    };
}

/* Drops the last name of a path. */
static void go_up(char *path)
{
    char *dot = strrchr(path, '.');

    *(dot ? dot : path) = '\0';
}

/* The text behind a prefix, or NULL. */
static const char *after(const char *text, const char *prefix)
{
    const size_t n = strlen(prefix);

    return strncmp(text, prefix, n) == 0 ? text + n : NULL;
}

static enum shef_err explain(const char *name, const uint8_t *bytes, size_t n_bytes,
                             cyaml_err_t failure, struct complaint *complaint,
                             struct shef_error *err)
{
    const char *missing = after(complaint->text, "Missing required mapping field: ");
    const char *unknown = after(complaint->text, "Unexpected key: ");

    if (failure == CYAML_ERR_OOM)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read '%s': out of memory", name);
    if (missing) {
        /* The innermost place is the neighbour that was read last. */
        go_up(complaint->path);
        if (*complaint->path)
            return shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %u: the key '%s' is missing in '%s'",
                             name, shef_yaml_line(bytes, n_bytes, complaint->path), missing,
                             complaint->path);
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s': the key '%s' is missing", name, missing);
    }
    if (unknown) {
        char key[3 * TEXT_BYTES];

        snprintf(key, sizeof key, "%s%s%s", complaint->path, *complaint->path ? "." : "", unknown);

        const uint32_t line = shef_yaml_line(bytes, n_bytes, key);

        return shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %u: there is no key '%s'%s%s%s", name,
                         line > 0 ? line : complaint->line, unknown,
                         *complaint->path ? " in '" : "", complaint->path,
                         *complaint->path ? "'" : "");
    }
    /* Without a place the whole is meant, which is not what the schema wants: a name, a list. */
    if (complaint->line == 0)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "'%s' holds something else: lines such as 'key: value' are expected",
                         name);
    return shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %u%s%s%s: %s", name, complaint->line,
                     *complaint->path ? ", key '" : "", complaint->path,
                     *complaint->path ? "'" : "",
                     *complaint->text ? complaint->text : cyaml_strerror(failure));
}

/* Whether the text is YAML at all; libcyaml is silent about where it is not. */
static enum shef_err check_syntax(const char *name, const uint8_t *bytes, size_t n_bytes,
                                  struct shef_error *err)
{
    enum shef_err code = SHEF_OK;
    yaml_parser_t parser;
    bool has_ended = false;

    if (!yaml_parser_initialize(&parser))
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read '%s': out of memory", name);
    yaml_parser_set_input_string(&parser, bytes, n_bytes);
    while (code == SHEF_OK && !has_ended) {
        yaml_event_t event;

        if (!yaml_parser_parse(&parser, &event)) {
            code = shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %zu: this is no YAML: %s", name,
                             parser.problem_mark.line + 1,
                             parser.problem ? parser.problem : "it cannot be read");
            break;
        }
        has_ended = event.type == YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
    }
    yaml_parser_delete(&parser);
    return code;
}

enum shef_err shef_yaml_parse(const char *name, const uint8_t *bytes, size_t n_bytes,
                              const struct cyaml_schema_value *schema, void **out_value,
                              struct shef_error *err)
{
    struct complaint complaint = { .n_places = 0 };
    const cyaml_config_t config = config_for(&complaint);
    cyaml_data_t *value = NULL;
    const enum shef_err code = check_syntax(name, bytes, n_bytes, err);

    if (code != SHEF_OK)
        return code;

    const cyaml_err_t failure = cyaml_load_data(bytes, n_bytes, &config, schema, &value, NULL);

    if (failure != CYAML_OK)
        return explain(name, bytes, n_bytes, failure, &complaint, err);
    if (!value)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s' is empty", name);
    *out_value = value;
    return SHEF_OK;
}

void shef_yaml_free(const struct cyaml_schema_value *schema, void *value)
{
    const cyaml_config_t config = config_for(NULL);

    if (value)
        (void)cyaml_free(&config, schema, value, 0);
}

/* The child of a node under the name at the front of a key; moves the key behind that name.
 * Returns NULL if there is none. */
static yaml_node_t *child_of(yaml_document_t *document, const yaml_node_t *node, const char **key)
{
    const size_t n_name = strcspn(*key, ".");
    const char *name = *key;

    *key += n_name + (name[n_name] == '.');
    if (node->type == YAML_SEQUENCE_NODE) {
        const ptrdiff_t n = node->data.sequence.items.top - node->data.sequence.items.start;
        const long entry = strtol(name, NULL, 10);

        return entry >= 0 && entry < n
                   ? yaml_document_get_node(document, node->data.sequence.items.start[entry])
                   : NULL;
    }
    if (node->type != YAML_MAPPING_NODE)
        return NULL;
    for (const yaml_node_pair_t *pair = node->data.mapping.pairs.start;
         pair < node->data.mapping.pairs.top; pair++) {
        const yaml_node_t *found = yaml_document_get_node(document, pair->key);

        if (found->type == YAML_SCALAR_NODE && found->data.scalar.length == n_name &&
            memcmp(found->data.scalar.value, name, n_name) == 0)
            return yaml_document_get_node(document, pair->value);
    }
    return NULL;
}

uint32_t shef_yaml_line(const uint8_t *bytes, size_t n_bytes, const char *key)
{
    yaml_parser_t parser;
    yaml_document_t document;
    uint32_t line = 0;

    if (!yaml_parser_initialize(&parser))
        return 0;
    yaml_parser_set_input_string(&parser, bytes, n_bytes);
    if (yaml_parser_load(&parser, &document)) {
        yaml_node_t *node = yaml_document_get_root_node(&document);

        while (node && *key)
            node = child_of(&document, node, &key);
        if (node)
            line = (uint32_t)node->start_mark.line + 1;
        yaml_document_delete(&document);
    }
    yaml_parser_delete(&parser);
    return line;
}
