/* One line of the control protocol: parsing requests, writing answers. docs/control.md.
 * Thread: control. */
#ifndef SHEF_CONTROL_REQUEST_H
#define SHEF_CONTROL_REQUEST_H

#include <stdbool.h>
#include <stddef.h>

#include <jansson.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CONTROL_REQUEST_BYTES 16384 /* longest request, its line end included */
#define SHEF_CONTROL_NAME_BYTES    32

struct shef_control_request {
    char command[SHEF_CONTROL_NAME_BYTES];
    json_t *arguments; /* an object, perhaps empty; json_decref() it */
};

/* Parses one line, without its end.
 * SHEF_ERR_FORMAT: no JSON. SHEF_ERR_INVALID: JSON, but no request. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_control_request_parse(const char *line, size_t n_bytes,
                                                         struct shef_control_request *out_request,
                                                         struct shef_error *err);

/* The answer's line, its end included; free() it. NULL: out of memory.
 *   answer  what the handler filled in */
char *shef_control_answer(const json_t *answer);

/* The same for a refusal.
 *   closes  the connection ends with it: the client, not what it asked for, is refused */
char *shef_control_refusal(const struct shef_error *err, bool closes);

/* A text as JSON. Bytes that are no UTF-8, as names of files may have, become '?'. */
json_t *shef_control_string(const char *text);

#ifdef __cplusplus
}
#endif

#endif
