#include "codecs/byte_source.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "codecs/text_header.h"

/* Stays in the L2 cache beside a batch. */
#define BUFFER_BYTES 131072

_Static_assert(BUFFER_BYTES >= SHEF_TEXT_HEADER_MAX_BYTES, "a header fits the buffer");

/* One read() into the free end of the buffer. */
static enum shef_err read_more(struct shef_byte_source *source, const char *path,
                               struct shef_error *err)
{
    ssize_t n;

    do
        n = read(source->fd, source->bytes + source->end, BUFFER_BYTES - source->end);
    while (n < 0 && errno == EINTR);
    if (n < 0)
        return shef_fail_os(err, errno, "read '%s' after %lld bytes", path,
                            (long long)source->n_read);
    source->at_end = n == 0;
    source->end += (size_t)n;
    source->n_read += n;
    return SHEF_OK;
}

enum shef_err shef_byte_source_open(struct shef_byte_source *source, const char *path,
                                    struct shef_error *err)
{
    struct stat status;
    enum shef_err code = SHEF_OK;

    *source = (struct shef_byte_source){ .fd = open(path, O_RDONLY | O_CLOEXEC) };
    if (source->fd < 0)
        return shef_fail_os(err, errno, "open event file '%s'", path);
    source->is_open = true;
    if (fstat(source->fd, &status) != 0) {
        code = shef_fail_os(err, errno, "look at event file '%s'", path);
    } else if (S_ISDIR(status.st_mode)) {
        code = shef_fail(err, SHEF_ERR_INVALID, "'%s' is a folder, not an event file", path);
    } else {
        source->n_file_bytes = S_ISREG(status.st_mode) ? status.st_size : -1;
        source->bytes = malloc(BUFFER_BYTES);
        if (!source->bytes)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "read '%s': out of memory", path);
    }
    while (code == SHEF_OK && !source->at_end && source->end < SHEF_TEXT_HEADER_MAX_BYTES)
        code = read_more(source, path, err);
    if (code != SHEF_OK)
        shef_byte_source_close(source);
    return code;
}

enum shef_err shef_byte_source_fill(struct shef_byte_source *source, const char *path,
                                    struct shef_error *err)
{
    if (source->at < source->end || source->at_end)
        return SHEF_OK;
    source->at = 0;
    source->end = 0;
    return read_more(source, path, err);
}

void shef_byte_source_close(struct shef_byte_source *source)
{
    if (source->is_open)
        close(source->fd);
    free(source->bytes);
    *source = (struct shef_byte_source){ 0 };
}
