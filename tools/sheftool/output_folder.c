#include "sheftool/output_folder.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"

/* Removes a folder of ours: files, and folders of files. Errors leave the rest in place. */
static void remove_folder(const char *path, int depth)
{
    DIR *dir = opendir(path);

    if (!dir)
        return;
    for (const struct dirent *entry; (entry = readdir(dir));) {
        char inner[SHEF_PATH_BYTES];

        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        snprintf(inner, sizeof inner, "%s/%s", path, entry->d_name);
        if (unlink(inner) != 0 && errno == EISDIR && depth > 0)
            remove_folder(inner, depth - 1);
    }
    closedir(dir);
    rmdir(path);
}

/* Makes the missing folders above `path` and counts them, so that a failure can remove them. */
static enum shef_err make_parents(struct shef_output_folder *folder, struct shef_error *err)
{
    for (char *slash = folder->final + 1; (slash = strchr(slash, '/')); slash++) {
        *slash = '\0';
        const int failed = mkdir(folder->final, 0755);
        const int os_errno = errno;

        if (failed && os_errno != EEXIST) {
            const enum shef_err code =
                shef_fail_os(err, os_errno, "make folder '%s'", folder->final);

            *slash = '/';
            return code;
        }
        *slash = '/';
        folder->n_parents_made += !failed;
    }
    return SHEF_OK;
}

static void remove_parents(struct shef_output_folder *folder)
{
    for (; folder->n_parents_made > 0; folder->n_parents_made--) {
        char *slash = strrchr(folder->final, '/');

        *slash = '\0';
        if (rmdir(folder->final) != 0)
            break;
    }
    folder->n_parents_made = 0;
}

static bool is_listed(const json_t *files, const char *name)
{
    size_t i;
    json_t *item;

    json_array_foreach(files, i, item)
    {
        const char *listed = json_string_value(item);
        const size_t n = strlen(name);

        /* A folder is ours if the list names a file in it. */
        if (listed && strncmp(listed, name, n) == 0 && (listed[n] == '\0' || listed[n] == '/'))
            return true;
    }
    return false;
}

/* Finds the first entry, at most one folder deep, that an earlier result did not write. */
static bool find_foreign(const char *path, const char *prefix, const json_t *files, char *out_name,
                         size_t n_bytes)
{
    DIR *dir = opendir(path);
    bool found = false;

    if (!dir)
        return false;
    for (const struct dirent *entry; !found && (entry = readdir(dir));) {
        char inner[SHEF_PATH_BYTES];
        char name[600];
        struct stat info;

        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        snprintf(name, sizeof name, "%s%s", prefix, entry->d_name);
        snprintf(inner, sizeof inner, "%s/%s", path, entry->d_name);
        if (!is_listed(files, name)) {
            snprintf(out_name, n_bytes, "%s", name);
            found = true;
        } else if (!*prefix && stat(inner, &info) == 0 && S_ISDIR(info.st_mode)) {
            char inner_prefix[300];

            snprintf(inner_prefix, sizeof inner_prefix, "%s/", entry->d_name);
            found = find_foreign(inner, inner_prefix, files, out_name, n_bytes);
        }
    }
    closedir(dir);
    return found;
}

/* Follows a link to the folder it stands for, so that results go there and the link stays. */
static enum shef_err follow_link(struct shef_output_folder *folder, struct shef_error *err)
{
    struct stat info;

    if (lstat(folder->final, &info) != 0 || !S_ISLNK(info.st_mode))
        return SHEF_OK;

    char *target = realpath(folder->final, NULL);
    const int os_errno = errno;
    enum shef_err code = SHEF_OK;

