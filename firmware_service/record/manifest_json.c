#include "record/manifest_json.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "record/part_table.h"

#define KIND    "shef-recording"
#define VERSION 1

/* The counts of a decoder, under their names in the file. */
static const struct {
    const char *key;
    size_t field;
} stats_keys[] = {
    { "n_bytes", offsetof(struct shef_evt_stats, n_bytes) },
    { "n_events", offsetof(struct shef_evt_stats, n_events) },
    { "n_triggers", offsetof(struct shef_evt_stats, n_triggers) },
    { "n_resyncs", offsetof(struct shef_evt_stats, n_resyncs) },
    { "n_bytes_skipped", offsetof(struct shef_evt_stats, n_bytes_skipped) },
    { "n_wraps", offsetof(struct shef_evt_stats, n_wraps) },
};

#define N_STATS_KEYS (sizeof stats_keys / sizeof stats_keys[0])

static uint64_t *stats_field(struct shef_evt_stats *stats, size_t i)
{
    return (uint64_t *)((char *)stats + stats_keys[i].field);
}

/* The texts of a camera. */
static const struct {
    const char *key;
    size_t field;
} camera_keys[] = {
    { "date", offsetof(struct shef_raw_header, date) },
    { "serial", offsetof(struct shef_raw_header, serial) },
    { "integrator", offsetof(struct shef_raw_header, integrator) },
    { "plugin", offsetof(struct shef_raw_header, plugin) },
    { "sensor", offsetof(struct shef_raw_header, sensor) },
};

#define N_CAMERA_KEYS (sizeof camera_keys / sizeof camera_keys[0])

static char *camera_field(struct shef_raw_header *camera, size_t i)
{
    return (char *)camera + camera_keys[i].field;
}

static const char *const format_names[SHEF_EVT_FORMATS] = {
    [SHEF_EVT2] = "EVT2",
    [SHEF_EVT21] = "EVT21",
    [SHEF_EVT21_LEGACY] = "EVT21-legacy",
    [SHEF_EVT3] = "EVT3",
};

/* A text as JSON. Sentences may name files whose names are no UTF-8: such bytes become '?'. */
static json_t *text_to_json(const char *text)
{
    json_t *whole = json_string(text);
    char ascii[SHEF_ERROR_TEXT_BYTES];
    size_t i = 0;

    if (whole)
        return whole;
    for (; text[i] && i + 1 < sizeof ascii; i++)
        ascii[i] = (unsigned char)text[i] < 128 ? text[i] : '?';
    ascii[i] = '\0';
    return json_string(ascii);
}

static json_t *camera_to_json(const struct shef_raw_header *given)
{
    struct shef_raw_header camera = *given;
    json_t *root = json_pack("{s:s, s:i, s:i, s:i}", "format", format_names[camera.format],
                             "width_px", (int)camera.width_px, "height_px", (int)camera.height_px,
                             "system_id", (int)camera.system_id);

    for (size_t i = 0; i < N_CAMERA_KEYS; i++)
        json_object_set_new(root, camera_keys[i].key, text_to_json(camera_field(&camera, i)));
    return root;
}

static json_t *events_to_json(const struct shef_manifest_events *events)
{
    struct shef_evt_stats stats = events->stats;
    json_t *violations = json_object();
    json_t *gaps = json_array();
    json_t *root =
        json_pack("{s:o, s:i, s:I, s:I, s:I, s:I}", "camera", camera_to_json(&events->camera),
                  "n_segments", (int)events->n_segments, "n_blocks", (json_int_t)events->n_blocks,
                  "n_lost_buffers", (json_int_t)events->n_lost_buffers, "first_us",
                  (json_int_t)events->first_us, "last_us", (json_int_t)events->last_us);

    for (size_t i = 0; i < N_STATS_KEYS; i++)
        json_object_set_new(root, stats_keys[i].key,
                            json_integer((json_int_t)*stats_field(&stats, i)));
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        json_object_set_new(violations, shef_evt_violation_name(i),
                            json_integer((json_int_t)stats.n_violations[i]));
    for (uint32_t i = 0; i < events->n_gaps; i++)
        json_array_append_new(gaps, json_pack("{s:I, s:I}", "at_us",
                                              (json_int_t)events->gaps[i].at_us, "n_lost_buffers",
                                              (json_int_t)events->gaps[i].n_lost_buffers));
    json_object_set_new(root, "violations", violations);
    json_object_set_new(root, "gaps", gaps);
    return root;
}

