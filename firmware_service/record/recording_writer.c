#include "record/recording_writer.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/clock.h"
#include "core/file.h"
#include "record/folder_list.h"

#define RESERVE_NAME   ".reserve"
#define RESERVE_BYTES  (256u << 10) /* a manifest of some 1000 files */
#define MAX_COPY_BYTES (16u << 20)  /* of a calibration or configuration */
#define MAX_NAME_BYTES 64           /* of a file inside, temporary ones included */

/* Path of a file inside the recording; create() has made sure that it fits. */
static void inside(const struct shef_recording_writer *writer, const char *name,
                   char out_path[SHEF_PART_PATH_BYTES])
{
    snprintf(out_path, SHEF_PART_PATH_BYTES, "%s/%s", writer->folder, name);
}

static void describe_now(struct shef_manifest *manifest)
{
    struct timespec utc;
    struct tm parts;
    size_t n;

    clock_gettime(CLOCK_REALTIME, &utc);
    manifest->utc_minus_host_ns =
        utc.tv_sec * SHEF_NS_PER_S + utc.tv_nsec - shef_clock_now(shef_clock_monotonic()).ns;
    gmtime_r(&utc.tv_sec, &parts);
    n = strftime(manifest->created, sizeof manifest->created, "%Y-%m-%dT%H:%M:%S", &parts);
    snprintf(manifest->created + n, sizeof manifest->created - n, ".%06ldZ", utc.tv_nsec / 1000);
}

static enum shef_err make_folder(const char *folder, struct shef_error *err)
{
    int n_entries = 0;

    if (mkdir(folder, 0777) == 0)
        return SHEF_OK;
    if (errno != EEXIST)
        return shef_fail_os(err, errno, "make the recording '%s'", folder);

    DIR *dir = opendir(folder);

    if (!dir)
        return shef_fail_os(err, errno, "make the recording '%s'", folder);
    for (const struct dirent *entry; (entry = readdir(dir));)
        n_entries += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(dir);
    return n_entries == 0
               ? SHEF_OK
               : shef_fail(err, SHEF_ERR_INVALID,
                           "record to '%s': the folder is not empty; name a new one", folder);
}

