#include "service/recording_place.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

/* So many recordings may be begun in one second. */
#define MAX_OF_A_SECOND 100

enum shef_err shef_recording_place_check_space(const char *path, const struct shef_config *config,
                                               struct shef_error *err)
{
    const int32_t min_mb = config->record.min_free_mb;
    struct statvfs disk;
    uint64_t free_mb;

    if (min_mb == 0)
        return SHEF_OK;
    if (statvfs(path, &disk) != 0)
        return shef_fail_os(err, errno, "ask for the free space of '%s'", path);
    free_mb = (uint64_t)disk.f_bavail * disk.f_frsize / 1000000;
    if (free_mb >= (uint64_t)min_mb)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_NO_SPACE,
                     "record to '%s': its disk has %llu MB left, less than record.min_free_mb, %d",
                     path, (unsigned long long)free_mb, min_mb);
}

static enum shef_err check_folder(const struct shef_config *config, struct shef_error *err)
{
    const char *folder = config->record.folder;
    struct stat info;
    int failure = 0;

    if (stat(folder, &info) != 0)
        failure = errno;
    else if (!S_ISDIR(info.st_mode))
        failure = ENOTDIR;
    if (failure != 0) {
        (void)shef_fail_os(err, failure, "record start: find the folder '%s'", folder);
    } else if (faccessat(AT_FDCWD, folder, W_OK | X_OK, AT_EACCESS) != 0) {
        failure = errno;
        (void)shef_fail_os(err, failure, "record start: write to the folder '%s'", folder);
    } else if (shef_recording_place_check_space(folder, config, err) == SHEF_ERR_NO_SPACE) {
        failure = ENOSPC;
        (void)shef_fail_context(err, "record start");
    }
    if (failure == 0)
        return SHEF_OK;

    const size_t used = strlen(err->text);

    snprintf(err->text + used, sizeof err->text - used, "; %s",
             failure == ENOSPC   ? "make room or set record.folder to another disk"
             : failure == ENOENT ? "make it, or set record.folder to one that is there"
                                 : "let the service's user write there, or set record.folder to "
                                   "another one");
    return err->code;
}

/* A folder's name that neither hides, nor leads elsewhere, nor looks like an option or disturbs a
 * terminal when somebody lists it. */
static enum shef_err check_name(const char *name, struct shef_error *err)
{
    char printable[SHEF_CONFIG_NAME_BYTES];

    snprintf(printable, sizeof printable, "%s", name);
    shef_keep_printable(printable);
    if (!strchr(".- ", name[0]) && !strchr(name, '/') && strcmp(printable, name) == 0)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "record start '%s': a name may not begin with a dot, a dash or a blank, nor "
                     "hold a slash or a control character",
                     name);
}

/* Whether there is something by that name, be it a link to nowhere. */
static bool is_taken(const char *path)
{
    struct stat info;

    return lstat(path, &info) == 0;
}

static enum shef_err join(const struct shef_config *config, const char *name, char *out_path,
                          struct shef_error *err)
{
    const int n = snprintf(out_path, SHEF_CONFIG_PATH_BYTES, "%s/%s", config->record.folder, name);

    if (n > 0 && n < SHEF_CONFIG_PATH_BYTES)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID, "record start '%s': the path is too long", name);
}

static enum shef_err choose_by_date(const struct shef_config *config, char *out_path,
                                    struct shef_error *err)
{
    const time_t now = time(NULL);
    enum shef_err code = SHEF_ERR_FULL;
    struct tm utc;
    char date[32];
    char name[48];

    gmtime_r(&now, &utc);
    strftime(date, sizeof date, "%Y%m%dT%H%M%SZ", &utc);
    for (int i = 1; i <= MAX_OF_A_SECOND; i++) {
        snprintf(name, sizeof name, i > 1 ? "%s-%d" : "%s", date, i);
        code = join(config, name, out_path, err);
        if (code != SHEF_OK || !is_taken(out_path))
            return code;
    }
    return shef_fail(err, SHEF_ERR_INVALID, "record start: '%s' is taken; name the recording",
                     out_path);
}

enum shef_err shef_recording_place(const struct shef_config *config, const char *name,
                                   char *out_path, struct shef_error *err)
{
    enum shef_err code = name ? check_name(name, err) : SHEF_OK;

    if (code == SHEF_OK)
        code = check_folder(config, err);
    if (code != SHEF_OK || !name)
        return code == SHEF_OK ? choose_by_date(config, out_path, err) : code;
    code = join(config, name, out_path, err);
    if (code == SHEF_OK && is_taken(out_path))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record start '%s': '%s' is there already; take another name", name,
                         out_path);
    return code;
}
