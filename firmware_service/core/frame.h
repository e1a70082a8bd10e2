/* Frames of the frame camera: what is known about one, and how it travels on the rings. */
#ifndef SHEF_CORE_FRAME_H
#define SHEF_CORE_FRAME_H

#include <stdint.h>

#include "core/time.h"

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

struct shef_buffer;

/* A frame on its way from a camera, or its replay, to the consumers. Whoever pops it holds the
 * buffer and gives it back. */
struct shef_frame_packet {
    struct shef_buffer *buffer; /* the pixels: info.row_bytes * info.height_px bytes */
    struct shef_frame_info info;
    uint64_t number;        /* counted by the source from 0; without gaps */
    uint32_t n_lost_before; /* frames that are known to be lost between the last one and this */
};

#ifdef __cplusplus
}
#endif

#endif
