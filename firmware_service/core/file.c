#include "core/file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

ssize_t shef_file_read_at(int fd, void *buffer, size_t n_bytes, uint64_t offset)
{
    size_t n_done = 0;

    while (n_done < n_bytes) {
        const ssize_t n_read =
            pread(fd, (uint8_t *)buffer + n_done, n_bytes - n_done, (off_t)(offset + n_done));

        if (n_read < 0 && errno == EINTR)
            continue;
        if (n_read < 0)
            return -1;
        if (n_read == 0)
            break;
        n_done += (size_t)n_read;
    }
    return (ssize_t)n_done;
}

static enum shef_err read_open_file(int fd, const char *path, size_t max_bytes, uint8_t **out_bytes,
                                    size_t *out_n_bytes, struct shef_error *err)
{
    struct stat info;

    if (fstat(fd, &info) != 0)
        return shef_fail_os(err, errno, "read '%s'", path);
    if (!S_ISREG(info.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID, "read '%s': it is not a regular file", path);
    if ((uintmax_t)info.st_size > max_bytes)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "read '%s': %jd bytes are more than the %zu that such a file can have",
                         path, (intmax_t)info.st_size, max_bytes);

    uint8_t *bytes = malloc((size_t)info.st_size + 1);

    if (!bytes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read '%s': out of memory", path);

    const ssize_t n_bytes = shef_file_read_at(fd, bytes, (size_t)info.st_size, 0);

    if (n_bytes < 0) {
        const int failure = errno;

        free(bytes);
        return shef_fail_os(err, failure, "read '%s'", path);
    }
    bytes[n_bytes] = 0;
    *out_bytes = bytes;
    *out_n_bytes = (size_t)n_bytes;
    return SHEF_OK;
}

enum shef_err shef_file_read(const char *path, size_t max_bytes, uint8_t **out_bytes,
                             size_t *out_n_bytes, struct shef_error *err)
{
    /* Non-blocking, or a named pipe nobody writes to would hold us before we can refuse it. */
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

    if (fd < 0)
        return shef_fail_os(err, errno, "read '%s'", path);

    const enum shef_err code = read_open_file(fd, path, max_bytes, out_bytes, out_n_bytes, err);

    close(fd);
    return code;
}

/* Returns 0 or errno. */
static int write_all(int fd, const uint8_t *bytes, size_t n_bytes)
{
    size_t n_done = 0;

    while (n_done < n_bytes) {
        const ssize_t n_written = write(fd, bytes + n_done, n_bytes - n_done);

        if (n_written < 0 && errno == EINTR)
            continue;
        if (n_written < 0)
            return errno;
        n_done += (size_t)n_written;
    }
    return 0;
}

static int close_checked(int fd, int failure)
{
    return close(fd) != 0 && failure == 0 ? errno : failure;
}

static int write_in_place(const char *path, const uint8_t *bytes, size_t n_bytes)
{
    const int fd = open(path, O_WRONLY | O_CLOEXEC);

    return fd < 0 ? errno : close_checked(fd, write_all(fd, bytes, n_bytes));
}

/* The folder of path, "." if it names none. Returns false if it does not fit. */
static bool folder_of(const char *path, char out_folder[PATH_MAX])
{
    const char *slash = strrchr(path, '/');
    const size_t n_chars = slash ? (size_t)(slash - path) + 1 : 1;

    if (n_chars >= PATH_MAX)
        return false;
    memcpy(out_folder, slash ? path : ".", n_chars);
    out_folder[n_chars] = '\0';
    return true;
}

/* A name beside path that no other writer uses. Returns false if it does not fit. */
static bool temp_beside(const char *folder, char out_temp[PATH_MAX])
{
    static _Atomic unsigned n_temps;
    /* Relaxed: only the number must be unique. */
    const unsigned number = atomic_fetch_add_explicit(&n_temps, 1, memory_order_relaxed);

    return snprintf(out_temp, PATH_MAX, "%s/.shef-%ld-%u.tmp", folder, (long)getpid(), number) <
           PATH_MAX;
}

/* Gives a nameless file its name. A new name takes one step; an existing one is replaced by way
 * of a temporary name, because linking never overwrites. Returns 0 or errno. */
static int name_file(int fd, const char *path, const char *temp)
{
    char source[64];

    snprintf(source, sizeof source, "/proc/self/fd/%d", fd);
    if (linkat(AT_FDCWD, source, AT_FDCWD, path, AT_SYMLINK_FOLLOW) == 0)
        return 0;
    if (errno != EEXIST)
        return errno;
    /* A program that was killed here may have had our process number and left its file. */
    unlink(temp);
    if (linkat(AT_FDCWD, source, AT_FDCWD, temp, AT_SYMLINK_FOLLOW) != 0)
        return errno;
    if (rename(temp, path) != 0) {
        const int failure = errno;

        unlink(temp);
        return failure;
    }
    return 0;
}

/* Writes everything and, if asked, waits until the disk has it. Returns 0 or errno. */
static int fill(int fd, const uint8_t *bytes, size_t n_bytes, bool durable)
{
    const int failure = write_all(fd, bytes, n_bytes);

    return failure == 0 && durable && fsync(fd) != 0 ? errno : failure;
}

/* For file systems that know no nameless files. Returns 0 or errno. */
static int replace_by_temp(const char *path, const char *temp, const uint8_t *bytes, size_t n_bytes,
                           bool durable)
{
    const int fd = open(temp, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);

    if (fd < 0)
        return errno;

    int failure = close_checked(fd, fill(fd, bytes, n_bytes, durable));

    if (failure == 0 && rename(temp, path) != 0)
        failure = errno;
    if (failure != 0)
        unlink(temp);
    return failure;
}

static int replace(const char *path, const uint8_t *bytes, size_t n_bytes, bool durable)
{
    char folder[PATH_MAX], temp[PATH_MAX];

    if (!folder_of(path, folder) || !temp_beside(folder, temp))
        return ENAMETOOLONG;

    /* A nameless file vanishes by itself if the program is killed while it writes. */
    const int fd = open(folder, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);

    /* EISDIR: a kernel, EOPNOTSUPP: a file system that does not know O_TMPFILE. */
    if (fd < 0 && (errno == EOPNOTSUPP || errno == EISDIR))
        return replace_by_temp(path, temp, bytes, n_bytes, durable);
    if (fd < 0)
        return errno;

    /* Before the name: a file system may write the name first, and a power cut between the two
     * would leave an empty file where the old one was. */
    int failure = fill(fd, bytes, n_bytes, durable);

    if (failure == 0)
        failure = name_file(fd, path, temp);
    return close_checked(fd, failure);
}

static enum shef_err write_file(const char *path, const void *bytes, size_t n_bytes, bool durable,
                                struct shef_error *err)
{
    struct stat info;
    const bool in_place =
        stat(path, &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode);
    const int failure =
        in_place ? write_in_place(path, bytes, n_bytes) : replace(path, bytes, n_bytes, durable);

    if (failure == 0 && durable && !in_place)
        shef_file_sync_name(path);
    return failure == 0 ? SHEF_OK : shef_fail_os(err, failure, "write '%s'", path);
}

enum shef_err shef_file_replace(const char *path, const void *bytes, size_t n_bytes,
                                struct shef_error *err)
{
    return write_file(path, bytes, n_bytes, true, err);
}

enum shef_err shef_file_replace_lazily(const char *path, const void *bytes, size_t n_bytes,
                                       struct shef_error *err)
{
    return write_file(path, bytes, n_bytes, false, err);
}

void shef_file_sync_name(const char *path)
{
    char folder[PATH_MAX];

    if (!folder_of(path, folder))
        return;

    const int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    if (fd < 0)
        return;
    (void)fsync(fd);
    close(fd);
}
