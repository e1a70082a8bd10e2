#include "codecs/event_reader.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "codecs/byte_source.h"
#include "codecs/evt_word.h"

#define MAX_NOTES 8

/* The DAT trigger file beside an event file, one batch ahead. */
struct companion {
    char *path;
    struct shef_byte_source source; /* closed: there is none, or it has ended */
    struct shef_dat_decoder decoder;
    struct shef_event_batch batch; /* of triggers read and not yet merged */
    uint32_t n_merged;
    struct shef_event no_events; /* a batch needs room for one */
};

struct shef_event_reader {
    char *path;
    struct shef_event_file_info info;
    struct shef_byte_source source;
    struct shef_evt_decoder evt;
    struct shef_dat_decoder dat;
    struct companion companion;
    uint64_t n_companion_triggers;
    bool has_ended;
    int n_notes;
    char notes[MAX_NOTES][SHEF_ERROR_TEXT_BYTES];
};

SHEF_PRINTF(2, 3) static void add_note(struct shef_event_reader *reader, const char *fmt, ...)
{
    va_list args;

    if (reader->n_notes == MAX_NOTES)
        return;
    va_start(args, fmt);
    vsnprintf(reader->notes[reader->n_notes++], SHEF_ERROR_TEXT_BYTES, fmt, args);
    va_end(args);
}

/* Whether header lines are those of a DAT file. */
static bool looks_like_dat(const uint8_t *bytes, size_t n_bytes, const char *path)
{
    struct shef_text_line line;
    size_t at = 0;
    const size_t n_path = strlen(path);

    while (shef_text_header_next(bytes, n_bytes, &at, &line)) {
        if (strcmp(line.key, "Version") == 0 || strcmp(line.key, "Data") == 0 ||
            strcmp(line.key, "Width") == 0 || strcmp(line.key, "Height") == 0)
            return true;
        if (strcmp(line.key, "evt") == 0 || strcmp(line.key, "format") == 0)
            return false;
    }
    return n_path > 4 && strcmp(path + n_path - 4, ".dat") == 0;
}

static enum shef_err start_raw(struct shef_event_reader *reader, uint32_t features,
                               struct shef_error *err)
{
    struct shef_event_file_info *info = &reader->info;
    struct shef_raw_header *raw = &info->raw;
    const enum shef_err code =
        shef_raw_header_parse(reader->source.bytes, reader->source.end, raw, err);

    if (code != SHEF_OK)
        return code;
    info->is_raw = true;
    info->size_known = raw->size == SHEF_RAW_SIZE_GIVEN || raw->size == SHEF_RAW_SIZE_OF_SYSTEM;
    info->width_px = raw->width_px;
    info->height_px = raw->height_px;
    reader->source.at = raw->n_bytes;
    shef_evt_init(&reader->evt, raw->format, raw->width_px, raw->height_px, 0, features);
    if (raw->size == SHEF_RAW_SIZE_ABSURD)
        add_note(reader,
                 "'%s': no sensor has the size in its header ('%s'), so coordinates are not "
                 "checked",
                 reader->path, raw->size_text);
    else if (raw->size == SHEF_RAW_SIZE_UNKNOWN)
        add_note(reader,
                 "'%s': the header does not tell the sensor's size, so coordinates are not checked",
                 reader->path);
    return SHEF_OK;
}

/* The trigger file's path that goes with an event file's, or NULL. The caller frees it. */
static char *companion_path(const char *path)
{
    static const char *const endings[] = { "_td.dat", "_cd.dat" };
    const size_t n_path = strlen(path);

    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        const size_t n_ending = strlen(endings[i]);
        char *found = NULL;

        if (n_path <= n_ending || strcmp(path + n_path - n_ending, endings[i]) != 0)
            continue;
        if (asprintf(&found, "%.*s_trigger.dat", (int)(n_path - n_ending), path) < 0)
            return NULL;
        return found;
    }
    return NULL;
}

/* Opens the trigger file if there is one; trouble with it is a note. */
static void start_companion(struct shef_event_reader *reader)
{
    struct companion *companion = &reader->companion;
    struct shef_dat_header header;
    struct shef_error err;

    companion->path = companion_path(reader->path);
    companion->batch = (struct shef_event_batch){ .events = &companion->no_events, .capacity = 1 };
    if (!companion->path || access(companion->path, F_OK) != 0)
        return;

    enum shef_err code = shef_byte_source_open(&companion->source, companion->path, &err);

    if (code == SHEF_OK)
        code = shef_dat_header_parse(companion->source.bytes, companion->source.end, &header, &err);
    if (code == SHEF_OK && header.content != SHEF_DAT_TRIGGERS)
        code = shef_fail(&err, SHEF_ERR_FORMAT, "its records are not triggers");
    if (code != SHEF_OK) {
        add_note(reader, "trigger file '%s' was left out: %s", companion->path, err.text);
        shef_byte_source_close(&companion->source);
        return;
    }
    companion->source.at = header.n_bytes;
    shef_dat_init(&companion->decoder, &header);
    reader->info.trigger_path = companion->path;
}

