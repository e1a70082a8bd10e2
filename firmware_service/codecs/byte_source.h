/* A file's bytes in large pieces. Internal to the reader. */
#ifndef SHEF_CODECS_BYTE_SOURCE_H
#define SHEF_CODECS_BYTE_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_byte_source {
    bool is_open;
    int fd;
    uint8_t *bytes; /* what has been read and not yet used: at..end */
    size_t at;
    size_t end;
    bool at_end;          /* of the file */
    int64_t n_read;       /* bytes of the file */
    int64_t n_file_bytes; /* -1: not known */
};

/* Opens path and reads its first bytes, at least 64 KiB if there are so many. */
SHEF_MUST_CHECK enum shef_err shef_byte_source_open(struct shef_byte_source *source,
                                                    const char *path, struct shef_error *err);

/* Reads more where nothing is left; at the file's end at_end becomes true and nothing is left. */
SHEF_MUST_CHECK enum shef_err shef_byte_source_fill(struct shef_byte_source *source,
                                                    const char *path, struct shef_error *err);

/* A zeroed source is allowed. */
void shef_byte_source_close(struct shef_byte_source *source);

#ifdef __cplusplus
}
#endif

#endif
