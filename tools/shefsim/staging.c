#include "shefsim/staging.h"

#include <dirent.h>
#include <errno.h>
#include <ftw.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MAX_OPEN_FOLDERS 8

/* Room for what is added to the name, and for the files inside. */
#define MAX_ENDING 128

static enum shef_err check_final(const char *final, struct shef_error *err)
{
    bool is_empty = true;
    DIR *dir = opendir(final);

    if (!dir && errno == ENOENT)
        return SHEF_OK;
    if (!dir)
        return errno == ENOTDIR ? shef_fail(err, SHEF_ERR_INVALID,
                                            "write to '%s': there is a file of that name", final)
                                : shef_fail_os(err, errno, "write to '%s'", final);
    for (const struct dirent *entry; (entry = readdir(dir));)
        is_empty =
            is_empty && (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0);
    closedir(dir);
    return is_empty ? SHEF_OK
                    : shef_fail(err, SHEF_ERR_INVALID,
                                "write to '%s': the folder is not empty; name a new one", final);
}

enum shef_err sim_staging_begin(struct sim_staging *staging, const char *final,
                                struct shef_error *err)
{
    size_t n = strlen(final);

    *staging = (struct sim_staging){ .path = "" };
    while (n > 1 && final[n - 1] == '/')
        n--;
    if (n == 0 || n + MAX_ENDING >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "write to '%s': the name is %s", final,
                         n == 0 ? "empty" : "too long");
    memcpy(staging->final, final, n);

    const enum shef_err code = check_final(staging->final, err);

    if (code == SHEF_OK)
        snprintf(staging->path, sizeof staging->path, "%.*s.part-%ld", (int)n, final,
                 (long)getpid());
    return code;
}

enum shef_err sim_staging_commit(struct sim_staging *staging, struct shef_error *err)
{
    if (rename(staging->path, staging->final) != 0)
        return shef_fail_os(err, errno, "give '%s' its name", staging->final);
    staging->path[0] = '\0';
    return SHEF_OK;
}

static int remove_one(const char *path, const struct stat *status, int type, struct FTW *where)
{
    (void)status;
    (void)type;
    (void)where;
    /* What cannot be removed stays: there is nobody left to tell. */
    remove(path);
    return 0;
}

void sim_staging_discard(struct sim_staging *staging)
{
    if (staging->path[0] != '\0')
        nftw(staging->path, remove_one, MAX_OPEN_FOLDERS, FTW_DEPTH | FTW_PHYS);
    staging->path[0] = '\0';
}