    if (!target && os_errno == ENOENT)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' is a link to a folder that does not exist; make that folder, or "
                         "name another place for the results",
                         folder->final);
    else if (!target)
        code = shef_fail_os(err, os_errno, "follow the link '%s'", folder->final);
    else if (strlen(target) + 64 > sizeof folder->final)
        code = shef_fail(err, SHEF_ERR_INVALID, "the path of the result folder is too long");
    else
        memcpy(folder->final, target, strlen(target) + 1);
    free(target);
    return code;
}

/* True if another file system, or another part of this one, is mounted at the folder: nothing can
 * be renamed over it. */
static bool is_mount_point(const char *path)
{
    struct statx info;
    struct stat here;
    struct stat above;
    char parent[SHEF_PATH_BYTES];

    if (statx(AT_FDCWD, path, 0, STATX_TYPE, &info) == 0 &&
        (info.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT))
        return info.stx_attributes & STATX_ATTR_MOUNT_ROOT;
    snprintf(parent, sizeof parent, "%s/..", path);
    return stat(path, &here) == 0 && stat(parent, &above) == 0 && here.st_dev != above.st_dev;
}

static enum shef_err look_at_place(struct shef_output_folder *folder, struct shef_error *err)
{
    struct stat info;
    char index[SHEF_PATH_BYTES];
    char foreign[600];

    if (stat(folder->final, &info) != 0)
        return errno == ENOENT ? SHEF_OK
                               : shef_fail_os(err, errno, "look at folder '%s'", folder->final);
    if (!S_ISDIR(info.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' exists and is no folder; name another place for the results",
                         folder->final);
    if (is_mount_point(folder->final))
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' is a mount point; name a folder inside it",
                         folder->final);
    snprintf(index, sizeof index, "%s/%s", folder->final, folder->index);

    json_t *root = json_load_file(index, 0, NULL);
    const bool refused =
        find_foreign(folder->final, "", json_object_get(root, "files"), foreign, sizeof foreign);

    json_decref(root);
    if (refused)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "folder '%s' holds '%s', which is not an earlier result of this command; "
                         "name a new or empty folder",
                         folder->final, foreign);
    folder->replaces = true;
    return SHEF_OK;
}

enum shef_err shef_output_folder_open(struct shef_output_folder *out_folder, const char *path,
                                      const char *index, struct shef_error *err)
{
    struct shef_output_folder folder = { .index = index };
    size_t n = strlen(path);

    if (n + 64 > sizeof folder.final)
        return shef_fail(err, SHEF_ERR_INVALID, "the path of the result folder is too long");
    while (n > 1 && path[n - 1] == '/')
        n--;
    memcpy(folder.final, path, n);

    enum shef_err code = follow_link(&folder, err);

    if (code == SHEF_OK)
        code = look_at_place(&folder, err);
    if (code != SHEF_OK)
        return code;

    const char *slash = strrchr(folder.final, '/');
    const int n_parent = slash ? (int)(slash - folder.final) + 1 : 0;
    const char *name = slash ? slash + 1 : folder.final;

    /* "." and ".." cannot be renamed over; their results would have no name of their own. */
    if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0 || !*name)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' cannot be a result folder; name one by its own name", path);
    if (snprintf(folder.staging, sizeof folder.staging, "%.*s.%s.partial-XXXXXX", n_parent,
                 folder.final, name) >= (int)sizeof folder.staging)
        return shef_fail(err, SHEF_ERR_INVALID, "the path of the result folder is too long");
    code = make_parents(&folder, err);
    if (code == SHEF_OK && (!mkdtemp(folder.staging) || chmod(folder.staging, 0755) != 0))
        code = shef_fail_os(err, errno, "make the result folder '%s'", folder.final);
    if (code != SHEF_OK) {
        remove_parents(&folder);
        return code;
    }
    folder.files = json_array();
    if (!folder.files) {
        rmdir(folder.staging);
        remove_parents(&folder);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    }
    *out_folder = folder;
    return SHEF_OK;
}

