/* What the writer and the readers of the frame part agree on. Thread: any. */
#ifndef SHEF_RECORD_FRAME_PART_H
#define SHEF_RECORD_FRAME_PART_H

#include <stdbool.h>
#include <stdint.h>

#include "core/frame.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_frame_coding {
    SHEF_FRAME_RAW = 0,
    SHEF_FRAME_LZ4 = 1, /* one block of LZ4 */
    SHEF_FRAME_CODINGS,
};

/* The size and format all frames are meant to have: the part's own bytes in the index header. */
struct shef_frame_part {
    uint32_t width_px;
    uint32_t height_px;
    uint32_t pixel_format;
};

/* Whether a frame is complete and of the part's size and format. One that is not is kept as the
 * camera gave it, but nothing that goes by the part's may look at its pixels. */
bool shef_frame_is_usable(const struct shef_frame_info *info, const struct shef_frame_part *part);

/* How many bytes the pixels take; 0 if sizes, format or row length are impossible. */
uint32_t shef_frame_bytes(const struct shef_frame_info *info);

void shef_frame_part_encode(const struct shef_frame_part *part,
                            uint8_t out_info[SHEF_PART_INFO_BYTES]);

/* Returns false if the size or the format is impossible. */
bool shef_frame_part_decode(const uint8_t info[SHEF_PART_INFO_BYTES],
                            struct shef_frame_part *out_part);

/* The state in a frame's record; arrived is not part of it. */
void shef_frame_state_encode(const struct shef_frame_info *info, enum shef_frame_coding coding,
                             uint8_t out_state[SHEF_BLOCK_STATE_BYTES]);

/* Returns false if sizes, format or coding are impossible. */
bool shef_frame_state_decode(const struct shef_block_record *record,
                             struct shef_frame_info *out_info, enum shef_frame_coding *out_coding);

#ifdef __cplusplus
}
#endif

#endif