static json_t *part_to_json(const struct shef_manifest_part *part)
{
    return json_pack("{s:o, s:I, s:I, s:I, s:I, s:I, s:I, s:I}", "source",
                     text_to_json(part->source), "n_segments", (json_int_t)part->n_segments,
                     "n_blocks", (json_int_t)part->n_blocks, "n_items", (json_int_t)part->n_items,
                     "n_bytes", (json_int_t)part->n_bytes, "n_lost", (json_int_t)part->n_lost,
                     "first_us", (json_int_t)part->first_us, "last_us", (json_int_t)part->last_us);
}

static json_t *files_to_json(const struct shef_manifest *manifest)
{
    json_t *list = json_array();

    for (size_t i = 0; i < manifest->n_files; i++) {
        const struct shef_manifest_file *file = &manifest->files[i];

        json_array_append_new(list, json_pack("{s:o, s:I, s:s}", "path", text_to_json(file->path),
                                              "n_bytes", (json_int_t)file->n_bytes, "sha256",
                                              file->sha256));
    }
    return list;
}

json_t *shef_manifest_to_json(const struct shef_manifest *manifest)
{
    char session[2 * SHEF_SESSION_BYTES + 1];
    json_t *root;

    for (int i = 0; i < SHEF_SESSION_BYTES; i++)
        snprintf(session + 2 * i, 3, "%02x", manifest->session[i]);
    root =
        json_pack("{s:s, s:i, s:s, s:o, s:s, s:I, s:s, s:s, s:o}", "kind", KIND, "version", VERSION,
                  "session", session, "software", text_to_json(manifest->software), "created",
                  manifest->created, "utc_minus_host_ns", (json_int_t)manifest->utc_minus_host_ns,
                  "state", manifest->is_closed ? "closed" : "recording", "verdict",
                  shef_verdict_name(manifest->verdict), "reason", text_to_json(manifest->reason));
    if (root && manifest->events.is_present)
        json_object_set_new(root, "events", events_to_json(&manifest->events));
    for (enum shef_part part = SHEF_PART_FRAMES; root && part <= SHEF_PART_TRIGGERS; part++)
        if (manifest->parts[part].is_present)
            json_object_set_new(root, shef_part_kind(part)->folder,
                                part_to_json(&manifest->parts[part]));
    if (root && manifest->is_closed)
        json_object_set_new(root, "files", files_to_json(manifest));
    return root;
}

/* Copies a text; false, and "", if it is none or too long. */
static bool take_text(const json_t *object, const char *key, char *out_text, size_t n_bytes)
{
    const char *text = json_string_value(json_object_get(object, key));

    out_text[0] = '\0';
    if (!text || strlen(text) >= n_bytes)
        return false;
    memcpy(out_text, text, strlen(text) + 1);
    return true;
}

/* A whole number within the limits, or the fallback. */
static int64_t take_number(const json_t *object, const char *key, int64_t min, int64_t max,
                           int64_t fallback)
{
    const json_t *number = json_object_get(object, key);
    const json_int_t value = json_integer_value(number);

    return json_is_integer(number) && value >= min && value <= max ? value : fallback;
}

static uint64_t take_count(const json_t *object, const char *key)
{
    return (uint64_t)take_number(object, key, 0, INT64_MAX, 0);
}

