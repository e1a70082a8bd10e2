#include "service/recording_list.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control/request.h"
#include "record/recording.h"

/* What the manifest says, or why it says nothing. */
static void describe(const struct shef_recording *recording, bool is_present,
                     const char **out_state, const char **out_reason)
{
    const struct shef_manifest *manifest = &recording->manifest;

    *out_state = "closed";
    *out_reason = manifest->reason;
    if (!recording->has_manifest) {
        *out_state = "damaged";
        *out_reason = recording->manifest_trouble;
    } else if (is_present) {
        *out_state = "recording";
        *out_reason = "";
    } else if (!manifest->is_closed) {
        *out_state = "cut";
        *out_reason = "it was never ended, by a crash, a kill or a power cut; what was written can "
                      "be played";
    }
}

static json_t *recording_to_json(const char *name, const char *path, bool is_present)
{
    struct shef_recording recording;
    struct shef_error err = { 0 };
    enum shef_verdict verdict = SHEF_VERDICT_UNKNOWN;
    uint64_t n_bytes = 0;
    const char *state;
    const char *reason;
    json_t *object;

    if (shef_recording_inspect(path, &recording, &err) != SHEF_OK)
        return json_pack("{s:o, s:s, s:s, s:o, s:i}", "name", shef_control_string(name), "state",
                         "damaged", "verdict", shef_verdict_name(verdict), "reason",
                         shef_control_string(err.text), "n_bytes", 0);
    for (int i = 0; i < recording.n_parts; i++)
        n_bytes += recording.parts[i].n_bytes;
    if (recording.has_manifest)
        verdict = recording.manifest.verdict;
    describe(&recording, is_present, &state, &reason);
    object = json_pack("{s:o, s:s, s:s, s:o, s:I}", "name", shef_control_string(name), "state",
                       state, "verdict", shef_verdict_name(verdict), "reason",
                       shef_control_string(reason), "n_bytes", (json_int_t)n_bytes);
    shef_recording_free(&recording);
    return object;
}

enum shef_err shef_recording_list(const char *folder, const char *present, json_t *answer,
                                  struct shef_error *err)
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
            json_array_append_new(
                list, recording_to_json(entries[i]->d_name, path, strcmp(path, present) == 0));
        free(entries[i]);
    }
    free(entries);
    json_object_set_new(answer, "recordings", list);
    return SHEF_OK;
}
