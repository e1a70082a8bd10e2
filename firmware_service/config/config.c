#include "config/config.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/words.h"

const struct shef_config_row *shef_config_find(const char *key)
{
    for (int i = 0; i < shef_config_n_rows; i++)
        if (strcmp(shef_config_rows[i].key, key) == 0)
            return &shef_config_rows[i];
    return NULL;
}

static const char *last_part(const char *key)
{
    const char *dot = strrchr(key, '.');

    return dot ? dot + 1 : key;
}

/* The setting, or the section around settings, that is nearest. */
static void hint_at_nearest(const char *key, char *out_hint)
{
    size_t least = SIZE_MAX;

    for (int i = 0; i < shef_config_n_rows; i++) {
        const char *own = shef_config_rows[i].key;

        for (size_t n = strcspn(own, "."); n > 0;
             n = own[n] ? n + 1 + strcspn(own + n + 1, ".") : 0) {
            char part[SHEF_WORDS_HINT_BYTES - 24];

            snprintf(part, sizeof part, "%.*s", (int)n, own);

            const size_t distance = shef_words_distance(part, key);

            if (distance < least && shef_words_is_near(last_part(key), distance)) {
                least = distance;
                snprintf(out_hint, SHEF_WORDS_HINT_BYTES, "; is '%s' meant?", part);
            }
        }
    }
}

void shef_config_hint(const char *key, char *out_hint)
{
    out_hint[0] = '\0';
    hint_at_nearest(key, out_hint);
    for (int i = 0; i < shef_config_n_rows && !*out_hint; i++)
        if (strcmp(last_part(shef_config_rows[i].key), last_part(key)) == 0)
            snprintf(out_hint, SHEF_WORDS_HINT_BYTES, "; is '%s' meant?", shef_config_rows[i].key);
}

static enum shef_err set_number(const struct shef_config_row *row, int32_t *field, const char *text,
                                struct shef_error *err)
{
    const char *unit = row->unit ? row->unit : "";
    char *end;

    errno = 0;
    const long long number = strtoll(text, &end, 10);
    const bool is_within = number >= row->min && number <= row->max;

    if (errno || end == text || *end || !(is_within || (row->zero && number == 0)))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "%s: '%s' must be a whole number from %" PRId64 " to %" PRId64 "%s%s%s",
                         row->key, text, row->min, row->max, row->unit ? " " : "", unit,
                         row->zero ? ", or 0" : "");
    *field = (int32_t)number;
    return SHEF_OK;
}

static enum shef_err find_choice(const struct shef_config_row *row, const char *text,
                                 int32_t *out_index, struct shef_error *err)
{
    char hint[SHEF_WORDS_HINT_BYTES];
    char word[SHEF_CONFIG_NAME_BYTES];

    for (int32_t i = 0; shef_words_at(row->choices, i, word, sizeof word); i++) {
        if (strcmp(word, text) == 0) {
            *out_index = i;
            return SHEF_OK;
        }
    }
    shef_words_hint(row->choices, text, hint);
    return shef_fail(err, SHEF_ERR_INVALID, "%s: '%s' must be one of %s%s", row->key, text,
                     row->choices, hint);
}

static enum shef_err set_text(const struct shef_config_row *row, char *field, const char *text,
                              struct shef_error *err)
{
    const size_t n = strlen(text);

    if (n < (size_t)row->min)
        return shef_fail(err, SHEF_ERR_INVALID, "%s: must not be empty", row->key);
    if (n >= row->field_bytes)
        return shef_fail(err, SHEF_ERR_INVALID, "%s: the text is longer than %zu bytes", row->key,
                         row->field_bytes - 1);

    char printable[SHEF_CONFIG_PATH_BYTES];

    assert(n < sizeof printable);
    memcpy(printable, text, n + 1);
    shef_keep_printable(printable);
    if (strcmp(printable, text) != 0)
        return shef_fail(err, SHEF_ERR_INVALID, "%s: the text contains a control character",
                         row->key);
    memcpy(field, text, n + 1);
    return SHEF_OK;
}

