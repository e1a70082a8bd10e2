#include "record/recorded_events.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_NOTES 16

struct shef_recorded_events {
    char *path;
    struct shef_recording recording;
    struct shef_block_reader *reader; /* NULL: there is no segment */
    struct shef_event_part part;
    struct shef_evt_decoder decoder;
    uint8_t *block; /* SHEF_EVENT_BLOCK_MAX_BYTES */
    uint32_t at;    /* of the block's bytes */
    uint32_t n_block;
    uint64_t n_seen;  /* the number after the last block's */
    uint32_t segment; /* of the last block */
    bool has_ended;
    uint32_t n_gaps;
    struct shef_recorded_gap gaps[SHEF_RECORDED_MAX_GAPS];
    int n_notes;
    char notes[MAX_NOTES][SHEF_ERROR_TEXT_BYTES];
};

SHEF_PRINTF(2, 3) static void add_note(struct shef_recorded_events *events, const char *fmt, ...)
{
    va_list args;

    if (events->n_notes == MAX_NOTES)
        return;
    va_start(args, fmt);
    vsnprintf(events->notes[events->n_notes++], SHEF_ERROR_TEXT_BYTES, fmt, args);
    va_end(args);
}

static void note_manifest(struct shef_recorded_events *events)
{
    const struct shef_recording *recording = &events->recording;
    const struct shef_manifest *manifest = &recording->manifest;

    if (!recording->has_manifest)
        add_note(events, "the manifest is not used (%s); everything else comes from the indexes",
                 recording->manifest_trouble);
    else if (!manifest->is_closed)
        add_note(events,
                 "'%s' was not closed: it is being recorded, or was cut; what was written is read",
                 events->path);
    else if (manifest->verdict > SHEF_VERDICT_CLEAN)
        add_note(events, "'%s' was recorded with the verdict '%s': %s", events->path,
                 shef_verdict_name(manifest->verdict), manifest->reason);
}

static enum shef_err open_part(struct shef_recorded_events *events, uint32_t features,
                               struct shef_error *err)
{
    char folder[PATH_MAX];

    if (snprintf(folder, sizeof folder, "%s/" SHEF_EVENT_FOLDER, events->path) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "open '%s': the path is too long", events->path);

    enum shef_err code = shef_block_reader_open(folder, SHEF_PART_EVENTS, SHEF_EVENT_ENDING,
                                                SHEF_EVENT_BLOCK_MAX_BYTES, &events->reader, err);

    if (code == SHEF_ERR_EMPTY) {
        add_note(events, "'%s' ended before the first event was recorded", events->path);
        events->has_ended = true;
        return SHEF_OK;
    }
    if (code == SHEF_ERR_NOT_FOUND)
        return shef_fail(err, code,
                         "the recording '%s' has no event part (no folder " SHEF_EVENT_FOLDER
                         " in it)",
                         events->path);
    if (code != SHEF_OK)
        return code;

    const struct shef_block_summary *summary = shef_block_reader_summary(events->reader);
    const struct shef_recording *recording = &events->recording;

    if (!shef_event_part_decode(summary->header.info, &events->part))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "'%s' holds events in a form that this program does not know", folder);
    if (recording->has_manifest &&
        memcmp(recording->manifest.session, summary->header.session, SHEF_SESSION_BYTES) != 0)
        add_note(events, "the manifest of '%s' and its events are of two recordings", events->path);
    shef_evt_init(&events->decoder, events->part.format, events->part.width_px,
                  events->part.height_px, 0, features);
    return SHEF_OK;
}

enum shef_err shef_recorded_events_open(const char *path, uint32_t features,
                                        struct shef_recorded_events **out_events,
                                        struct shef_error *err)
{
    struct shef_recorded_events *events = calloc(1, sizeof *events);

    if (events) {
        events->path = strdup(path);
        events->block = malloc(SHEF_EVENT_BLOCK_MAX_BYTES);
    }
    if (!events || !events->path || !events->block) {
        shef_recorded_events_close(events);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open recording '%s': out of memory", path);
    }

    enum shef_err code = shef_recording_inspect(path, &events->recording, err);

    if (code == SHEF_OK) {
        note_manifest(events);
        code = open_part(events, features, err);
    }
    if (code != SHEF_OK) {
        shef_recorded_events_close(events);
        return code;
    }
    *out_events = events;
    return SHEF_OK;
}

static void add_gap(struct shef_recorded_events *events, const struct shef_block *block,
                    uint64_t n_missing)
{
    if (events->n_gaps == SHEF_RECORDED_MAX_GAPS)
        return;
    events->gaps[events->n_gaps++] = (struct shef_recorded_gap){
        .from_us =
            events->n_seen > 0 ? shef_evt_reached_us(&events->decoder) : block->record.first_us,
        .to_us = block->record.first_us,
        .n_missing_blocks = n_missing,
        .n_lost_buffers = block->record.n_lost_before,
    };
}

/* Reads the next block and prepares the decoder for it. */
static enum shef_err take_block(struct shef_recorded_events *events, struct shef_error *err)
{
    struct shef_block block;
    const enum shef_err code = shef_block_reader_next(events->reader, events->block, &block, err);