enum shef_err shef_output_folder_open_errors(struct shef_output_folder *out_folder,
                                             const char *named, const char *scored,
                                             struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    size_t n = strlen(scored);

    while (n > 1 && scored[n - 1] == '/')
        n--;
    snprintf(path, sizeof path, "%.*s-errors", (int)n, scored);
    return shef_output_folder_open(out_folder, named ? named : path, "errors.json", err);
}

enum shef_err shef_output_folder_add_folder(struct shef_output_folder *folder, const char *name,
                                            struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];

    snprintf(path, sizeof path, "%s/%s", folder->staging, name);
    if (mkdir(path, 0755) != 0)
        return shef_fail_os(err, errno, "make folder '%s' in '%s'", name, folder->final);
    return SHEF_OK;
}

enum shef_err shef_output_folder_add(struct shef_output_folder *folder, char *out_path,
                                     struct shef_error *err, const char *name_fmt, ...)
{
    char name[256];
    va_list args;

    va_start(args, name_fmt);
    const int n = vsnprintf(name, sizeof name, name_fmt, args);
    va_end(args);
    assert(n > 0 && (size_t)n < sizeof name);

    if (snprintf(out_path, SHEF_PATH_BYTES, "%s/%s", folder->staging, name) >= SHEF_PATH_BYTES)
        return shef_fail(err, SHEF_ERR_INVALID, "the path of the result folder is too long");
    if (json_array_append_new(folder->files, json_string(name)) != 0)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    return SHEF_OK;
}

/* Waits until the disk has all files of the folder. One by one, hundreds of them would take
 * seconds. Returns 0 or errno. */
static int sync_files(const char *path)
{
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    if (fd < 0)
        return errno;

    const int failure = syncfs(fd) != 0 ? errno : 0;

    close(fd);
    return failure;
}

static enum shef_err put_in_place(struct shef_output_folder *folder, struct shef_error *err)
{
    /* An earlier result goes now; a power cut must not leave empty files in its place. */
    const int failure = sync_files(folder->staging);

    if (failure != 0)
        return shef_fail_os(err, failure, "write folder '%s'", folder->final);
    if (folder->replaces) {
        if (renameat2(AT_FDCWD, folder->staging, AT_FDCWD, folder->final, RENAME_EXCHANGE) == 0) {
            shef_file_sync_name(folder->final);
            remove_folder(folder->staging, 1);
            return SHEF_OK;
        }
        /* File systems that cannot exchange: the earlier result goes first. */
        if (errno != EINVAL && errno != ENOSYS)
            return shef_fail_os(err, errno, "replace folder '%s'", folder->final);
        remove_folder(folder->final, 1);
    }
    if (rename(folder->staging, folder->final) != 0)
        return shef_fail_os(err, errno, "put folder '%s' in place", folder->final);
    shef_file_sync_name(folder->final);
    return SHEF_OK;
}

enum shef_err shef_output_folder_commit(struct shef_output_folder *folder, json_t *root,
                                        struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    enum shef_err code = shef_output_folder_add(folder, path, err, "%s", folder->index);

    if (code == SHEF_OK && json_object_set(root, "files", folder->files) != 0)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    if (code == SHEF_OK)
        code = shef_write_json(path, root, err);
    if (code == SHEF_OK)
        code = put_in_place(folder, err);
    if (code == SHEF_OK) {
        folder->staging[0] = '\0';
        folder->n_parents_made = 0;
    }
    shef_output_folder_discard(folder);
    return code;
}

void shef_output_folder_discard(struct shef_output_folder *folder)
{
    if (folder->staging[0])
        remove_folder(folder->staging, 1);
    remove_parents(folder);
    folder->staging[0] = '\0';
    json_decref(folder->files);
    folder->files = NULL;
}

enum shef_err shef_write_json(const char *path, json_t *root, struct shef_error *err)
{
    char *text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));

    if (!text)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);

    const enum shef_err code = shef_file_replace(path, text, strlen(text), err);

    free(text);
    return code;
}
