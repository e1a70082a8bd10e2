#include <string.h>

#include <shef_cloud_t.h>

#include "publish/encoder_internal.h"

#define POINT_BYTES 16

static void put_point(uint8_t *to, const struct shef_result *result, uint32_t pixel)
{
    const int32_t x = (int32_t)(pixel % (uint32_t)result->depth_m.width_px);
    const int32_t y = (int32_t)(pixel / (uint32_t)result->depth_m.width_px);
    const float z_m = shef_row_f32(result->depth_m, y)[x];
    const float xyz_m[3] = { (float)((x - result->cx_px) / result->f_px) * z_m,
                             (float)((y - result->cy_px) / result->f_px) * z_m, z_m };
    const float confidence = shef_row_f32(result->confidence, y)[x];
    const float sigma_mm = shef_row_f32(result->sigma_m, y)[x] * 1000.0f;
    const uint16_t sigma =
        sigma_mm < 65535.0f ? (uint16_t)(sigma_mm > 0.0f ? sigma_mm + 0.999f : 0.0f) : 65535;

    memcpy(to, xyz_m, sizeof xyz_m);
    to[12] = result->has_picture ? shef_row_u8(result->picture, y)[x] : 0;
    to[13] = (uint8_t)((confidence < 1.0f ? confidence : 1.0f) * 255.0f + 0.5f);
    memcpy(to + 14, &sigma, sizeof sigma);
}

enum shef_err shef_encoder_cloud(struct shef_encoder *encoder)
{
    const struct shef_result *result = encoder->result;
    const struct shef_picks *picks = &encoder->picks;
    const int fixed_bytes = shef_cloud_t_encoded_size(&(shef_cloud_t){ .n = 0 });
    const int32_t chunk_points = (SHEF_MESSAGE_MAX_BYTES - fixed_bytes) / POINT_BYTES;
    const uint32_t n_picks = picks->row_start[picks->grid_h];
    int32_t n_points = 0;
    uint32_t next = 0;

    for (uint32_t i = 0; i < n_picks; i++)
        n_points += shef_encoder_at(result->depth_m, picks->pixels[i]) > 0.0f;

    const int32_t n_chunks = n_points ? (n_points + chunk_points - 1) / chunk_points : 1;

    for (int32_t chunk = 0; chunk < n_chunks; chunk++) {
        int32_t n = 0;

        for (; next < n_picks && n < chunk_points; next++)
            if (shef_encoder_at(result->depth_m, picks->pixels[next]) > 0.0f)
                put_point(encoder->payload + (ptrdiff_t)POINT_BYTES * n++, result,
                          picks->pixels[next]);

        shef_cloud_t message = {
            .mode = result->mode,
            .shed_bits = (int32_t)result->shed_bits,
            .validity = (int32_t)result->flags,
            .first_point = chunk * chunk_points,
            .n_points = n,
            .n = n * POINT_BYTES,
            .data = encoder->payload,
        };

        shef_encoder_set_header(&message.header, result, chunk, n_chunks);

        const enum shef_err sent = shef_encoder_emit(
            encoder, SHEF_CHANNEL_CLOUD,
            shef_cloud_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
            message.header.utime);

        if (sent)
            return sent;
    }
    return SHEF_OK;
}
