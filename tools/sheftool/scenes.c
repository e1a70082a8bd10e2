#include "sheftool/scenes.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "core/file.h"
#include "sheftool/paths.h"

#define MAX_FILE_BYTES (1 << 20)

/* The order of the authors' pairs; the truth changes abruptly at 50 and at 99. */
static const struct shef_scenes authors = {
    .at = {
        { "complex boxes", 1, 49 },
        { "picnic", 50, 98 },
        { "simple boxes", 99, 147 },
    },
    .n = 3,
};

/* Reads an optional length above 0. */
static enum shef_err read_length(const json_t *root, const char *key, double *out_length,
                                 const char *path, struct shef_error *err)
{
    const json_t *value = json_object_get(root, key);

    if (!value)
        return SHEF_OK;
    *out_length = json_number_value(value);
    if (*out_length > 0)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_FORMAT, "'%s': \"%s\" must be a number above 0", path, key);
}

/* What synth says of itself. */
static void read_origin(const json_t *root, struct shef_scenes *scenes)
{
    const json_t *seed = json_object_get(json_object_get(root, "made_with"), "seed");

    scenes->is_synthetic = json_is_integer(seed);
    scenes->seed = json_integer_value(seed);
}

enum shef_err shef_scenes_parse(struct shef_scenes *out_scenes, const char *bytes, size_t n_bytes,
                                const char *path, struct shef_error *err)
{
    json_error_t json_error;
    json_t *root = json_loadb(bytes, n_bytes, 0, &json_error);
    json_t *list = json_object_get(root, "scenes");
    struct shef_scenes scenes = { .n = 0 };
    enum shef_err code = SHEF_OK;

    if (!root)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s' is no JSON: line %d: %s", path,
                         json_error.line, json_error.text);
    if (json_array_size(list) < 1 || json_array_size(list) > SHEF_MAX_SCENES)
        code = shef_fail(err, SHEF_ERR_FORMAT, "'%s': needs a list \"scenes\" of 1 to %d entries",
                         path, SHEF_MAX_SCENES);
    for (size_t i = 0; code == SHEF_OK && i < json_array_size(list); i++) {
        struct shef_scene *scene = &scenes.at[scenes.n++];
        json_int_t first;
        json_int_t last;
        const char *name;

        if (json_unpack(json_array_get(list, i), "{s:s, s:I, s:I}", "name", &name, "first", &first,
                        "last", &last) != 0 ||
            first > last || !*name)
            code = shef_fail(err, SHEF_ERR_FORMAT,
                             "'%s': scene %zu needs \"name\", \"first\" and \"last\", in order",
                             path, i + 1);
        else
            *scene = (struct shef_scene){ .first = first, .last = last };
        if (code == SHEF_OK)
            snprintf(scene->name, sizeof scene->name, "%s", name);
    }
    if (code == SHEF_OK)
        code = read_length(root, "focal_px", &scenes.focal_px, path, err);
    if (code == SHEF_OK)
        code = read_length(root, "baseline_mm", &scenes.baseline_mm, path, err);
    read_origin(root, &scenes);
    json_decref(root);
    if (code == SHEF_OK)
        *out_scenes = scenes;
    return code;
}

static enum shef_err read_file(struct shef_scenes *scenes, const char *path, struct shef_error *err)
{
    uint8_t *bytes;
    size_t n_bytes;
    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_scenes_parse(scenes, (const char *)bytes, n_bytes, path, err);
    free(bytes);
    return code;
}

static int32_t count_pairs(const struct shef_scene *scene, const struct shef_numbered_list *pairs)
{
    int32_t n = 0;

    for (size_t i = 0; i < pairs->n; i++)
        n += pairs->at[i].number >= scene->first && pairs->at[i].number <= scene->last;
    return n;
}

static void drop_empty(struct shef_scenes *scenes, const struct shef_numbered_list *pairs)
{
    int32_t n = 0;

    for (int32_t i = 0; i < scenes->n; i++)
        if (count_pairs(&scenes->at[i], pairs) > 0)
            scenes->at[n++] = scenes->at[i];
    scenes->n = n;
}

static enum shef_err check_cover(const struct shef_scenes *scenes, const char *path,
                                 const struct shef_numbered_list *pairs, struct shef_error *err)
{
    for (size_t i = 0; i < pairs->n; i++) {
        int n = 0;

        for (int32_t s = 0; s < scenes->n; s++)
            n += pairs->at[i].number >= scenes->at[s].first &&
                 pairs->at[i].number <= scenes->at[s].last;
        if (n != 1)
            return shef_fail(err, SHEF_ERR_FORMAT, "'%s': pair %" PRId64 " belongs to %s scene",
                             path, pairs->at[i].number, n == 0 ? "no" : "more than one");
    }
    return SHEF_OK;
}

enum shef_err shef_scenes_find(struct shef_scenes *out_scenes, const char *folder,
                               const struct shef_numbered_list *pairs, struct shef_error *err)
{
    struct shef_scenes scenes = { .n = 0 };
    char path[SHEF_PATH_BYTES];

    assert(pairs->n > 0);

    const int64_t first = pairs->at[0].number;
    const int64_t last = pairs->at[pairs->n - 1].number;

    snprintf(path, sizeof path, "%s/scenes.json", folder);
    if (access(path, F_OK) == 0) {
        enum shef_err code = read_file(&scenes, path, err);

        if (code == SHEF_OK)
            code = check_cover(&scenes, path, pairs, err);
        if (code != SHEF_OK)
            return code;
    } else if (first >= authors.at[0].first && last <= authors.at[authors.n - 1].last) {
        scenes = authors;
    } else {
        scenes = (struct shef_scenes){ .at = { { "all", first, last } }, .n = 1 };
    }
    drop_empty(&scenes, pairs);
    *out_scenes = scenes;
    return SHEF_OK;
}

int32_t shef_scenes_of(const struct shef_scenes *scenes, int64_t number)
{
    for (int32_t i = 0; i < scenes->n; i++)
        if (number >= scenes->at[i].first && number <= scenes->at[i].last)
            return i;
    assert(!"every pair belongs to a scene");
    return 0;
}

double shef_scenes_focal_px(const struct shef_scenes *scenes, double given_px)
{
    if (given_px > 0)
        return given_px;
    return scenes->focal_px > 0 ? scenes->focal_px : SHEF_AUTHORS_FOCAL_PX;
}

double shef_scenes_baseline_mm(const struct shef_scenes *scenes, double given_mm)
{
    if (given_mm > 0)
        return given_mm;
    return scenes->baseline_mm > 0 ? scenes->baseline_mm : SHEF_AUTHORS_BASELINE_MM;
}

json_t *shef_scenes_json(const struct shef_scenes *scenes)
{
    json_t *list = json_array();

    for (int32_t i = 0; i < scenes->n; i++)
        json_array_append_new(list, json_pack("{s:s, s:I, s:I}", "name", scenes->at[i].name,
                                              "first", (json_int_t)scenes->at[i].first, "last",
                                              (json_int_t)scenes->at[i].last));
    return json_pack("{s:o}", "scenes", list);
}
