/* Reads an event file of any kind, RAW or DAT, as batches.
 *
 * The kind follows from the file's content. Beside a DAT file of events, `NAME_td.dat`,
 * `NAME_cd.dat` or `log_td.dat`, a trigger file `NAME_trigger.dat` is read along and merged by
 * time. What is odd about a file and can be lived with becomes a note, one sentence each; reading
 * goes on. Files may be pipes. Blocks on reading. Thread: one per reader. */
#ifndef SHEF_CODECS_EVENT_READER_H
#define SHEF_CODECS_EVENT_READER_H

#include "codecs/dat.h"
#include "codecs/evt.h"
#include "codecs/raw_header.h"
#include "core/error.h"
#include "core/packets.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_event_reader;

struct shef_event_file_info {
    bool is_raw;                /* else DAT */
    struct shef_raw_header raw; /* only of a RAW file */
    struct shef_dat_header dat; /* only of a DAT file */
    bool size_known;            /* given by the header or its camera */
    uint32_t width_px;          /* the largest possible where it is not known */
    uint32_t height_px;
    int64_t n_file_bytes;     /* -1: a pipe */
    const char *trigger_path; /* of the DAT trigger file read along, or NULL */
};

/* Opens a file and reads its header.
 *   features    instruction sets to use, usually shef_cpu_features()
 *   out_reader  closed by the caller
 * Errors: those of the system, and of shef_raw_header_parse() and shef_dat_header_parse(); each
 * sentence names the path. */
SHEF_MUST_CHECK enum shef_err shef_event_reader_open(const char *path, uint32_t features,
                                                     struct shef_event_reader **out_reader,
                                                     struct shef_error *err);

/* Clears the batch and fills it with what comes next: at least one event or trigger.
 * SHEF_ERR_EMPTY: the file has ended; batch->reached_us says where.
 * SHEF_ERR_IO: reading failed; what came before stays valid. */
SHEF_MUST_CHECK enum shef_err shef_event_reader_next(struct shef_event_reader *reader,
                                                     struct shef_event_batch *batch,
                                                     struct shef_error *err);

const struct shef_event_file_info *shef_event_reader_info(const struct shef_event_reader *reader);

/* Counts so far; those of a trigger file read along are not in them but for n_triggers. */
struct shef_evt_stats shef_event_reader_stats(const struct shef_event_reader *reader);

/* How much of the file has been used, 0..1; 0 for a pipe. */
double shef_event_reader_progress(const struct shef_event_reader *reader);

/* The i-th note, NULL behind the last. Some come only with the file's end. */
const char *shef_event_reader_note(const struct shef_event_reader *reader, int i);

/* NULL is allowed. */
void shef_event_reader_close(struct shef_event_reader *reader);

#ifdef __cplusplus
}
#endif

#endif
