/* One request to shefd and its answer. Thread: main. */
#ifndef SHEFCTL_CONNECTION_H
#define SHEFCTL_CONNECTION_H

#include <stdint.h>

#include <jansson.h>

#include "core/error.h"

#define SHEF_CTL_TIMEOUT_S 15 /* what the service does within a second, on a loaded machine */

/* How a request ended; the values are shefctl's exit statuses. */
enum shef_ctl_status {
    SHEF_CTL_OK = 0,
    SHEF_CTL_USAGE = 1,
    SHEF_CTL_UNREACHABLE = 2, /* no service there, or it does not answer */
    SHEF_CTL_REFUSED = 3,     /* it is there, but not for this user, or not now */
    SHEF_CTL_FAILED = 4,      /* it tried, or declined, and says why */
};

/* Connects, asks, waits for the answer, disconnects.
 *   arguments   an object, or NULL for none; stays the caller's
 *   out_answer  only with SHEF_CTL_OK: the object in the answer, to be released */
enum shef_ctl_status shef_ctl_ask(const char *socket_path, const char *command, json_t *arguments,
                                  json_t **out_answer, struct shef_error *err);

#endif
