/* Whole files: read into memory in one go, replaced in one go.
 *
 * Encoders build their bytes in memory and hand them over at the end, so a path holds either
 * the old file or the new one, never half of one, also when the program is killed or, where the
 * file is not written lazily, the power fails. Not for streaming threads. Thread: any, one file
 * each. */
#ifndef SHEF_CORE_FILE_H
#define SHEF_CORE_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a file of at most max_bytes bytes.
 *   out_bytes    its content and a zero byte after it; free() it
 *   out_n_bytes  without that zero
 * SHEF_ERR_NOT_FOUND, PERMISSION, IO, NO_MEMORY; SHEF_ERR_INVALID: a folder, or too large. */
SHEF_MUST_CHECK enum shef_err shef_file_read(const char *path, size_t max_bytes,
                                             uint8_t **out_bytes, size_t *out_n_bytes,
                                             struct shef_error *err);

/* Reads from a place of an open regular file until buffer is full or the file ends.
 * Returns how many bytes there were, -1 with errno on failure. */
ssize_t shef_file_read_at(int fd, void *buffer, size_t n_bytes, uint64_t offset);

/* Creates the file or replaces its content. The folder must exist. A path that is there and is
 * no regular file (a pipe, /dev/stdout) is written to as it is. Returns when the disk has the
 * data, which takes milliseconds.
 * On failure the old file, if any, is untouched and nothing new is left in the folder. */
SHEF_MUST_CHECK enum shef_err shef_file_replace(const char *path, const void *bytes, size_t n_bytes,
                                                struct shef_error *err);

/* The same without waiting for the disk: a power cut soon after may leave an empty file. For what
 * can be made again, such as pictures, and for folders of many files that are synced as one. */
SHEF_MUST_CHECK enum shef_err shef_file_replace_lazily(const char *path, const void *bytes,
                                                       size_t n_bytes, struct shef_error *err);

/* After a rename to path: waits until the disk has the name. Where a file system cannot do that,
 * a power cut may bring back what the path held before; that is no error. */
void shef_file_sync_name(const char *path);

#ifdef __cplusplus
}
#endif

#endif
