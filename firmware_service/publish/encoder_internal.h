/* What the encoder's files share. */
#ifndef SHEF_PUBLISH_ENCODER_INTERNAL_H
#define SHEF_PUBLISH_ENCODER_INTERNAL_H

#include <shef_header_t.h>

#include "publish/encoder.h"
#include "publish/picks.h"

struct shef_encoder {
    struct shef_picks picks;
    /* A payload is made for the whole grid, then sent row by row. Depth drops pixels that its code
     * cannot say, so it has a mask and row starts of its own. */
    uint16_t *codes;       /* one for each pixel that is sent */
    uint8_t *sigmas;       /* the same, of depth */
    uint8_t *depth_mask;   /* as picks.mask */
    uint32_t *depth_start; /* as picks.row_start */
    uint8_t *payload;      /* one message's data */
    uint8_t *message;      /* one message */
    /* Of the call in hand. */
    const struct shef_result *result;
    shef_message_fn *emit;
    void *context;
};

static inline float shef_encoder_at(struct shef_image_f32 image, uint32_t pixel)
{
    const uint32_t width_px = (uint32_t)image.width_px;

    /* Rows without gaps, the usual case, need no division. */
    if (image.stride_bytes == (ptrdiff_t)(width_px * sizeof(float)))
        return image.data[pixel];
    return shef_row_f32(image, (int32_t)(pixel / width_px))[pixel % width_px];
}

/* Everything but the checksum, which emit() adds. */
void shef_encoder_set_header(shef_header_t *header, const struct shef_result *result, int32_t chunk,
                             int32_t n_chunks);

/* Puts the checksum into encoder->message, n_bytes long, and hands it on. */
enum shef_err shef_encoder_emit(struct shef_encoder *encoder, enum shef_channel channel,
                                int n_bytes, int64_t utime_us);

/* The messages of encoder->result on one channel; picks have been chosen. */
enum shef_err shef_encoder_disparity(struct shef_encoder *encoder);
enum shef_err shef_encoder_depth(struct shef_encoder *encoder);
enum shef_err shef_encoder_dense(struct shef_encoder *encoder);
enum shef_err shef_encoder_cloud(struct shef_encoder *encoder);

#endif