static enum shef_err copy_file(const struct shef_recording_writer *writer, const char *from,
                               const char *name, struct shef_error *err)
{
    char path[SHEF_PART_PATH_BYTES];
    uint8_t *bytes;
    size_t n_bytes;

    if (!from)
        return SHEF_OK;

    enum shef_err code = shef_file_read(from, MAX_COPY_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    inside(writer, name, path);
    code = shef_file_replace(path, bytes, n_bytes, err);
    free(bytes);
    return code;
}

/* Room for the last manifest, so that a full disk cannot keep a recording from being closed. */
static enum shef_err reserve(const struct shef_recording_writer *writer, struct shef_error *err)
{
    char path[SHEF_PART_PATH_BYTES];
    uint8_t *bytes = calloc(1, RESERVE_BYTES);

    if (!bytes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "make the recording '%s': out of memory",
                         writer->folder);
    inside(writer, RESERVE_NAME, path);

    const enum shef_err code = shef_file_replace(path, bytes, RESERVE_BYTES, err);

    free(bytes);
    return code;
}

static enum shef_err fill_folder(struct shef_recording_writer *writer,
                                 const struct shef_recording_writer_config *config,
                                 struct shef_error *err)
{
    enum shef_err code = copy_file(writer, config->calibration_path, "calibration.yaml", err);

    if (code == SHEF_OK)
        code = copy_file(writer, config->config_path, "config.yaml", err);
    if (code == SHEF_OK)
        code = reserve(writer, err);
    return code == SHEF_OK ? shef_recording_writer_update(writer, err) : code;
}

enum shef_err shef_recording_writer_create(struct shef_recording_writer *writer, const char *folder,
                                           const struct shef_recording_writer_config *config,
                                           struct shef_error *err)
{
    struct shef_manifest *manifest = &writer->manifest;

    *writer = (struct shef_recording_writer){ .lock = PTHREAD_MUTEX_INITIALIZER };
    if (strlen(folder) + MAX_NAME_BYTES >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "record to '%s': the path is too long", folder);
    snprintf(writer->folder, sizeof writer->folder, "%s", folder);
    snprintf(manifest->software, sizeof manifest->software, "%s", config->software);
    describe_now(manifest);
    if (getrandom(manifest->session, SHEF_SESSION_BYTES, 0) != SHEF_SESSION_BYTES)
        return shef_fail_os(err, errno, "record to '%s': draw a name for the session", folder);

    enum shef_err code = make_folder(folder, err);

    if (code != SHEF_OK)
        return code;
    code = fill_folder(writer, config, err);
    if (code != SHEF_OK)
        shef_recording_writer_abandon(writer);
    return code;
}

enum shef_err shef_recording_writer_add_part(struct shef_recording_writer *writer, const char *name,
                                             char out_path[SHEF_PART_PATH_BYTES],
                                             struct shef_error *err)
{
    inside(writer, name, out_path);
    return mkdir(out_path, 0777) == 0 ? SHEF_OK
                                      : shef_fail_os(err, errno, "make folder '%s'", out_path);
}

enum shef_err shef_recording_writer_update(struct shef_recording_writer *writer,
                                           struct shef_error *err)
{
    return shef_manifest_write(writer->folder, &writer->manifest, err);
}

void shef_recording_writer_judge(struct shef_recording_writer *writer, enum shef_verdict verdict,
                                 const char *reason)
{
    struct shef_manifest *manifest = &writer->manifest;

    pthread_mutex_lock(&writer->lock);
    if (verdict > manifest->verdict) {
        manifest->verdict = verdict;
        snprintf(manifest->reason, sizeof manifest->reason, "%s", reason);
    }
    pthread_mutex_unlock(&writer->lock);
}

/* Lists the files, with checksums as far as there is time for them. */
static enum shef_err list_files(struct shef_recording_writer *writer, bool with_sha256,
                                shef_go_on_fn *go_on, void *context, struct shef_error *err)
{
    struct shef_folder_list list;
    const enum shef_err code = shef_folder_list_read(writer->folder, &list, err);

    if (code != SHEF_OK)
        return code;
    writer->manifest.files = list.files;
    writer->manifest.n_files = list.n_files;
    for (size_t i = 0; with_sha256 && i < list.n_files; i++) {
        char path[PATH_MAX + SHEF_MANIFEST_PATH_BYTES + 1];

        snprintf(path, sizeof path, "%s/%s", writer->folder, list.files[i].path);
        with_sha256 = shef_sha256_file(path, go_on, context, list.files[i].sha256, NULL) == SHEF_OK;
    }
    return SHEF_OK;
}

enum shef_err shef_recording_writer_close(struct shef_recording_writer *writer, bool with_sha256,
                                          shef_go_on_fn *go_on, void *context,
                                          struct shef_error *err)
{
    char path[SHEF_PART_PATH_BYTES];

    inside(writer, RESERVE_NAME, path);
    unlink(path);
    writer->manifest.is_closed = true;

    enum shef_err code = list_files(writer, with_sha256, go_on, context, err);

    if (code == SHEF_OK)
        code = shef_recording_writer_update(writer, err);
    shef_manifest_free(&writer->manifest);
    return code;
}

void shef_recording_writer_abandon(struct shef_recording_writer *writer)
{
    static const char *const files[] = { RESERVE_NAME, SHEF_MANIFEST_NAME, "calibration.yaml",
                                         "config.yaml" };
    static const char *const parts[] = { "events", "frames", "poses", "triggers", "truth" };
    char path[SHEF_PART_PATH_BYTES];

    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        inside(writer, files[i], path);
        unlink(path);
    }
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        inside(writer, parts[i], path);
        rmdir(path);
    }
    rmdir(writer->folder);
    shef_manifest_free(&writer->manifest);
}
