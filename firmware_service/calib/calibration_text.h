/* The canonical text of a calibration: the values in a fixed order and notation. Thread: any. */
#ifndef SHEF_CALIB_CALIBRATION_TEXT_H
#define SHEF_CALIB_CALIBRATION_TEXT_H

#include <stddef.h>

#include "calib/calibration.h"

#define SHEF_CALIBRATION_VERSION 1

/* Writes the YAML text of everything but the id; numbers are as short as reads back exactly.
 *   out_text  free() it
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_calibration_text(const struct shef_calibration *calibration,
                                                    char **out_text, size_t *out_n_bytes,
                                                    struct shef_error *err);

#endif
