#include "record/front_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char end_line[] = "% end\n";

static bool add_line(struct shef_front_text *text, const char *key, const char *value)
{
    const size_t room = SHEF_FRONT_TEXT_BYTES - text->n_bytes - sizeof end_line;
    char *line = text->bytes + text->n_bytes;
    const int n = snprintf(line, room, "%% %s %s\n", key, value);

    if (n < 0 || (size_t)n >= room) {
        *line = '\0';
        return false;
    }
    for (char *at = line; at < line + n - 1; at++)
        if (*at < ' ' || *at > '~')
            *at = '?';
    text->n_bytes += (uint32_t)n;
    return true;
}

void shef_front_text_begin(struct shef_front_text *text, const char *kind)
{
    text->n_bytes = 0;
    (void)add_line(text, kind, "1");
}

bool shef_front_text_add(struct shef_front_text *text, const char *key, const char *value)
{
    return add_line(text, key, value);
}

void shef_front_text_end(struct shef_front_text *text)
{
    memcpy(text->bytes + text->n_bytes, end_line, sizeof end_line);
    text->n_bytes += sizeof end_line - 1;
}

/* Takes the line at *at apart and moves *at behind it. Returns false at the end, or at what is no
 * such line. */
static bool next_line(const struct shef_front_text *text, size_t *at, const char **out_key,
                      size_t *out_key_bytes, const char **out_value, size_t *out_value_bytes)
{
    const char *line = text->bytes + *at;
    const size_t n_left = text->n_bytes - *at;
    const char *end = memchr(line, '\n', n_left);

    if (!end || end - line < 2 || memcmp(line, "% ", 2) != 0)
        return false;

    const char *key = line + 2;
    const char *space = memchr(key, ' ', (size_t)(end - key));

    *out_key = key;
    *out_key_bytes = (size_t)((space ? space : end) - key);
    *out_value = space ? space + 1 : end;
    *out_value_bytes = (size_t)(end - *out_value);
    *at += (size_t)(end + 1 - line);
    return true;
}

static bool is_text(const char *bytes, size_t n_bytes, const char *text)
{
    return strlen(text) == n_bytes && memcmp(bytes, text, n_bytes) == 0;
}

enum shef_err shef_front_text_check(const struct shef_front_text *text, const char *kind,
                                    struct shef_error *err)
{
    const char *key;
    const char *value;
    size_t n_key;
    size_t n_value;
    size_t at = 0;

    if (!next_line(text, &at, &key, &n_key, &value, &n_value) || !is_text(key, n_key, kind))
        return shef_fail(err, SHEF_ERR_FORMAT, "its front does not say '%s'", kind);
    if (!is_text(value, n_value, "1"))
        return shef_fail(
            err, SHEF_ERR_UNSUPPORTED,
            "it is of a version of %s that this program does not know; use a newer one", kind);
    while (next_line(text, &at, &key, &n_key, &value, &n_value))
        if (is_text(key, n_key, "end") && at == text->n_bytes)
            return SHEF_OK;
    return shef_fail(err, SHEF_ERR_FORMAT, "the text at its front is cut or damaged");
}

bool shef_front_text_get(const struct shef_front_text *text, const char *key, int n,
                         char *out_value, size_t value_bytes)
{
    const char *found;
    const char *value;
    size_t n_found;
    size_t n_value;
    size_t at = 0;

    out_value[0] = '\0';
    while (next_line(text, &at, &found, &n_found, &value, &n_value))
        if (is_text(found, n_found, key) && n-- == 0) {
            if (n_value >= value_bytes)
                return false;
            memcpy(out_value, value, n_value);
            out_value[n_value] = '\0';
            return true;
        }
    return false;
}
