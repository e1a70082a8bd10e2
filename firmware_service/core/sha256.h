/* SHA-256 of whole files and of bytes, through OpenSSL's libcrypto. Thread: any. */
#ifndef SHEF_CORE_SHA256_H
#define SHEF_CORE_SHA256_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_SHA256_TEXT_BYTES 65 /* 64 hexadecimal digits and a zero */

/* Told how many bytes were just done; returns false to stop. */
typedef bool shef_go_on_fn(void *context, uint64_t n_bytes);

/*   go_on     called about every MiB; NULL: never
 *   out_text  64 hexadecimal digits
 * SHEF_ERR_GONE: go_on said to stop. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_sha256_file(const char *path, shef_go_on_fn *go_on,
                                               void *context, char out_text[SHEF_SHA256_TEXT_BYTES],
                                               struct shef_error *err);

/* The same for bytes in memory.
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_sha256_bytes(const void *bytes, size_t n_bytes,
                                                char out_text[SHEF_SHA256_TEXT_BYTES],
                                                struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
