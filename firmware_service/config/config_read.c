#include "config/config.h"

#include <assert.h>
#include <cyaml/cyaml.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/config_keys.h"
#include "core/file.h"

#define MAX_FILE_BYTES 65536
#define MAX_ROWS       128
#define MAX_SECTIONS   32
#define PART_BYTES     32

/* The file's values as texts, one per row; NULL where the file says nothing. Numbers become
 * numbers by the same function that reads defaults, so both obey the same ranges. */
struct texts {
    char *of_row[MAX_ROWS];
};

/* libcyaml's view of the rows. A section is a mapping in place: it takes no space of its own, so
 * every row keeps its offset in struct texts. */
struct schema {
    cyaml_schema_field_t fields[MAX_ROWS + 2 * MAX_SECTIONS];
    char parts[MAX_ROWS + MAX_SECTIONS][PART_BYTES]; /* the keys' parts between dots */
    int n_fields;
    int n_parts;
    cyaml_schema_value_t top;
};

static const char *keep_part(struct schema *schema, const char *text, size_t n_bytes)
{
    char *part = schema->parts[schema->n_parts++];

    assert(n_bytes < PART_BYTES && schema->n_parts <= MAX_ROWS + MAX_SECTIONS);
    memcpy(part, text, n_bytes);
    part[n_bytes] = '\0';
    return part;
}

/* How many rows from i on share the section that row i has at this depth of its key. */
static int count_section(int i, size_t n_prefix)
{
    const char *key = shef_config_rows[i].key;
    const size_t n = n_prefix + strcspn(key + n_prefix, ".") + 1;
    int n_rows = 0;

    while (i + n_rows < shef_config_n_rows &&
           strncmp(shef_config_rows[i + n_rows].key, key, n) == 0)
        n_rows++;
    return n_rows;
}

/* Describes the rows first..end-1, whose keys share n_prefix bytes, as one mapping. Its own
 * fields lie together, so they are counted and reserved before those of its sections. */
static const cyaml_schema_field_t *add_mapping(struct schema *schema, int first, int end,
                                               size_t n_prefix)
{
    int n_own = 0;

    for (int i = first; i < end; n_own++) {
        const char *rest = shef_config_rows[i].key + n_prefix;

        i += strchr(rest, '.') ? count_section(i, n_prefix) : 1;
    }

    cyaml_schema_field_t *fields = &schema->fields[schema->n_fields];
    cyaml_schema_field_t *field = fields;

    schema->n_fields += n_own + 1;
    assert(schema->n_fields <= MAX_ROWS + 2 * MAX_SECTIONS);
    for (int i = first; i < end; field++) {
        const char *rest = shef_config_rows[i].key + n_prefix;
        const size_t n_part = strcspn(rest, ".");

        field->key = keep_part(schema, rest, n_part);
        if (rest[n_part] == '.') {
            const int n_rows = count_section(i, n_prefix);

            field->value = (cyaml_schema_value_t){
                .type = CYAML_MAPPING,
                .flags = CYAML_FLAG_OPTIONAL,
                .data_size = sizeof(struct texts),
                .mapping.fields = add_mapping(schema, i, i + n_rows, n_prefix + n_part + 1),
            };
            i += n_rows;
        } else {
            field->data_offset =
                (uint32_t)(offsetof(struct texts, of_row) + (size_t)i * sizeof(char *));
            field->value = (cyaml_schema_value_t){
                .type = CYAML_STRING,
                .flags = CYAML_FLAG_POINTER | CYAML_FLAG_OPTIONAL,
                .data_size = sizeof(char),
                .string = { .min = 0, .max = CYAML_UNLIMITED },
            };
            i++;
        }
    }
    return fields;
}

static void describe_rows(struct schema *schema)
{
    assert(shef_config_n_rows <= MAX_ROWS);
    schema->top = (cyaml_schema_value_t){
        .type = CYAML_MAPPING,
        .flags = CYAML_FLAG_POINTER,
        .data_size = sizeof(struct texts),
        .mapping.fields = add_mapping(schema, 0, shef_config_n_rows, 0),
    };
}

static enum shef_err set_rows(const struct texts *texts, const struct shef_config_keys *keys,
                              const char *name, struct shef_config *config, struct shef_error *err)
{
    const char *about[2];
    int line;

    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];

        if (!texts->of_row[i])
            continue;
        if (shef_config_set(config, row, texts->of_row[i], err) != SHEF_OK)
            return shef_fail_context(err, "%s, line %d", name,
                                     shef_config_keys_line(keys, row->key));
    }
    if (shef_config_check(config, about, err) == SHEF_OK)
        return SHEF_OK;
    /* Of two that do not fit together the file may hold one only. */
    line = shef_config_keys_line(keys, about[0]);
    if (line == 0 && about[1])
        line = shef_config_keys_line(keys, about[1]);
    return line > 0 ? shef_fail_context(err, "%s, line %d", name, line)
                    : shef_fail_context(err, "%s", name);
}

static enum shef_err load(const uint8_t *bytes, size_t n_bytes, const char *name,
                          struct schema *schema, const struct shef_config_keys *keys,
                          struct shef_config *config, struct shef_error *err)
{
    const cyaml_config_t settings = { .log_level = CYAML_LOG_ERROR, .mem_fn = cyaml_mem };
    cyaml_data_t *data = NULL;

    describe_rows(schema);

    const cyaml_err_t failure =
        cyaml_load_data(bytes, n_bytes, &settings, &schema->top, &data, NULL);
    enum shef_err code;

    if (failure == CYAML_ERR_OOM)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "read %s: out of memory", name);
    else if (failure != CYAML_OK)
        code = shef_fail(err, SHEF_ERR_FORMAT, "%s: %s", name, cyaml_strerror(failure));
    else /* an empty file gives no data: all defaults */
        code = data ? set_rows(data, keys, name, config, err) : SHEF_OK;
    cyaml_free(&settings, &schema->top, data, 0);
    return code;
}

enum shef_err shef_config_parse(const uint8_t *bytes, size_t n_bytes, const char *name,
                                struct shef_config *out_config, struct shef_error *err)
{
    struct shef_config config;
    struct shef_config_keys *keys = calloc(1, sizeof *keys);
    struct schema *schema = calloc(1, sizeof *schema);
    enum shef_err code = SHEF_ERR_NO_MEMORY;

    shef_config_defaults(&config);
    if (!keys || !schema)
        (void)shef_fail(err, code, "read %s: out of memory", name);
    else
        code = shef_config_keys_check(bytes, n_bytes, name, keys, err);
    if (code == SHEF_OK)
        code = load(bytes, n_bytes, name, schema, keys, &config, err);
    free(keys);
    free(schema);
    if (code == SHEF_OK)
        *out_config = config;
    return code;
}

enum shef_err shef_config_read(const char *path, struct shef_config *out_config,
                               struct shef_error *err)
{
    uint8_t *bytes;
    size_t n_bytes;
    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_config_parse(bytes, n_bytes, path, out_config, err);
    free(bytes);
    return code;
}