    if (code != SHEF_OK)
        return code;

    const uint64_t n_missing = block.record.number - events->n_seen;

    if (n_missing > 0 || block.record.n_lost_before > 0)
        add_gap(events, &block, n_missing);
    events->n_seen = block.record.number + 1;
    events->at = 0;
    events->n_block = block.record.n_bytes;
    /* A segment may begin where the source has begun anew. A state that its record's checksum
     * vouches for and that is none is of another version. */
    const bool restarts = !block.follows || block.segment != events->segment;

    events->segment = block.segment;
    if (restarts && shef_evt_restore(&events->decoder, block.record.state, err) != SHEF_OK)
        return SHEF_ERR_FORMAT;
    return SHEF_OK;
}

/* Notes what the whole part has shown. */
static void finish(struct shef_recorded_events *events)
{
    const struct shef_damage *damage = shef_block_reader_damage(events->reader);
    const struct shef_manifest_events *promised = &events->recording.manifest.events;
    const uint32_t n_cut = shef_evt_finish(&events->decoder);

    events->has_ended = true;
    if (n_cut > 0)
        add_note(events, "'%s' ends in the middle of a word; everything before that was read",
                 events->path);
    if (damage->n_bad_blocks > 0)
        add_note(events, "%llu blocks do not match their checksums and were left out",
                 (unsigned long long)damage->n_bad_blocks);
    if (damage->n_cut_blocks > 0)
        add_note(events, "%llu blocks lie beyond the ends of their files, which were cut",
                 (unsigned long long)damage->n_cut_blocks);
    if (damage->n_bad_records > 0)
        add_note(events, "%llu records of the indexes are damaged, so their blocks were left out",
                 (unsigned long long)damage->n_bad_records);
    if (damage->n_loose_bytes > 0)
        add_note(events, "%llu bytes have no record in an index and were left out",
                 (unsigned long long)damage->n_loose_bytes);
    if (damage->n_bad_segments > 0)
        add_note(events,
                 "%u segments have no readable index and were left out; their .raw files "
                 "can be read one by one",
                 damage->n_bad_segments);
    if (damage->n_lost_segments > 0)
        add_note(events, "%u segments are missing", damage->n_lost_segments);
    if (damage->n_strange_segments > 0)
        add_note(events, "%u segments belong to another recording and were left out",
                 damage->n_strange_segments);
    if (damage->n_missing_blocks > 0)
        add_note(events, "%llu blocks are missing between others",
                 (unsigned long long)damage->n_missing_blocks);
    if (events->recording.has_manifest && promised->n_blocks > events->n_seen)
        add_note(events, "the last %llu of %llu blocks are missing",
                 (unsigned long long)(promised->n_blocks - events->n_seen),
                 (unsigned long long)promised->n_blocks);
}

enum shef_err shef_recorded_events_next(struct shef_recorded_events *events,
                                        struct shef_event_batch *batch, struct shef_error *err)
{
    shef_event_batch_clear(batch);
    while (!events->has_ended) {
        if (events->at == events->n_block) {
            const enum shef_err code = take_block(events, err);

            if (code == SHEF_ERR_EMPTY)
                finish(events);
            else if (code != SHEF_OK)
                return code;
            continue;
        }

        const uint32_t n_left = events->n_block - events->at;
        const size_t n_taken =
            shef_evt_decode(&events->decoder, events->block + events->at, n_left, batch);

        events->at += (uint32_t)n_taken;
        if (n_taken < n_left)
            break;
    }
    return batch->n_events > 0 || batch->n_triggers > 0 ? SHEF_OK : SHEF_ERR_EMPTY;
}

const struct shef_event_part *shef_recorded_events_part(const struct shef_recorded_events *events)
{
    return events->reader ? &events->part : NULL;
}

const struct shef_recording *shef_recorded_events_recording(
    const struct shef_recorded_events *events)
{
    return &events->recording;
}

struct shef_evt_stats shef_recorded_events_stats(const struct shef_recorded_events *events)
{
    return events->decoder.stats;
}

struct shef_damage shef_recorded_events_damage(const struct shef_recorded_events *events)
{
    return events->reader ? *shef_block_reader_damage(events->reader) : (struct shef_damage){ 0 };
}

const struct shef_recorded_gap *shef_recorded_events_gap(const struct shef_recorded_events *events,
                                                         uint32_t i)
{
    return i < events->n_gaps ? &events->gaps[i] : NULL;
}

double shef_recorded_events_progress(const struct shef_recorded_events *events)
{
    const uint64_t n_total =
        events->reader ? shef_block_reader_summary(events->reader)->n_bytes : 0;

    return n_total > 0 ? (double)shef_block_reader_position(events->reader) / (double)n_total : 0;
}

const char *shef_recorded_events_note(const struct shef_recorded_events *events, int i)
{
    return i < events->n_notes ? events->notes[i] : NULL;
}

void shef_recorded_events_close(struct shef_recorded_events *events)
{
    if (!events)
        return;
    shef_block_reader_close(events->reader);
    shef_recording_free(&events->recording);
    free(events->block);
    free(events->path);
    free(events);
}
