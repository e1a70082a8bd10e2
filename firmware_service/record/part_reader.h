/* What the readers of frames, poses and triggers share: opening, the front text, notes.
 * Thread: one per reader. */
#ifndef SHEF_RECORD_PART_READER_H
#define SHEF_RECORD_PART_READER_H

#include "core/error.h"
#include "record/block_reader.h"
#include "record/front_text.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_PART_MAX_NOTES 12

struct shef_part_notes {
    int n;
    char texts[SHEF_PART_MAX_NOTES][SHEF_ERROR_TEXT_BYTES];
};

struct shef_part_reader {
    struct shef_block_reader *blocks;
    struct shef_front_text front;
    struct shef_part_notes notes;
};

/* Opens a part.
 *   front_kind  that the front text must be of: "shef-frames"
 * SHEF_ERR_NOT_FOUND: the recording has no such part. SHEF_ERR_EMPTY: nothing was recorded.
 * SHEF_ERR_FORMAT, SHEF_ERR_UNSUPPORTED, SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_part_reader_open(struct shef_part_reader *reader,
                                                    const char *path, enum shef_part part,
                                                    const char *front_kind, struct shef_error *err);

/* Adds a sentence; those beyond the last room are dropped. */
SHEF_PRINTF(2, 3) void shef_part_reader_note(struct shef_part_reader *reader, const char *fmt, ...);

/* Adds sentences about everything in the damage. */
void shef_part_reader_note_damage(struct shef_part_reader *reader);

/* The i-th note, NULL behind the last. */
const char *shef_part_reader_get_note(const struct shef_part_reader *reader, int i);

/* A zeroed reader is allowed. */
void shef_part_reader_close(struct shef_part_reader *reader);

#ifdef __cplusplus
}
#endif

#endif
