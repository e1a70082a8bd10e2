/* Base64 (RFC 4648, section 4): pictures inside JSON. Thread: any. */
#ifndef SHEF_CORE_BASE64_H
#define SHEF_CORE_BASE64_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The text of some bytes, terminated; free() it. NULL: out of memory. */
char *shef_base64_encode(const uint8_t *bytes, size_t n_bytes);

/* Decodes a text.
 *   out_n_bytes  how many bytes it holds
 * free() the result. NULL: that is no base64, or out of memory. */
uint8_t *shef_base64_decode(const char *text, size_t *out_n_bytes);

#ifdef __cplusplus
}
#endif

#endif
