#include "sheftool/events_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/cpu.h"
#include "sheftool/command.h"
#include "sheftool/progress.h"

struct shef_events_source {
    struct shef_events_info info;
    struct shef_event_reader *file; /* one of these two */
    struct shef_recorded_events *recording;
};

static bool is_folder(const char *path)
{
    struct stat info;

    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static void describe_file(struct shef_events_source *source)
{
    const struct shef_event_file_info *file = shef_event_reader_info(source->file);

    source->info = (struct shef_events_info){
        .kind = file->is_raw ? SHEF_EVENTS_RAW : SHEF_EVENTS_DAT,
        .size_known = file->size_known,
        .width_px = file->width_px,
        .height_px = file->height_px,
        .camera.system_id = -1,
    };
    if (file->is_raw) {
        source->info.camera = file->raw;
        source->info.format = file->raw.format;
    } else {
        memcpy(source->info.camera.date, file->dat.date, sizeof source->info.camera.date);
    }
}

static void describe_recording(struct shef_events_source *source)
{
    const struct shef_event_part *part = shef_recorded_events_part(source->recording);
    const struct shef_recording *recording = shef_recorded_events_recording(source->recording);
    const struct shef_manifest_events *events = &recording->manifest.events;

    source->info = (struct shef_events_info){
        .kind = SHEF_EVENTS_RECORDING,
        .size_known = part || events->is_present,
        .width_px = SHEF_DAT_MAX_SIDE_PX,
        .height_px = SHEF_DAT_MAX_SIDE_PX,
        .camera.system_id = -1,
    };
    if (recording->has_manifest && events->is_present) {
        source->info.camera = events->camera;
        source->info.format = events->camera.format;
        source->info.width_px = events->camera.width_px;
        source->info.height_px = events->camera.height_px;
        /* As RAW headers have it: 2026-03-01 12:00:00. */
        if (strlen(recording->manifest.created) >= 19)
            snprintf(source->info.camera.date, sizeof source->info.camera.date, "%.10s %.8s",
                     recording->manifest.created, recording->manifest.created + 11);
    }
    if (part) {
        source->info.format = part->format;
        source->info.width_px = part->width_px;
        source->info.height_px = part->height_px;
    }
}

enum shef_err shef_events_source_open(const char *path, uint32_t features,
                                      struct shef_events_source **out_source,
                                      struct shef_error *err)
{
    struct shef_events_source *source = calloc(1, sizeof *source);

    if (!source)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", path);

    const enum shef_err code =
        is_folder(path) ? shef_recorded_events_open(path, features, &source->recording, err)
                        : shef_event_reader_open(path, features, &source->file, err);

    if (code != SHEF_OK) {
        free(source);
        return code;
    }
    if (source->file)
        describe_file(source);
    else
        describe_recording(source);
    *out_source = source;
    return SHEF_OK;
}

const struct shef_events_info *shef_events_source_info(const struct shef_events_source *source)
{
    return &source->info;
}

enum shef_err shef_events_source_next(struct shef_events_source *source,
                                      struct shef_event_batch *batch, struct shef_error *err)
{
    if (shef_interrupted())
        return shef_fail_interrupted(err);
    return source->file ? shef_event_reader_next(source->file, batch, err)
                        : shef_recorded_events_next(source->recording, batch, err);
}

struct shef_evt_stats shef_events_source_stats(const struct shef_events_source *source)
{
    return source->file ? shef_event_reader_stats(source->file)
                        : shef_recorded_events_stats(source->recording);
}

double shef_events_source_progress(const struct shef_events_source *source)
{
    return source->file ? shef_event_reader_progress(source->file)
                        : shef_recorded_events_progress(source->recording);
}

const char *shef_events_source_note(const struct shef_events_source *source, int i)
{
    return source->file ? shef_event_reader_note(source->file, i)
                        : shef_recorded_events_note(source->recording, i);
}

void shef_events_source_print_notes(const struct shef_events_source *source)
{
    const char *note;

    for (int i = 0; (note = shef_events_source_note(source, i)); i++)
        fprintf(stderr, "note: %s\n", note);
}

const struct shef_recorded_events *shef_events_source_recorded(
    const struct shef_events_source *source)
{
    return source->recording;
}

void shef_events_source_close(struct shef_events_source *source)
{
    if (!source)
        return;
    shef_event_reader_close(source->file);
    shef_recorded_events_close(source->recording);
    free(source);
}

/* Reads all events for the largest coordinates. */
static enum shef_err find_extent(struct shef_events_source *source, const char *path,
                                 uint32_t *out_width_px, uint32_t *out_height_px,
                                 struct shef_error *err)
{
    static struct shef_event events[SHEF_EVENTS_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = SHEF_EVENTS_BATCH };
    struct shef_progress progress;
    uint32_t width_px = 0;
    uint32_t height_px = 0;
    enum shef_err code;

    shef_progress_begin(&progress, "measuring", 1000);
    while ((code = shef_events_source_next(source, &batch, err)) == SHEF_OK) {
        for (uint32_t i = 0; i < batch.n_events; i++) {
            const uint32_t x_end = events[i].x_px + 1u;
            const uint32_t y_end = shef_event_y_px(events[i]) + 1u;

            width_px = x_end > width_px ? x_end : width_px;
            height_px = y_end > height_px ? y_end : height_px;
        }
        shef_progress_step(&progress, (int64_t)(1000 * shef_events_source_progress(source)));
    }
    shef_progress_end(&progress);
    if (code != SHEF_ERR_EMPTY)
        return code;
    if (width_px == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' tells no sensor size and has no event to take it from", path);
    *out_width_px = width_px;
    *out_height_px = height_px;
    return SHEF_OK;
}

enum shef_err shef_events_source_size(const struct shef_events_source *source, const char *path,
                                      uint32_t *out_width_px, uint32_t *out_height_px,
                                      struct shef_error *err)
{
    struct shef_events_source *again;
    struct stat info;

    if (source->info.size_known) {
        *out_width_px = source->info.width_px;
        *out_height_px = source->info.height_px;
        return SHEF_OK;
    }
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' tells no sensor size, and a pipe cannot be read twice to find it; "
                         "save it to a file first",
                         path);

    enum shef_err code = shef_events_source_open(path, shef_cpu_features(), &again, err);

    if (code != SHEF_OK)
        return code;
    code = find_extent(again, path, out_width_px, out_height_px, err);
    shef_events_source_close(again);
    return code;
}
