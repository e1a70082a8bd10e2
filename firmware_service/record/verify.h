/* Checks a whole recording: every block against its checksum, every file against its SHA-256.
 *
 * Reads everything and changes nothing. Thread: any. */
#ifndef SHEF_RECORD_VERIFY_H
#define SHEF_RECORD_VERIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "core/sha256.h"
#include "record/block_reader.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_VERIFY_MAX_PROBLEMS 32

struct shef_verify_report {
    uint64_t n_blocks;         /* of all parts, intact */
    struct shef_damage damage; /* of all parts */
    uint64_t n_files;          /* compared with their SHA-256 */
    uint64_t n_unhashed_files; /* the manifest has no SHA-256 of them */
    uint64_t n_new_files;      /* the manifest does not know them */
    uint64_t n_problems;
    char problems[SHEF_VERIFY_MAX_PROBLEMS][SHEF_ERROR_TEXT_BYTES]; /* the first ones, one
                                                                       sentence each */
};

/* How many bytes there are to read, for a progress bar; 0 if that cannot be told. */
uint64_t shef_recording_verify_size(const char *path);

/*   go_on  told of bytes read; NULL: never
 * SHEF_OK: everything was looked at; n_problems says how it was.
 * SHEF_ERR_GONE: go_on said to stop. Also the errors of shef_recording_inspect() and of the
 * system. */
SHEF_MUST_CHECK enum shef_err shef_recording_verify(const char *path, shef_go_on_fn *go_on,
                                                    void *context,
                                                    struct shef_verify_report *out_report,
                                                    struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