enum shef_err shef_config_set(struct shef_config *config, const struct shef_config_row *row,
                              const char *text, struct shef_error *err)
{
    void *field = (char *)config + row->field;
    int32_t index;
    enum shef_err code;

    switch (row->kind) {
    case SHEF_CONFIG_BOOL:
        if (strcmp(text, "true") != 0 && strcmp(text, "false") != 0)
            return shef_fail(err, SHEF_ERR_INVALID, "%s: '%s' must be true or false", row->key,
                             text);
        *(bool *)field = text[0] == 't';
        return SHEF_OK;
    case SHEF_CONFIG_INT:
        return set_number(row, field, text, err);
    case SHEF_CONFIG_CHOICE:
        return find_choice(row, text, field, err);
    case SHEF_CONFIG_WORD:
        code = find_choice(row, text, &index, err);
        return code == SHEF_OK ? set_text(row, field, text, err) : code;
    case SHEF_CONFIG_TEXT:
        break;
    }
    return set_text(row, field, text, err);
}

void shef_config_get(const struct shef_config *config, const struct shef_config_row *row,
                     char *out_text, size_t n_bytes)
{
    const void *field = (const char *)config + row->field;

    switch (row->kind) {
    case SHEF_CONFIG_BOOL:
        snprintf(out_text, n_bytes, "%s", *(const bool *)field ? "true" : "false");
        return;
    case SHEF_CONFIG_INT:
        snprintf(out_text, n_bytes, "%" PRId32, *(const int32_t *)field);
        return;
    case SHEF_CONFIG_CHOICE:
        if (!shef_words_at(row->choices, *(const int32_t *)field, out_text, n_bytes))
            assert(!"a choice outside its own list");
        return;
    case SHEF_CONFIG_TEXT:
    case SHEF_CONFIG_WORD:
        snprintf(out_text, n_bytes, "%s", (const char *)field);
        return;
    }
}

void shef_config_defaults(struct shef_config *out_config)
{
    memset(out_config, 0, sizeof *out_config);
    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        const enum shef_err code = shef_config_set(out_config, row, row->preset, NULL);

        assert(code == SHEF_OK && "a default must pass its own check");
        (void)code;
    }
}

static enum shef_err check_order(const struct shef_config *config, const char *out_keys[2],
                                 struct shef_error *err)
{
    const struct {
        const char *key;
        int32_t ms;
    } order[] = {
        { "shed.dense_ms", config->shed.dense_ms },
        { "shed.cloud_ms", config->shed.cloud_ms },
        { "shed.full_grid_ms", config->shed.full_grid_ms },
        { "shed.range_ms", config->shed.range_ms },
        { "shed.frame_ms", config->shed.frame_ms },
    };

    for (size_t i = 1; i < sizeof order / sizeof order[0]; i++)
        if (order[i].ms < order[i - 1].ms) {
            out_keys[0] = order[i].key;
            out_keys[1] = order[i - 1].key;
            return shef_fail(err, SHEF_ERR_INVALID,
                             "%s (%d ms) is below %s (%d ms), but cheaper work is left out first",
                             order[i].key, order[i].ms, order[i - 1].key, order[i - 1].ms);
        }
    return SHEF_OK;
}

/* The service's folder is not that of who writes the settings, and no shell reads them. */
static enum shef_err check_paths(const struct shef_config *config, const char *out_keys[2],
                                 struct shef_error *err)
{
    const struct {
        const char *key;
        const char *path;
        bool is_full; /* must be */
    } paths[] = {
        { "source.recording", config->source.recording, false },
        { "calibration.file", config->calibration.file, false },
        { "record.folder", config->record.folder, true },
        { "control.socket", config->control.socket, true },
    };

    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        out_keys[0] = paths[i].key;
        if (paths[i].path[0] == '~')
            return shef_fail(err, SHEF_ERR_INVALID,
                             "%s: '%s': only shells know what ~ means; write the full path",
                             paths[i].key, paths[i].path);
        if (paths[i].is_full && paths[i].path[0] != '/')
            return shef_fail(err, SHEF_ERR_INVALID,
                             "%s: '%s' must be a full path, beginning with /", paths[i].key,
                             paths[i].path);
    }
    return SHEF_OK;
}

enum shef_err shef_config_check(const struct shef_config *config, const char *out_keys[2],
                                struct shef_error *err)
{
    const char *keys[2] = { NULL, NULL };
    enum shef_err code = check_order(config, keys, err);

    if (code == SHEF_OK)
        code = check_paths(config, keys, err);
    if (code != SHEF_OK && out_keys)
        memcpy(out_keys, keys, sizeof keys);
    return code;
}
