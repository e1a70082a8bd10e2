#include "record/manifest.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "record/manifest_json.h"

const char *shef_verdict_name(enum shef_verdict verdict)
{
    static const char *const names[SHEF_VERDICTS] = {
        [SHEF_VERDICT_UNKNOWN] = "unknown",
        [SHEF_VERDICT_CLEAN] = "clean",
        [SHEF_VERDICT_GAPS] = "gaps",
        [SHEF_VERDICT_STOPPED] = "stopped",
    };

    return verdict >= 0 && verdict < SHEF_VERDICTS ? names[verdict] : "unknown";
}

enum shef_err shef_manifest_add_file(struct shef_manifest *manifest, const char *path,
                                     uint64_t n_bytes)
{
    struct shef_manifest_file *grown =
        reallocarray(manifest->files, manifest->n_files + 1, sizeof *grown);

    if (!grown)
        return SHEF_ERR_NO_MEMORY;
    manifest->files = grown;
    grown[manifest->n_files] = (struct shef_manifest_file){ .n_bytes = n_bytes };
    snprintf(grown[manifest->n_files].path, sizeof grown->path, "%s", path);
    manifest->n_files++;
    return SHEF_OK;
}

void shef_manifest_free(struct shef_manifest *manifest)
{
    free(manifest->files);
    manifest->files = NULL;
    manifest->n_files = 0;
}

enum shef_err shef_manifest_write(const char *folder, const struct shef_manifest *manifest,
                                  struct shef_error *err)
{
    char path[PATH_MAX];
    json_t *root = shef_manifest_to_json(manifest);
    char *text = root ? json_dumps(root, JSON_INDENT(2)) : NULL;
    enum shef_err code;

    json_decref(root);
    if (!text)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write the manifest of '%s': out of memory",
                         folder);
    if (snprintf(path, sizeof path, "%s/" SHEF_MANIFEST_NAME, folder) >= PATH_MAX)
        code = shef_fail(err, SHEF_ERR_INVALID, "write the manifest of '%s': the path is too long",
                         folder);
    else
        code = shef_file_replace(path, text, strlen(text), err);
    free(text);
    return code;
}

enum shef_err shef_manifest_read(const char *folder, struct shef_manifest *out_manifest,
                                 struct shef_error *err)
{
    char path[PATH_MAX];
    uint8_t *bytes;
    size_t n_bytes;

    if (snprintf(path, sizeof path, "%s/" SHEF_MANIFEST_NAME, folder) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "read the manifest of '%s': the path is too long",
                         folder);

    enum shef_err code = shef_file_read(path, SHEF_MANIFEST_MAX_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_manifest_parse(bytes, n_bytes, out_manifest, err);
    free(bytes);
    return code == SHEF_OK ? SHEF_OK : shef_fail_context(err, "'%s'", path);
}