static enum shef_err start_dat(struct shef_event_reader *reader, struct shef_error *err)
{
    struct shef_event_file_info *info = &reader->info;
    struct shef_dat_header *dat = &info->dat;
    const enum shef_err code =
        shef_dat_header_parse(reader->source.bytes, reader->source.end, dat, err);

    if (code != SHEF_OK)
        return code;
    info->size_known = dat->has_size;
    info->width_px = dat->width_px;
    info->height_px = dat->height_px;
    reader->source.at = dat->n_bytes;
    shef_dat_init(&reader->dat, dat);
    if (dat->absurd_size)
        add_note(reader,
                 "'%s': no sensor has the size in its header, so coordinates are not checked",
                 reader->path);
    if (dat->content == SHEF_DAT_EVENTS)
        start_companion(reader);
    return SHEF_OK;
}

enum shef_err shef_event_reader_open(const char *path, uint32_t features,
                                     struct shef_event_reader **out_reader, struct shef_error *err)
{
    struct shef_event_reader *reader = calloc(1, sizeof *reader);

    if (!reader || !(reader->path = strdup(path))) {
        free(reader);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open event file '%s': out of memory", path);
    }

    enum shef_err code = shef_byte_source_open(&reader->source, path, err);

    if (code == SHEF_OK) {
        reader->info.n_file_bytes = reader->source.n_file_bytes;
        if (reader->source.end == 0)
            code = shef_fail(err, SHEF_ERR_FORMAT, "the file is empty");
        else if (looks_like_dat(reader->source.bytes, reader->source.end, path))
            code = start_dat(reader, err);
        else
            code = start_raw(reader, features, err);
        if (code != SHEF_OK)
            shef_fail_context(err, "'%s'", path);
    }
    if (code != SHEF_OK) {
        shef_event_reader_close(reader);
        return code;
    }
    *out_reader = reader;
    return SHEF_OK;
}

/* Notes what was left out, and why. */
static void note_losses(struct shef_event_reader *reader, const struct shef_evt_stats *stats)
{
    const struct shef_event_file_info *info = &reader->info;
    const unsigned long long n_outside = stats->n_violations[SHEF_EVT_OUTSIDE];
    const unsigned long long n_timeless = stats->n_violations[SHEF_EVT_NO_TIME];
    const bool is_void = stats->n_events == 0 && stats->n_triggers == 0;

    if (stats->n_bytes_skipped > 0)
        add_note(reader,
                 "'%s' is damaged: %llu bytes were skipped before words could be told apart again "
                 "(found again %llu time(s))",
                 reader->path, (unsigned long long)stats->n_bytes_skipped,
                 (unsigned long long)stats->n_resyncs);
    if (n_outside > 0)
        add_note(reader,
                 "'%s': %llu event(s) lie outside the sensor of %u x %u px that its header names "
                 "and were left out",
                 reader->path, n_outside, info->width_px, info->height_px);
    /* Few at the start are usual: a recording begins between two time words. */
    if (n_timeless > 0 && is_void)
        add_note(reader,
                 "'%s': all %llu event(s) were left out, because no time word precedes them",
                 reader->path, n_timeless);
    if (is_void && n_outside == 0 && n_timeless == 0)
        add_note(reader, "'%s' holds no event in the %llu bytes after its header", reader->path,
                 (unsigned long long)stats->n_bytes);
}

/* Notes what the whole file has shown. */
static void finish(struct shef_event_reader *reader)
{
    const bool is_raw = reader->info.is_raw;
    const uint32_t n_cut = is_raw ? shef_evt_finish(&reader->evt) : shef_dat_finish(&reader->dat);
    const struct shef_evt_stats *stats = is_raw ? &reader->evt.stats : &reader->dat.stats;
    /* EVT3's clock wraps every 17 s. */
    const bool is_wrap_rare = !is_raw || reader->evt.format != SHEF_EVT3;

    reader->has_ended = true;
    if (n_cut > 0)
        add_note(
            reader,
            "'%s' ends in the middle of a %s (%u of %u bytes); everything before that was read",
            reader->path, is_raw ? "word" : "record", n_cut,
            is_raw ? shef_evt_word_bytes(reader->evt.format) : 8);
    note_losses(reader, stats);
    if (stats->n_wraps > 0 && is_wrap_rare)
        add_note(reader, "'%s': the camera's clock wrapped %llu time(s), which was counted on",
                 reader->path, (unsigned long long)stats->n_wraps);
}

