#include "record/folder_list.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define MAX_DEPTH 2

static enum shef_err add(struct shef_folder_list *list, const char *path, uint64_t n_bytes,
                         struct shef_error *err)
{
    struct shef_manifest_file *grown =
        reallocarray(list->files, list->n_files + 1, sizeof *list->files);

    if (!grown)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "list the recording: out of memory");
    list->files = grown;
    grown[list->n_files] = (struct shef_manifest_file){ .n_bytes = n_bytes };
    memcpy(grown[list->n_files++].path, path, strlen(path) + 1);
    return SHEF_OK;
}

/* Walks folder/prefix.
 *   prefix  "" or "events/" */
static enum shef_err walk(struct shef_folder_list *list, const char *folder, const char *prefix,
                          int depth, struct shef_error *err)
{
    char path[PATH_MAX + 2 * SHEF_MANIFEST_PATH_BYTES];
    enum shef_err code = SHEF_OK;

    snprintf(path, sizeof path, "%s/%s", folder, prefix);

    DIR *dir = opendir(path);

    if (!dir)
        return shef_fail_os(err, errno, "open folder '%s'", path);
    for (const struct dirent *entry; code == SHEF_OK && (entry = readdir(dir));) {
        char name[SHEF_MANIFEST_PATH_BYTES];
        struct stat info;

        if (entry->d_name[0] == '.' ||
            (depth == 0 && strcmp(entry->d_name, SHEF_MANIFEST_NAME) == 0) ||
            snprintf(name, sizeof name, "%s%s", prefix, entry->d_name) >= (int)sizeof name)
            continue;
        snprintf(path, sizeof path, "%s/%s", folder, name);
        if (lstat(path, &info) != 0)
            continue;
        if (S_ISREG(info.st_mode)) {
            code = add(list, name, (uint64_t)info.st_size, err);
        } else if (S_ISDIR(info.st_mode) && depth < MAX_DEPTH && strlen(name) + 2 < sizeof name) {
            strcat(name, "/");
            code = walk(list, folder, name, depth + 1, err);
        }
    }
    closedir(dir);
    return code;
}

static int compare_paths(const void *a, const void *b)
{
    const struct shef_manifest_file *one = a;
    const struct shef_manifest_file *other = b;

    return strcmp(one->path, other->path);
}

enum shef_err shef_folder_list_read(const char *folder, struct shef_folder_list *out_list,
                                    struct shef_error *err)
{
    struct shef_folder_list list = { 0 };
    const enum shef_err code = walk(&list, folder, "", 0, err);

    if (code != SHEF_OK) {
        shef_folder_list_free(&list);
        return code;
    }
    if (list.n_files > 0)
        qsort(list.files, list.n_files, sizeof *list.files, compare_paths);
    *out_list = list;
    return SHEF_OK;
}

void shef_folder_list_free(struct shef_folder_list *list)
{
    free(list->files);
    *list = (struct shef_folder_list){ 0 };
}
