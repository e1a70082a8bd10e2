/* What lies in the folder of recordings. Thread: control. */
#ifndef SHEF_SERVICE_RECORDING_LIST_H
#define SHEF_SERVICE_RECORDING_LIST_H

#include <jansson.h>

#include "core/error.h"

/* Adds "recordings" to an answer: name, state, verdict, its reason, and size of each, by name.
 *   present  path of the one that is being recorded, or ""
 * SHEF_ERR_NOT_FOUND, PERMISSION, IO: the folder. */
SHEF_MUST_CHECK enum shef_err shef_recording_list(const char *folder, const char *present,
                                                  json_t *answer, struct shef_error *err);

#endif
