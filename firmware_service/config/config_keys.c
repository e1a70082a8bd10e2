#include "config/config_keys.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <yaml.h>

#include "config/config.h"
#include "core/words.h"

#define MAX_DEPTH 4 /* threads.filter.cpu is 3 */

struct walk {
    const uint8_t *bytes;
    size_t n_bytes;
    yaml_parser_t parser;
    const char *name;
    struct shef_config_keys *keys;
    struct shef_error *err;
    char path[SHEF_CONFIG_KEY_BYTES]; /* of the value that comes next; "" at the top */
    size_t section_bytes[MAX_DEPTH];  /* how much of path each open mapping owns */
    int depth;                        /* open mappings */
    bool has_key;                     /* path names a key whose value comes next */
    int n_documents;
};

static int line_of(const yaml_event_t *event)
{
    return (int)event->start_mark.line + 1;
}

static bool is_section(const char *path)
{
    const size_t n = strlen(path);

    for (int i = 0; i < shef_config_n_rows; i++)
        if (strncmp(shef_config_rows[i].key, path, n) == 0 && shef_config_rows[i].key[n] == '.')
            return true;
    return false;
}

static enum shef_err fail_unknown(struct walk *walk, int line)
{
    char hint[SHEF_WORDS_HINT_BYTES];

    shef_config_hint(walk->path, hint);
    return shef_fail(walk->err, SHEF_ERR_INVALID, "%s, line %d: there is no setting '%s'%s",
                     walk->name, line, walk->path,
                     *hint ? hint : "; 'shefd --settings' lists them all");
}

/* A zero byte would end the text for us, and not for who wrote it. */
static enum shef_err check_scalar(struct walk *walk, const yaml_event_t *event)
{
    if (strlen((const char *)event->data.scalar.value) == event->data.scalar.length)
        return SHEF_OK;
    return shef_fail(walk->err, SHEF_ERR_INVALID, "%s, line %d: a zero byte in a text", walk->name,
                     line_of(event));
}

/* A key: extends the path and notes the line. */
static enum shef_err take_key(struct walk *walk, const yaml_event_t *event)
{
    const size_t n_section = walk->section_bytes[walk->depth - 1];
    struct shef_config_keys *keys = walk->keys;
    const int line = line_of(event);
    const char *own = (const char *)event->data.scalar.value;
    const int n = snprintf(walk->path + n_section, sizeof walk->path - n_section, "%s%s",
                           n_section > 0 ? "." : "", own);

    if (n_section + (size_t)n >= sizeof walk->path ||
        (!is_section(walk->path) && !shef_config_find(walk->path)))
        return fail_unknown(walk, line);
    if (strchr(own, '.'))
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: '%s' is written in parts: each section on a line of its own",
                         walk->name, line, own);

    const int earlier = shef_config_keys_line(keys, walk->path);

    if (earlier > 0)
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: '%s' is there twice, see line %d", walk->name, line,
                         walk->path, earlier);
    /* Every known key at most once: the table cannot overflow while it is larger than theirs. */
    if (keys->n_keys == SHEF_CONFIG_MAX_KEYS)
        return shef_fail(walk->err, SHEF_ERR_INVALID, "%s, line %d: too many keys", walk->name,
                         line);
    snprintf(keys->keys[keys->n_keys].path, sizeof keys->keys[0].path, "%s", walk->path);
    keys->keys[keys->n_keys++].line = line;
    walk->has_key = true;
    return SHEF_OK;
}

static enum shef_err take_value(struct walk *walk, const yaml_event_t *event)
{
    if (!is_section(walk->path)) {
        walk->has_key = false;
        return SHEF_OK;
    }
    if (event->data.scalar.length == 0)
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: the section '%s' is empty; remove this line as well",
                         walk->name, line_of(event), walk->path);
    return shef_fail(walk->err, SHEF_ERR_INVALID,
                     "%s, line %d: '%s' is a section: its settings belong on the next lines, "
                     "further to the right",
                     walk->name, line_of(event), walk->path);
}

static enum shef_err take_mapping(struct walk *walk, const yaml_event_t *event)
{
    if (walk->depth > 0 && !walk->has_key)
        return shef_fail(walk->err, SHEF_ERR_INVALID, "%s, line %d: a key must be a plain word",
                         walk->name, line_of(event));
    if (walk->depth > 0 && !is_section(walk->path))
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: '%s' is one value and has no settings under it", walk->name,
                         line_of(event), walk->path);
    /* Sections are at most as deep as the rows' keys have dots. */
    walk->section_bytes[walk->depth++] = strlen(walk->path);
    walk->has_key = false;
    return SHEF_OK;
}

