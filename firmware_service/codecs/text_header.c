#include "codecs/text_header.h"

#include <string.h>

#define MAX_LINE_BYTES 1024

static bool is_printable(uint8_t byte)
{
    return (byte >= 0x20 && byte < 0x7f) || byte == '\t' || byte == '\r';
}

/* The number of bytes from at up to a newline, or to the first byte that no line has. */
static size_t line_bytes(const uint8_t *bytes, size_t n_bytes, size_t at)
{
    size_t end = at;

    while (end < n_bytes && end - at < MAX_LINE_BYTES && is_printable(bytes[end]))
        end++;
    return end - at;
}

static bool starts_line(const uint8_t *bytes, size_t n_bytes, size_t at)
{
    return at + 2 <= n_bytes && at < SHEF_TEXT_HEADER_MAX_BYTES && bytes[at] == '%' &&
           bytes[at + 1] == ' ';
}

/* Copies what fits and ends it. */
static void copy_text(char *out, size_t out_bytes, const uint8_t *text, size_t n_bytes)
{
    if (n_bytes > out_bytes - 1)
        n_bytes = out_bytes - 1;
    memcpy(out, text, n_bytes);
    out[n_bytes] = '\0';
}

static bool is_space(uint8_t byte)
{
    return byte == ' ' || byte == '\t' || byte == '\r';
}

bool shef_text_header_next(const uint8_t *bytes, size_t n_bytes, size_t *at,
                           struct shef_text_line *out_line)
{
    if (!starts_line(bytes, n_bytes, *at))
        return false;

    const size_t end = *at + line_bytes(bytes, n_bytes, *at);

    if (end >= n_bytes || bytes[end] != '\n')
        return false;

    size_t key = *at + 2;
    size_t value_end = end;

    while (key < end && is_space(bytes[key]))
        key++;
    while (value_end > key && is_space(bytes[value_end - 1]))
        value_end--;

    size_t key_end = key;

    while (key_end < value_end && !is_space(bytes[key_end]))
        key_end++;

    size_t value = key_end;

    while (value < value_end && is_space(bytes[value]))
        value++;
    copy_text(out_line->key, sizeof out_line->key, bytes + key, key_end - key);
    copy_text(out_line->value, sizeof out_line->value, bytes + value, value_end - value);
    *at = end + 1;
    return true;
}

bool shef_text_header_is_cut(const uint8_t *bytes, size_t n_bytes, size_t at)
{
    return starts_line(bytes, n_bytes, at) && at + line_bytes(bytes, n_bytes, at) == n_bytes;
}

bool shef_text_number(const char *text, uint32_t *out_number)
{
    uint32_t number = 0;
    size_t n_digits = 0;

    for (; text[n_digits] >= '0' && text[n_digits] <= '9'; n_digits++) {
        if (n_digits == 9)
            return false;
        number = number * 10 + (uint32_t)(text[n_digits] - '0');
    }
    if (n_digits == 0 || text[n_digits] != '\0')
        return false;
    *out_number = number;
    return true;
}
