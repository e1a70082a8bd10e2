/* Writes an event file, RAW or DAT, from batches.
 *
 * The file appears under its name only when it is closed well; until then it is NAME.part, which
 * is removed when something fails. A DAT file of events gets its triggers, if there are any, in a
 * file of their own beside it. Blocks on writing. Thread: one per writer. */
#ifndef SHEF_CODECS_EVENT_WRITER_H
#define SHEF_CODECS_EVENT_WRITER_H

#include "codecs/evt_encode.h"
#include "codecs/raw_header.h"
#include "core/error.h"
#include "core/packets.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_event_writer;

struct shef_event_writer_config {
    bool is_raw;       /* else DAT */
    uint32_t width_px; /* RAW 1..2048, DAT 1..16384 */
    uint32_t height_px;
    const char *date; /* of the recording, YYYY-MM-DD HH:MM:SS; NULL: now */
    /* Only for RAW. */
    enum shef_evt_format format;
    enum shef_evt_ticks ticks;
    enum shef_raw_generation generation;
    const struct shef_raw_header *like; /* keeps its camera's data; NULL: none known */
};

/* Opens path.part and writes the header.
 * SHEF_ERR_INVALID: an impossible size. Errors of the system otherwise. */
SHEF_MUST_CHECK enum shef_err shef_event_writer_open(const char *path,
                                                     const struct shef_event_writer_config *config,
                                                     struct shef_event_writer **out_writer,
                                                     struct shef_error *err);

/* Appends a batch. After a failure only close() and abandon() may follow.
 * SHEF_ERR_INVALID: an event or trigger that the format cannot say; the sentence names it. */
SHEF_MUST_CHECK enum shef_err shef_event_writer_write(struct shef_event_writer *writer,
                                                      const struct shef_event_batch *batch,
                                                      struct shef_error *err);

/* Ends the file and gives it its name; after a failed write, removes it. Frees the writer.
 * Returns what went wrong last, here or in a write. */
SHEF_MUST_CHECK enum shef_err shef_event_writer_close(struct shef_event_writer *writer,
                                                      struct shef_error *err);

/* Removes what was written. Frees the writer; NULL is allowed. */
void shef_event_writer_abandon(struct shef_event_writer *writer);

#ifdef __cplusplus
}
#endif

#endif