static bool take_session(const json_t *root, uint8_t out_session[SHEF_SESSION_BYTES])
{
    const char *text = json_string_value(json_object_get(root, "session"));

    if (!text || strlen(text) != 2 * SHEF_SESSION_BYTES ||
        strspn(text, "0123456789abcdef") != 2 * SHEF_SESSION_BYTES)
        return false;
    for (int i = 0; i < SHEF_SESSION_BYTES; i++) {
        unsigned byte;

        if (sscanf(text + 2 * i, "%2x", &byte) != 1)
            return false;
        out_session[i] = (uint8_t)byte;
    }
    return true;
}

static bool take_camera(const json_t *root, struct shef_raw_header *camera)
{
    const char *format = json_string_value(json_object_get(root, "format"));

    for (int i = 0; i < SHEF_EVT_FORMATS; i++) {
        if (!format || strcmp(format, format_names[i]) != 0)
            continue;
        camera->format = i;
        camera->width_px = (uint32_t)take_number(root, "width_px", 1, 2048, 0);
        camera->height_px = (uint32_t)take_number(root, "height_px", 1, 2048, 0);
        camera->system_id = (int32_t)take_number(root, "system_id", -1, INT32_MAX, -1);
        for (size_t k = 0; k < N_CAMERA_KEYS; k++)
            take_text(root, camera_keys[k].key, camera_field(camera, k), SHEF_TEXT_VALUE_BYTES);
        return camera->width_px > 0 && camera->height_px > 0;
    }
    return false;
}

static void take_events(const json_t *root, struct shef_manifest_events *events)
{
    const json_t *violations = json_object_get(root, "violations");
    const json_t *gaps = json_object_get(root, "gaps");

    events->n_segments = (uint32_t)take_number(root, "n_segments", 0, UINT32_MAX, 0);
    events->n_blocks = take_count(root, "n_blocks");
    events->n_lost_buffers = take_count(root, "n_lost_buffers");
    events->first_us = take_number(root, "first_us", INT64_MIN, INT64_MAX, 0);
    events->last_us = take_number(root, "last_us", INT64_MIN, INT64_MAX, 0);
    for (size_t i = 0; i < N_STATS_KEYS; i++)
        *stats_field(&events->stats, i) = take_count(root, stats_keys[i].key);
    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        events->stats.n_violations[i] = take_count(violations, shef_evt_violation_name(i));
    for (size_t i = 0; i < json_array_size(gaps) && i < SHEF_MANIFEST_MAX_GAPS; i++) {
        const json_t *gap = json_array_get(gaps, i);

        events->gaps[events->n_gaps++] = (struct shef_manifest_gap){
            .at_us = take_number(gap, "at_us", INT64_MIN, INT64_MAX, 0),
            .n_lost_buffers = (uint32_t)take_number(gap, "n_lost_buffers", 0, UINT32_MAX, 0),
        };
    }
}

static struct shef_manifest_part take_part(const json_t *root)
{
    struct shef_manifest_part part = {
        .is_present = json_is_object(root),
        .n_segments = (uint32_t)take_number(root, "n_segments", 0, UINT32_MAX, 0),
        .n_blocks = take_count(root, "n_blocks"),
        .n_items = take_count(root, "n_items"),
        .n_bytes = take_count(root, "n_bytes"),
        .n_lost = take_count(root, "n_lost"),
        .first_us = take_number(root, "first_us", INT64_MIN, INT64_MAX, 0),
        .last_us = take_number(root, "last_us", INT64_MIN, INT64_MAX, 0),
    };

    take_text(root, "source", part.source, sizeof part.source);
    return part;
}

static bool is_sha256(const char *text)
{
    return strlen(text) == SHEF_SHA256_TEXT_BYTES - 1 &&
           strspn(text, "0123456789abcdef") == SHEF_SHA256_TEXT_BYTES - 1;
}

