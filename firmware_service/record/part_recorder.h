/* What the recorders of frames, poses and triggers share: blocks, counts and the verdict.
 *
 * Blocks on disk; between start() and stop() nothing is allocated. Thread: one. */
#ifndef SHEF_RECORD_PART_RECORDER_H
#define SHEF_RECORD_PART_RECORDER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/block_writer.h"
#include "record/front_text.h"
#include "record/recording_writer.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a part is cut into files. */
struct shef_segment_limits {
    uint64_t segment_bytes; /* see struct shef_block_writer_config */
    int64_t segment_ns;
    int64_t sync_ns;
};

/* 512 MiB or 60 s a segment, forced to the disk every second. */
struct shef_segment_limits shef_segment_limits_default(void);

struct shef_part_recorder {
    struct shef_recording_writer *recording;
    struct shef_manifest_part *counts; /* in the recording's manifest */
    struct shef_block_writer blocks;
    struct shef_front_text front;
};

/* Makes the part's folder and its section of the manifest.
 *   recorder->front  filled in by the caller
 *   info             for the index
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_part_recorder_start(struct shef_part_recorder *recorder,
                                                       struct shef_recording_writer *recording,
                                                       enum shef_part part,
                                                       const uint8_t info[SHEF_PART_INFO_BYTES],
                                                       const struct shef_segment_limits *limits,
                                                       struct shef_error *err);

/* Appends a block; see shef_block_writer_append(). An error becomes the recording's verdict. */
SHEF_MUST_CHECK enum shef_err shef_part_recorder_write(struct shef_part_recorder *recorder,
                                                       const void *bytes, uint32_t n_bytes,
                                                       const struct shef_block_record *record,
                                                       struct shef_error *err);

/* Closes the files and says the verdict: gaps if reason is not "". */
SHEF_MUST_CHECK enum shef_err shef_part_recorder_stop(struct shef_part_recorder *recorder,
                                                      const char *reason, struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