/* Puts a trigger into the batch where its time belongs. */
static void merge_trigger(struct shef_event_batch *batch, struct shef_trigger trigger)
{
    uint32_t first = 0;
    uint32_t last = batch->n_events;

    while (first < last) {
        const uint32_t middle = (first + last) / 2;

        if (shef_event_batch_time_us(batch, middle) < trigger.t_us)
            first = middle + 1;
        else
            last = middle;
    }
    trigger.n_before = first;
    batch->triggers[batch->n_triggers++] = trigger;
}

/* Merges the triggers up to the batch's time; with more than a batch holds, the rest comes with
 * the next ones. */
static enum shef_err merge_companion(struct shef_event_reader *reader,
                                     struct shef_event_batch *batch, struct shef_error *err)
{
    struct companion *companion = &reader->companion;
    struct shef_byte_source *source = &companion->source;

    while (source->is_open && batch->n_triggers < SHEF_BATCH_TRIGGERS) {
        if (companion->n_merged == companion->batch.n_triggers) {
            const enum shef_err code = shef_byte_source_fill(source, companion->path, err);

            if (code != SHEF_OK)
                return code;
            if (source->at_end && source->at == source->end) {
                shef_byte_source_close(source);
                break;
            }
            shef_event_batch_clear(&companion->batch);
            companion->n_merged = 0;
            source->at += shef_dat_decode(&companion->decoder, source->bytes + source->at,
                                          source->end - source->at, &companion->batch);
            continue;
        }

        const struct shef_trigger trigger = companion->batch.triggers[companion->n_merged];

        if (!reader->has_ended && trigger.t_us > batch->reached_us)
            break;
        merge_trigger(batch, trigger);
        companion->n_merged++;
        reader->n_companion_triggers++;
    }
    return SHEF_OK;
}

enum shef_err shef_event_reader_next(struct shef_event_reader *reader,
                                     struct shef_event_batch *batch, struct shef_error *err)
{
    struct shef_byte_source *source = &reader->source;

    shef_event_batch_clear(batch);
    while (!reader->has_ended) {
        const enum shef_err code = shef_byte_source_fill(source, reader->path, err);

        /* What the batch already holds goes out first; the next call fails. */
        if (code != SHEF_OK && (batch->n_events > 0 || batch->n_triggers > 0))
            break;
        if (code != SHEF_OK)
            return code;

        const size_t n_bytes = source->end - source->at;

        if (n_bytes == 0) {
            if (source->at_end)
                finish(reader);
            continue;
        }

        const uint8_t *const bytes = source->bytes + source->at;
        const size_t n_taken = reader->info.is_raw
                                   ? shef_evt_decode(&reader->evt, bytes, n_bytes, batch)
                                   : shef_dat_decode(&reader->dat, bytes, n_bytes, batch);

        source->at += n_taken;
        if (n_taken < n_bytes)
            break;
    }

    const enum shef_err code = merge_companion(reader, batch, err);

    if (code != SHEF_OK)
        return code;
    return batch->n_events > 0 || batch->n_triggers > 0 ? SHEF_OK : SHEF_ERR_EMPTY;
}

const struct shef_event_file_info *shef_event_reader_info(const struct shef_event_reader *reader)
{
    return &reader->info;
}

struct shef_evt_stats shef_event_reader_stats(const struct shef_event_reader *reader)
{
    struct shef_evt_stats stats = reader->info.is_raw ? reader->evt.stats : reader->dat.stats;

    stats.n_triggers += reader->n_companion_triggers;
    return stats;
}

double shef_event_reader_progress(const struct shef_event_reader *reader)
{
    const struct shef_byte_source *source = &reader->source;
    const int64_t n_used = source->n_read - (int64_t)(source->end - source->at);

    return source->n_file_bytes > 0 ? (double)n_used / (double)source->n_file_bytes : 0.0;
}

const char *shef_event_reader_note(const struct shef_event_reader *reader, int i)
{
    return i < reader->n_notes ? reader->notes[i] : NULL;
}

void shef_event_reader_close(struct shef_event_reader *reader)
{
    if (!reader)
        return;
    shef_byte_source_close(&reader->source);
    shef_byte_source_close(&reader->companion.source);
    free(reader->companion.path);
    free(reader->path);
    free(reader);
}
