/* manifest.json: what a recording is, when it was made, how it ended, and what its files were.
 *
 * Written when the recording begins ("recording") and again when it ends ("closed"), each time
 * whole. Reading events never depends on it: what decoding needs stands in the segments' indexes,
 * under checksums. The manifest is what a person reads first, and what the files are compared
 * with. docs/recording.md has the tables. Thread: any. */
#ifndef SHEF_RECORD_MANIFEST_H
#define SHEF_RECORD_MANIFEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "codecs/evt.h"
#include "codecs/raw_header.h"
#include "core/error.h"
#include "core/sha256.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_MANIFEST_NAME       "manifest.json"
#define SHEF_MANIFEST_MAX_BYTES  (64u << 20)
#define SHEF_MANIFEST_PATH_BYTES 128
#define SHEF_MANIFEST_MAX_GAPS   32

enum shef_verdict {
    SHEF_VERDICT_UNKNOWN, /* still recording, or cut before it could be said */
    SHEF_VERDICT_CLEAN,   /* nothing is known to be missing */
    SHEF_VERDICT_GAPS,    /* something is missing, the reasons say what */
    SHEF_VERDICT_STOPPED, /* an error ended the recording before it was asked to end */
    SHEF_VERDICTS,
};

/* A file as it was when the recording was closed. */
struct shef_manifest_file {
    char path[SHEF_MANIFEST_PATH_BYTES]; /* inside the folder: "events/000000.raw" */
    uint64_t n_bytes;
    char sha256[SHEF_SHA256_TEXT_BYTES]; /* in hexadecimal; "" where it was not computed */
};

/* A place where sensor buffers were lost while recording. */
struct shef_manifest_gap {
    int64_t at_us; /* event time reached before it */
    uint32_t n_lost_buffers;
};

/* The event part; the counts are zero until the recording is closed. */
struct shef_manifest_events {
    bool is_present;
    struct shef_raw_header camera; /* format, size, and what is known of the camera */
    uint32_t n_segments;
    uint64_t n_blocks;
    uint64_t n_lost_buffers;
    int64_t first_us; /* event time */
    int64_t last_us;
    struct shef_evt_stats stats;                           /* of the live decoder */
    struct shef_manifest_gap gaps[SHEF_MANIFEST_MAX_GAPS]; /* the first ones */
    uint32_t n_gaps;
};

/* Frames, poses or triggers; the counts are zero until the recording is closed. */
struct shef_manifest_part {
    bool is_present;
    char source[192]; /* what it was recorded from, for people */
    uint32_t n_segments;
    uint64_t n_blocks;
    uint64_t n_items; /* frames, data packages, edges */
    uint64_t n_bytes; /* of blocks */
    uint64_t n_lost;  /* known to be lost before they could be recorded */
    int64_t first_us; /* the part's own clock */
    int64_t last_us;
};

struct shef_manifest {
    uint8_t session[SHEF_SESSION_BYTES];
    char software[64];
    char created[40]; /* UTC, "2026-03-01T12:00:00.000000Z" */
    int64_t utc_minus_host_ns;
    bool is_closed;
    enum shef_verdict verdict;
    char reason[SHEF_ERROR_TEXT_BYTES]; /* one sentence, "" for a clean recording */
    struct shef_manifest_events events;
    struct shef_manifest_part parts[SHEF_PART_TRIGGERS + 1]; /* by number; not that of events */
    struct shef_manifest_file *files; /* n_files, owned; only of a closed recording */
    size_t n_files;
};

/* Writes REC/manifest.json in one step, see shef_file_replace(). */
SHEF_MUST_CHECK enum shef_err shef_manifest_write(const char *folder,
                                                  const struct shef_manifest *manifest,
                                                  struct shef_error *err);

/* Reads REC/manifest.json; shef_manifest_free() afterwards.
 * SHEF_ERR_NOT_FOUND, SHEF_ERR_FORMAT, SHEF_ERR_UNSUPPORTED (of a later version), and the errors
 * of the system. */
SHEF_MUST_CHECK enum shef_err shef_manifest_read(const char *folder,
                                                 struct shef_manifest *out_manifest,
                                                 struct shef_error *err);

/* The same for bytes in memory; sentences name no file. */
SHEF_MUST_CHECK enum shef_err shef_manifest_parse(const void *bytes, size_t n_bytes,
                                                  struct shef_manifest *out_manifest,
                                                  struct shef_error *err);

/* A zeroed manifest is allowed. */
void shef_manifest_free(struct shef_manifest *manifest);

/* "clean", "gaps", "stopped" or "unknown". */
const char *shef_verdict_name(enum shef_verdict verdict);

/* Adds a file with no checksum. SHEF_ERR_NO_MEMORY: nothing was added; no sentence. */
SHEF_MUST_CHECK enum shef_err shef_manifest_add_file(struct shef_manifest *manifest,
                                                     const char *path, uint64_t n_bytes);

#ifdef __cplusplus
}
#endif

#endif
