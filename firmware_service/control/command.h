/* A command of the control socket: what a part of the service offers to shefctl.
 *
 * Requests and answers are one line of JSON each (docs/control.md). A part registers its table
 * of commands with the server; the server checks who asks, parses, finds the row and calls it on
 * the control thread. A handler may read counters and hand work to other threads; it may not
 * wait for them longer than a second, because the watchdog is fed by the same thread. */
#ifndef SHEF_CONTROL_COMMAND_H
#define SHEF_CONTROL_COMMAND_H

#include <jansson.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Carries out one request.                                        Thread: control.
 *   context    of the table's registration
 *   arguments  a JSON object, perhaps empty, with the row's names only; their values are the
 * client's word: check them answer     an empty JSON object to fill On failure err holds the
 * sentence for the user, and what is in answer is dropped. */
typedef enum shef_err shef_control_handler(void *context, const json_t *arguments, json_t *answer,
                                           struct shef_error *err);

struct shef_control_command {
    const char *name; /* "status", "record start" */
    const char *help; /* one line without a full stop */
    shef_control_handler *handler;
    const char *arguments; /* what it takes, "recording|loop|pace"; NULL: nothing */
};

/* Fetches an argument that must be a text of 1 to n_bytes - 1 bytes.
 * SHEF_ERR_INVALID: missing, of another type, empty, or too long. */
SHEF_MUST_CHECK enum shef_err shef_control_text(const json_t *arguments, const char *name,
                                                char *out_text, size_t n_bytes,
                                                struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
