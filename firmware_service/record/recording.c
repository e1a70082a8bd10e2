#include "record/recording.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "record/event_part.h"
#include "record/folder_list.h"

static bool is_folder(const char *path)
{
    struct stat info;

    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

bool shef_recording_is_at(const char *path)
{
    char inner[PATH_MAX];
    struct stat info;

    if (!is_folder(path))
        return false;
    if (snprintf(inner, sizeof inner, "%s/" SHEF_MANIFEST_NAME, path) < PATH_MAX &&
        stat(inner, &info) == 0)
        return true;
    return snprintf(inner, sizeof inner, "%s/" SHEF_EVENT_FOLDER, path) < PATH_MAX &&
           is_folder(inner);
}

/* Adds a file to its part. */
static void count_file(struct shef_recording *recording, const struct shef_manifest_file *file)
{
    const size_t n_name = strcspn(file->path, "/");
    struct shef_recording_part *part = recording->parts;

    if (file->path[n_name] == '\0') {
        recording->has_calibration |= strcmp(file->path, "calibration.yaml") == 0;
        recording->has_config |= strcmp(file->path, "config.yaml") == 0;
        return;
    }
    if (n_name >= sizeof part->name)
        return;
    while (part < recording->parts + recording->n_parts &&
           (strncmp(part->name, file->path, n_name) != 0 || part->name[n_name] != '\0'))
        part++;
    if (part == recording->parts + SHEF_RECORDING_MAX_PARTS)
        return;
    if (part == recording->parts + recording->n_parts) {
        recording->n_parts++;
        memcpy(part->name, file->path, n_name);
    }
    part->n_files++;
    part->n_bytes += file->n_bytes;
}

enum shef_err shef_recording_inspect(const char *path, struct shef_recording *out_recording,
                                     struct shef_error *err)
{
    struct shef_recording recording = { .has_manifest = false };
    struct shef_folder_list list;
    struct shef_error trouble;

    if (!shef_recording_is_at(path))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "'%s' is not a recording: a folder with a " SHEF_MANIFEST_NAME
                         " or a folder " SHEF_EVENT_FOLDER " in it",
                         path);

    const enum shef_err manifest_code = shef_manifest_read(path, &recording.manifest, &trouble);

    if (manifest_code == SHEF_ERR_UNSUPPORTED) {
        if (err)
            *err = trouble;
        return manifest_code;
    }
    recording.has_manifest = manifest_code == SHEF_OK;
    if (manifest_code != SHEF_OK)
        memcpy(recording.manifest_trouble, trouble.text, sizeof recording.manifest_trouble);

    const enum shef_err code = shef_folder_list_read(path, &list, err);

    if (code != SHEF_OK) {
        shef_recording_free(&recording);
        return code;
    }
    for (size_t i = 0; i < list.n_files; i++)
        count_file(&recording, &list.files[i]);
    shef_folder_list_free(&list);
    *out_recording = recording;
    return SHEF_OK;
}

void shef_recording_free(struct shef_recording *recording)
{
    shef_manifest_free(&recording->manifest);
}