static enum shef_err take_event(struct walk *walk, const yaml_event_t *event)
{
    switch (event->type) {
    case YAML_DOCUMENT_START_EVENT:
        if (walk->n_documents++ > 0)
            return shef_fail(walk->err, SHEF_ERR_INVALID,
                             "%s, line %d: a second document begins; one is allowed", walk->name,
                             line_of(event));
        return SHEF_OK;
    case YAML_SCALAR_EVENT:
        if (walk->depth == 0)
            return shef_fail(walk->err, SHEF_ERR_INVALID,
                             "%s, line %d: settings look like 'section:' and, on the next line, "
                             "'  key: value'",
                             walk->name, line_of(event));
        if (check_scalar(walk, event) != SHEF_OK)
            return walk->err ? walk->err->code : SHEF_ERR_INVALID;
        return walk->has_key ? take_value(walk, event) : take_key(walk, event);
    case YAML_MAPPING_START_EVENT:
        return take_mapping(walk, event);
    case YAML_MAPPING_END_EVENT:
        walk->path[walk->section_bytes[--walk->depth]] = '\0';
        return SHEF_OK;
    case YAML_SEQUENCE_START_EVENT:
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: a list begins, but no setting is a list", walk->name,
                         line_of(event));
    case YAML_ALIAS_EVENT:
        return shef_fail(walk->err, SHEF_ERR_INVALID,
                         "%s, line %d: aliases (*name) are not allowed; write the value",
                         walk->name, line_of(event));
    default:
        return SHEF_OK;
    }
}

/* Whether the blanks at the front of a line, counted from 0, have a tab among them. */
static bool is_indented_by_tab(const struct walk *walk, size_t line)
{
    const char *at = (const char *)walk->bytes;
    const char *end = at + walk->n_bytes;

    for (; line > 0 && at; line--) {
        at = memchr(at, '\n', (size_t)(end - at));
        at = at ? at + 1 : NULL;
    }
    while (at && at < end && *at == ' ')
        at++;
    return at && at < end && *at == '\t';
}

static enum shef_err fail_syntax(struct walk *walk)
{
    const size_t line = walk->parser.problem_mark.line;
    const char *problem = walk->parser.problem ? walk->parser.problem : "unreadable";

    if (walk->parser.error == YAML_MEMORY_ERROR)
        return shef_fail(walk->err, SHEF_ERR_NO_MEMORY, "read %s: out of memory", walk->name);
    if (is_indented_by_tab(walk, line))
        return shef_fail(walk->err, SHEF_ERR_FORMAT,
                         "%s, line %zu: this is no YAML: a tab begins the line; use spaces",
                         walk->name, line + 1);
    return shef_fail(walk->err, SHEF_ERR_FORMAT, "%s, line %zu: this is no YAML: %s", walk->name,
                     line + 1, problem);
}

static enum shef_err walk_events(struct walk *walk)
{
    enum shef_err code = SHEF_OK;
    bool at_end = false;

    while (code == SHEF_OK && !at_end) {
        yaml_event_t event;

        if (!yaml_parser_parse(&walk->parser, &event))
            return fail_syntax(walk);
        at_end = event.type == YAML_STREAM_END_EVENT;
        code = take_event(walk, &event);
        yaml_event_delete(&event);
    }
    return code;
}

enum shef_err shef_config_keys_check(const uint8_t *bytes, size_t n_bytes, const char *name,
                                     struct shef_config_keys *out_keys, struct shef_error *err)
{
    struct walk walk = {
        .bytes = bytes, .n_bytes = n_bytes, .name = name, .keys = out_keys, .err = err
    };

    out_keys->n_keys = 0;
    if (!yaml_parser_initialize(&walk.parser))
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read %s: out of memory", name);
    yaml_parser_set_input_string(&walk.parser, bytes, n_bytes);

    const enum shef_err code = walk_events(&walk);

    yaml_parser_delete(&walk.parser);
    return code;
}

int shef_config_keys_line(const struct shef_config_keys *keys, const char *path)
{
    for (int i = 0; i < keys->n_keys; i++)
        if (strcmp(keys->keys[i].path, path) == 0)
            return keys->keys[i].line;
    return 0;
}
