/* A recording folder as a whole: what it holds and what its manifest says.
 *
 * Parts that this program does not know are listed like the others. Thread: any. */
#ifndef SHEF_RECORD_RECORDING_H
#define SHEF_RECORD_RECORDING_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/manifest.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_RECORDING_MAX_PARTS 16

/* A folder inside the recording. */
struct shef_recording_part {
    char name[64];
    uint64_t n_files;
    uint64_t n_bytes;
};

struct shef_recording {
    bool has_manifest;
    struct shef_manifest manifest;                /* only if it could be read */
    char manifest_trouble[SHEF_ERROR_TEXT_BYTES]; /* why not; "" if it could */
    bool has_calibration;
    bool has_config;
    struct shef_recording_part parts[SHEF_RECORDING_MAX_PARTS];
    int n_parts;
};

/* Whether a path leads to a folder with a manifest or an event part. */
bool shef_recording_is_at(const char *path);

/* Looks at a recording; shef_recording_free() afterwards. A manifest that is missing or damaged
 * is no failure.
 * SHEF_ERR_FORMAT: the folder is not a recording. SHEF_ERR_UNSUPPORTED: of a later version.
 * Errors of the system otherwise. */
SHEF_MUST_CHECK enum shef_err shef_recording_inspect(const char *path,
                                                     struct shef_recording *out_recording,
                                                     struct shef_error *err);

/* A zeroed recording is allowed. */
void shef_recording_free(struct shef_recording *recording);

#ifdef __cplusplus
}
#endif

#endif
