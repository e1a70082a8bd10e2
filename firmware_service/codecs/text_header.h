/* The text at the front of RAW and DAT files: lines "% key value". */
#ifndef SHEF_CODECS_TEXT_HEADER_H
#define SHEF_CODECS_TEXT_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_TEXT_HEADER_MAX_BYTES 65536 /* all lines together */
#define SHEF_TEXT_VALUE_BYTES      128

struct shef_text_line {
    char key[32]; /* cut if longer */
    char value[SHEF_TEXT_VALUE_BYTES];
};

/* Reads the line at *at and moves *at behind it. A line starts with "% ", consists of printable
 * characters and ends with a newline: event data that looks like "% " by chance is none.
 * Returns false, with *at unchanged, where no such line starts. */
bool shef_text_header_next(const uint8_t *bytes, size_t n_bytes, size_t *at,
                           struct shef_text_line *out_line);

/* Whether the bytes end inside a header line. */
bool shef_text_header_is_cut(const uint8_t *bytes, size_t n_bytes, size_t at);

/* A whole number of 1 to 9 digits and nothing else. */
bool shef_text_number(const char *text, uint32_t *out_number);

#ifdef __cplusplus
}
#endif

#endif
