/* Writes the frame part of a recording.
 *
 * Frames are kept as the camera sent them, each alone, raw or as one LZ4 block where that is
 * smaller. Frames that are known to be lost, by the caller or by the camera's own count, and
 * incomplete ones make the recording's verdict. Blocks on disk; between start() and stop() nothing
 * is allocated. Thread: one, not a streaming one. */
#ifndef SHEF_RECORD_FRAME_RECORDER_H
#define SHEF_RECORD_FRAME_RECORDER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/frame_part.h"
#include "record/part_recorder.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_frame_recorder;

struct shef_frame_recorder_config {
    struct shef_frame_part format; /* of the frames that are to come */
    const char *vendor;            /* texts about the camera, not kept; NULL: unknown */
    const char *model;
    const char *serial;
    bool with_lz4;
    struct shef_segment_limits limits;
};

/* Raw, no texts, usual segments. */
struct shef_frame_recorder_config shef_frame_recorder_default_config(
    const struct shef_frame_part *format);

/* Makes the part.
 *   recording  kept; the manifest's section is the recorder's to write until stop()
 * SHEF_ERR_INVALID: an impossible size or format. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_frame_recorder_start(
    struct shef_recording_writer *recording, const struct shef_frame_recorder_config *config,
    struct shef_frame_recorder **out_recorder, struct shef_error *err);

/* Records one frame.
 *   pixels         row_bytes * height_px bytes
 *   n_lost_before  frames that are known to be lost between the last one and this
 * SHEF_ERR_INVALID: sizes or format that cannot be; nothing was recorded, others may follow. After
 * any other error, which becomes the recording's verdict, only stop() may follow. */
SHEF_MUST_CHECK enum shef_err shef_frame_recorder_write(struct shef_frame_recorder *recorder,
                                                        const struct shef_frame_info *info,
                                                        const void *pixels, uint32_t n_lost_before,
                                                        struct shef_error *err);

/* Closes the files and says the verdict. Frees the recorder.
 * Returns what went wrong here; an error of write() is not repeated. */
SHEF_MUST_CHECK enum shef_err shef_frame_recorder_stop(struct shef_frame_recorder *recorder,
                                                       struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
