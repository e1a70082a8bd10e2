#include "core/base64.h"

#include <stdlib.h>
#include <string.h>

static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

char *shef_base64_encode(const uint8_t *bytes, size_t n_bytes)
{
    char *text = malloc((n_bytes + 2) / 3 * 4 + 1);
    char *at = text;

    if (!text)
        return NULL;
    for (size_t i = 0; i < n_bytes; i += 3) {
        const size_t n = n_bytes - i < 3 ? n_bytes - i : 3;
        uint32_t word = 0;

        for (size_t k = 0; k < 3; k++)
            word = word << 8 | (k < n ? bytes[i + k] : 0u);
        for (size_t k = 0; k < 4; k++)
            *at++ = k <= n ? alphabet[word >> (18 - 6 * k) & 63] : '=';
    }
    *at = '\0';
    return text;
}

/* The six bits of a character, or -1. */
static int bits_of(char character)
{
    const char *at = character ? strchr(alphabet, character) : NULL;

    return at ? (int)(at - alphabet) : -1;
}

uint8_t *shef_base64_decode(const char *text, size_t *out_n_bytes)
{
    const size_t n_text = strlen(text);
    size_t n_padding = 0;
    size_t n_bytes = 0;
    uint8_t *bytes;

    if (n_text % 4 != 0)
        return NULL;
    while (n_padding < 2 && n_padding < n_text && text[n_text - 1 - n_padding] == '=')
        n_padding++;
    bytes = malloc(n_text / 4 * 3 + 1);
    if (!bytes)
        return NULL;
    for (size_t i = 0; i < n_text; i += 4) {
        uint32_t word = 0;

        for (size_t k = 0; k < 4; k++) {
            const int bits = i + k < n_text - n_padding ? bits_of(text[i + k]) : 0;

            if (bits < 0) {
                free(bytes);
                return NULL;
            }
            word = word << 6 | (uint32_t)bits;
        }
        for (int shift = 16; shift >= 0; shift -= 8)
            bytes[n_bytes++] = (uint8_t)(word >> shift);
    }
    *out_n_bytes = n_bytes - n_padding;
    return bytes;
}
