/* Reads the frame part of a recording, in order or at any place.
 *
 * Opening reads the indexes only; a frame's bytes are read when it is asked for, checked and, where
 * they were, decompressed. Damaged frames are left out and counted. What is odd becomes a note, one
 * sentence each. Blocks on reading. Thread: one per reader. */
#ifndef SHEF_RECORD_RECORDED_FRAMES_H
#define SHEF_RECORD_RECORDED_FRAMES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "record/block_reader.h"
#include "record/frame_part.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorded_frames;

struct shef_recorded_frame {
    struct shef_frame_info info;
    uint32_t index; /* in the recording: 0..n-1 */
    bool follows;   /* no frame is missing between the one before in the recording and this */
    uint32_t n_lost_before; /* frames known to have been lost while recording */
    const uint8_t *pixels;  /* info.row_bytes * info.height_px; until the next call */
};

/* Opens a recording's frames.
 * SHEF_ERR_NOT_FOUND: it has no frame part. SHEF_ERR_EMPTY: it has one without a single frame.
 * SHEF_ERR_FORMAT: no segment has a readable index. SHEF_ERR_UNSUPPORTED: frames of a later
 * version. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_frames_open(const char *path,
                                                        struct shef_recorded_frames **out_frames,
                                                        struct shef_error *err);

/* How many frames there are, by the indexes; their bytes may still turn out to be damaged. */
uint32_t shef_recorded_frames_count(const struct shef_recorded_frames *frames);

/* What all frames were meant to be. */
const struct shef_frame_part *shef_recorded_frames_format(
    const struct shef_recorded_frames *frames);

/* A text about the camera: "vendor", "model" or "serial"; "" if unknown. Valid until the next
 * call. */
const char *shef_recorded_frames_text(struct shef_recorded_frames *frames, const char *key);

/* The largest frame in bytes. */
uint32_t shef_recorded_frames_max_bytes(const struct shef_recorded_frames *frames);

/* What the camera said about a frame, without reading its pixels.
 *   index  0..count-1 */
const struct shef_frame_info *shef_recorded_frames_info(const struct shef_recorded_frames *frames,
                                                        uint32_t index);

/* Finds the first frame with this number of the camera.
 * Returns false if there is none. */
bool shef_recorded_frames_find(const struct shef_recorded_frames *frames, uint64_t number,
                               uint32_t *out_index);

/* How many frames are missing between the one before in the list and this: lost while recording, or
 * their blocks since. */
uint64_t shef_recorded_frames_missing_before(const struct shef_recorded_frames *frames,
                                             uint32_t index);

/* Reads the next intact frame.
 * SHEF_ERR_EMPTY: there are no more. Errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_frames_next(struct shef_recorded_frames *frames,
                                                        struct shef_recorded_frame *out_frame,
                                                        struct shef_error *err);

/* Makes next() go on with this frame.
 *   index  0..count */
void shef_recorded_frames_seek(struct shef_recorded_frames *frames, uint32_t index);

/* Reads one frame, wherever next() is.
 *   index  0..count-1
 * SHEF_ERR_FORMAT: it is damaged. SHEF_ERR_NO_MEMORY: none for the pixels, which the first read of
 * these allocates; read_into() never does. Errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_frames_read(struct shef_recorded_frames *frames,
                                                        uint32_t index,
                                                        struct shef_recorded_frame *out_frame,
                                                        struct shef_error *err);

/* The same into memory of the caller, who may keep it.
 *   room  shef_recorded_frames_max_bytes() */
SHEF_MUST_CHECK enum shef_err shef_recorded_frames_read_into(struct shef_recorded_frames *frames,
                                                             uint32_t index, uint8_t *room,
                                                             struct shef_recorded_frame *out_frame,
                                                             struct shef_error *err);

/* What was found so far; that of the indexes is complete. */
const struct shef_damage *shef_recorded_frames_damage(const struct shef_recorded_frames *frames);

/* The i-th note, NULL behind the last. */
const char *shef_recorded_frames_note(const struct shef_recorded_frames *frames, int i);

/* NULL is allowed. */
void shef_recorded_frames_close(struct shef_recorded_frames *frames);

#ifdef __cplusplus
}
#endif

#endif
