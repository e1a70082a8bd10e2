/* Where a recording goes: its name, the folder of recordings, and the room on its disk.
 * Thread: control. */
#ifndef SHEF_SERVICE_RECORDING_PLACE_H
#define SHEF_SERVICE_RECORDING_PLACE_H

#include "config/config.h"
#include "core/error.h"

/* Chooses the folder of a new recording and checks that one can be made there.
 *   name      of the folder; NULL: made of the date
 *   out_path  SHEF_CONFIG_PATH_BYTES
 * SHEF_ERR_INVALID: that cannot be a name, or it is taken. SHEF_ERR_NOT_FOUND, PERMISSION, IO: the
 * folder of recordings. SHEF_ERR_NO_SPACE: less than record.min_free_mb. */
SHEF_MUST_CHECK enum shef_err shef_recording_place(const struct shef_config *config,
                                                   const char *name, char *out_path,
                                                   struct shef_error *err);

/* Whether there is as much room as record.min_free_mb wants.
 *   path  anything on that disk
 * SHEF_ERR_NO_SPACE, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recording_place_check_space(const char *path,
                                                               const struct shef_config *config,
                                                               struct shef_error *err);

#endif
