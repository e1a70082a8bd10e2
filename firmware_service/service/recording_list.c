#include "service/recording_list.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

#include "control/request.h"
#include "record/recording.h"

static json_t *recording_to_json(const char *name, const char *path)
{
    struct shef_recording recording;
    uint64_t n_bytes = 0;
    json_t *object;

    if (shef_recording_inspect(path, &recording, NULL) != SHEF_OK)
        return json_pack("{s:o, s:s, s:s, s:i}", "name", shef_control_string(name), "state",
                         "damaged", "verdict", "unknown", "n_bytes", 0);
    for (int i = 0; i < recording.n_parts; i++)
        n_bytes += recording.parts[i].n_bytes;
    object = json_pack("{s:o, s:s, s:s, s:I}", "name", shef_control_string(name), "state",
                       !recording.has_manifest        ? "damaged"
                       : recording.manifest.is_closed ? "closed"
                                                      : "open",
                       "verdict",
                       shef_verdict_name(recording.has_manifest ? recording.manifest.verdict
                                                                : SHEF_VERDICT_UNKNOWN),
                       "n_bytes", (json_int_t)n_bytes);
    shef_recording_free(&recording);
    return object;
}

enum shef_err shef_recording_list(const char *folder, json_t *answer, struct shef_error *err)
{
    struct dirent **entries;
    const int n = scandir(folder, &entries, NULL, alphasort);
    json_t *list;

    if (n < 0)
        return shef_fail_os(err, errno, "list the recordings in '%s', see record.folder", folder);
    list = json_array();
    for (int i = 0; i < n; i++) {
        char path[PATH_MAX];
        const int length = snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);

        if (entries[i]->d_name[0] != '.' && length > 0 && length < PATH_MAX &&
            shef_recording_is_at(path))
            json_array_append_new(list, recording_to_json(entries[i]->d_name, path));
        free(entries[i]);
    }
    free(entries);
    json_object_set_new(answer, "recordings", list);
    return SHEF_OK;
}
