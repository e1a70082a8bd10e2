/* The text at the front of our own parts' data files: "% shef-frames 1", lines "% key value",
 * "% end". Thread: any. */
#ifndef SHEF_RECORD_FRONT_TEXT_H
#define SHEF_RECORD_FRONT_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FRONT_TEXT_BYTES 8192

struct shef_front_text {
    char bytes[SHEF_FRONT_TEXT_BYTES];
    uint32_t n_bytes;
};

/* Begins a text of version 1 of a kind: "shef-frames". */
void shef_front_text_begin(struct shef_front_text *text, const char *kind);

/* Adds a line. Characters that are not printable become '?'.
 * Returns false if there is no room; nothing was added then. */
bool shef_front_text_add(struct shef_front_text *text, const char *key, const char *value);

/* Adds the last line, for which there is always room. */
void shef_front_text_end(struct shef_front_text *text);

/* Whether the text is whole and of this kind.
 * SHEF_ERR_FORMAT: not of this kind, or cut. SHEF_ERR_UNSUPPORTED: of a later version. */
SHEF_MUST_CHECK enum shef_err shef_front_text_check(const struct shef_front_text *text,
                                                    const char *kind, struct shef_error *err);

/* Copies the value of the n-th line, from 0, with a key.
 * Returns false, and "", if there is none or it does not fit. */
bool shef_front_text_get(const struct shef_front_text *text, const char *key, int n,
                         char *out_value, size_t value_bytes);

#ifdef __cplusplus
}
#endif

#endif
