/* What the writer and the readers of the frame part agree on. Thread: any. */
#ifndef SHEF_RECORD_FRAME_PART_H
#define SHEF_RECORD_FRAME_PART_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FRAME_MAX_SIDE_PX 4096
#define SHEF_FRAME_MAX_BYTES   (48u << 20) /* 4096 x 4096 px of 16 bits, and some padding */

/* Pixel formats, GenICam PFNC 2.4. Bits 16 to 23 of any code are the bits a pixel takes. */
#define SHEF_PFNC_MONO8     0x01080001u
#define SHEF_PFNC_BAYER_GR8 0x01080008u
#define SHEF_PFNC_BAYER_RG8 0x01080009u
#define SHEF_PFNC_BAYER_GB8 0x0108000au
#define SHEF_PFNC_BAYER_BG8 0x0108000bu

/* What the camera says about a frame. */
struct shef_frame_info {
    uint64_t number;      /* the camera's own count */
    shef_frame_time time; /* as the camera stamped it */
    shef_host_time arrived;
    uint32_t exposure_us;
    uint32_t gain_mdb; /* 0.001 dB */
    uint32_t width_px; /* 1..SHEF_FRAME_MAX_SIDE_PX */
    uint32_t height_px;
    uint32_t row_bytes;    /* from row to row, at least the pixels */
    uint32_t pixel_format; /* PFNC */
    uint32_t status;       /* 0: complete; otherwise the driver's reason */
};

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