/* Whether a path leads to a file inside the folder. */
static bool is_inside(const char *path)
{
    return *path && *path != '/' && !strstr(path, "..");
}

static enum shef_err take_files(const json_t *list, struct shef_manifest *manifest,
                                struct shef_error *err)
{
    size_t i;
    const json_t *item;

    json_array_foreach(list, i, item)
    {
        struct shef_manifest_file file = { .n_bytes = take_count(item, "n_bytes") };

        if (!take_text(item, "path", file.path, sizeof file.path) || !is_inside(file.path))
            return shef_fail(err, SHEF_ERR_FORMAT, "files[%zu] has no path inside the recording",
                             i);
        if (!take_text(item, "sha256", file.sha256, sizeof file.sha256) ||
            (*file.sha256 && !is_sha256(file.sha256)))
            return shef_fail(err, SHEF_ERR_FORMAT, "files[%zu] has no SHA-256", i);
        if (shef_manifest_add_file(manifest, file.path, file.n_bytes) != SHEF_OK)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
        manifest->files[i] = file;
    }
    return SHEF_OK;
}

static enum shef_err take_manifest(const json_t *root, struct shef_manifest *manifest,
                                   struct shef_error *err)
{
    const char *kind = json_string_value(json_object_get(root, "kind"));
    const char *state = json_string_value(json_object_get(root, "state"));
    const char *verdict = json_string_value(json_object_get(root, "verdict"));
    const int64_t version = take_number(root, "version", 0, INT32_MAX, 0);
    const json_t *events = json_object_get(root, "events");

    if (!kind || strcmp(kind, KIND) != 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "it is not the manifest of a recording (kind '%s')",
                         KIND);
    if (version > VERSION)
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "the recording is of version %" PRId64 ", this program reads up to %d; "
                         "use a newer one",
                         version, VERSION);
    if (version < 1 || !take_session(root, manifest->session) || !state)
        return shef_fail(err, SHEF_ERR_FORMAT, "version, session or state is missing or no such");
    take_text(root, "software", manifest->software, sizeof manifest->software);
    take_text(root, "created", manifest->created, sizeof manifest->created);
    take_text(root, "reason", manifest->reason, sizeof manifest->reason);
    manifest->utc_minus_host_ns = take_number(root, "utc_minus_host_ns", INT64_MIN, INT64_MAX, 0);
    manifest->is_closed = strcmp(state, "closed") == 0;
    for (int i = 0; i < SHEF_VERDICTS; i++)
        if (verdict && strcmp(verdict, shef_verdict_name(i)) == 0)
            manifest->verdict = i;
    if (events) {
        manifest->events.is_present =
            take_camera(json_object_get(events, "camera"), &manifest->events.camera);
        if (!manifest->events.is_present)
            return shef_fail(err, SHEF_ERR_FORMAT, "the camera's format or size is no such");
        take_events(events, &manifest->events);
    }
    for (enum shef_part part = SHEF_PART_FRAMES; part <= SHEF_PART_TRIGGERS; part++)
        manifest->parts[part] = take_part(json_object_get(root, shef_part_kind(part)->folder));
    return take_files(json_object_get(root, "files"), manifest, err);
}

enum shef_err shef_manifest_parse(const void *bytes, size_t n_bytes,
                                  struct shef_manifest *out_manifest, struct shef_error *err)
{
    json_error_t at;
    struct shef_manifest manifest = { .is_closed = false };
    json_t *root = json_loadb(bytes, n_bytes, JSON_REJECT_DUPLICATES, &at);

    if (!root)
        return shef_fail(err, SHEF_ERR_FORMAT, "line %d: no JSON: %s", at.line, at.text);

    const enum shef_err code = take_manifest(root, &manifest, err);

    json_decref(root);
    if (code == SHEF_OK)
        *out_manifest = manifest;
    else
        shef_manifest_free(&manifest);
    return code;
}
