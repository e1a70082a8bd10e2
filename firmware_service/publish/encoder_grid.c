#include <assert.h>
#include <string.h>

#include <shef_dense_t.h>
#include <shef_depth_t.h>
#include <shef_disparity_t.h>

#include "publish/encoder_internal.h"

/* A grid of numbers that is to be cut into chunks. */
struct grid {
    const uint8_t *mask;       /* NULL: every cell has a code */
    const uint32_t *row_start; /* n_rows + 1; NULL with mask */
    const uint16_t *codes;
    const uint8_t *sigmas; /* NULL: none */
    int32_t n_rows;
    int32_t row_cells;
    int32_t mask_bytes; /* of a row */
};

/* Rows first..end - 1 of a grid, as one message carries them. */
struct chunk {
    int32_t index, n_chunks;
    int32_t first_row, end_row;
    int32_t n_points;
    int32_t n_bytes; /* in encoder->payload */
};

/* What disparity_t, depth_t and dense_t have in common; the generated types are strangers. */
#define SET_VIEW(message, encoder, chunk)                                                          \
    do {                                                                                           \
        const struct shef_result *result_ = (encoder)->result;                                     \
                                                                                                   \
        shef_encoder_set_header(&(message)->header, result_, (chunk)->index, (chunk)->n_chunks);   \
        (message)->width = (encoder)->picks.width_px;                                              \
        (message)->height = (encoder)->picks.height_px;                                            \
        (message)->grid_step = (encoder)->picks.grid_step;                                         \
        (message)->f_px = result_->f_px;                                                           \
        (message)->cx = result_->cx_px;                                                            \
        (message)->cy = result_->cy_px;                                                            \
        (message)->baseline_m = result_->baseline_m;                                               \
        (message)->mode = result_->mode;                                                           \
        (message)->shed_bits = (int32_t)result_->shed_bits;                                        \
        (message)->validity = (int32_t)result_->flags;                                             \
        (message)->first_row = (chunk)->first_row;                                                 \
        (message)->n_rows = (chunk)->end_row - (chunk)->first_row;                                 \
        (message)->n = (chunk)->n_bytes;                                                           \
        (message)->data = (encoder)->payload;                                                      \
    } while (0)

static enum shef_err emit_disparity(struct shef_encoder *encoder, const struct chunk *chunk)
{
    shef_disparity_t message;

    SET_VIEW(&message, encoder, chunk);
    message.n_points = chunk->n_points;
    message.unit_px = shef_disparity_unit_px(encoder->result->max_disparity_px);
    return shef_encoder_emit(
        encoder, SHEF_CHANNEL_DISPARITY,
        shef_disparity_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
        message.header.utime);
}

static enum shef_err emit_depth(struct shef_encoder *encoder, const struct chunk *chunk)
{
    shef_depth_t message;

    SET_VIEW(&message, encoder, chunk);
    message.n_points = chunk->n_points;
    message.unit_m = SHEF_DEPTH_UNIT_M;
    return shef_encoder_emit(
        encoder, SHEF_CHANNEL_DEPTH,
        shef_depth_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
        message.header.utime);
}

static enum shef_err emit_dense(struct shef_encoder *encoder, const struct chunk *chunk)
{
    shef_dense_t message;

    SET_VIEW(&message, encoder, chunk);
    message.n_filled = chunk->n_points;
    message.unit_px = shef_disparity_unit_px(encoder->result->max_disparity_px);
    return shef_encoder_emit(
        encoder, SHEF_CHANNEL_DENSE,
        shef_dense_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
        message.header.utime);
}

static uint32_t row_start(const struct grid *grid, int32_t row)
{
    return grid->row_start ? grid->row_start[row] : (uint32_t)(row * grid->row_cells);
}

static size_t row_bytes(const struct grid *grid, int32_t row)
{
    const size_t n_codes = row_start(grid, row + 1) - row_start(grid, row);

    return (grid->mask ? (size_t)grid->mask_bytes : 0) + n_codes * (grid->sigmas ? 3 : 2);
}

/* The first row that no longer fits into a chunk that begins at first. */
static int32_t chunk_end(const struct grid *grid, int32_t first, size_t room_bytes)
{
    size_t n_bytes = row_bytes(grid, first);
    int32_t end = first + 1;

    assert(n_bytes <= room_bytes);
    while (end < grid->n_rows && n_bytes + row_bytes(grid, end) <= room_bytes)
        n_bytes += row_bytes(grid, end++);
    return end;
}

static uint8_t *append(uint8_t *to, const void *from, size_t n_bytes)
{
    memcpy(to, from, n_bytes);
    return to + n_bytes;
}

/* Lays a chunk's rows out in encoder->payload. */
static void fill_payload(struct shef_encoder *encoder, const struct grid *grid, struct chunk *chunk)
{
    const uint32_t first = row_start(grid, chunk->first_row);
    const size_t n_codes = row_start(grid, chunk->end_row) - first;
    const size_t n_rows = (size_t)(chunk->end_row - chunk->first_row);
    uint8_t *to = encoder->payload;

    chunk->n_points = (int32_t)n_codes;
    if (grid->mask) {
        to = append(to, grid->mask + (ptrdiff_t)chunk->first_row * grid->mask_bytes,
                    n_rows * (size_t)grid->mask_bytes);
    } else {
        chunk->n_points = 0;
        for (size_t i = 0; i < n_codes; i++)
            chunk->n_points += grid->codes[first + i] != 0;
    }
    to = append(to, grid->codes + first, n_codes * sizeof *grid->codes);
    if (grid->sigmas)
        to = append(to, grid->sigmas + first, n_codes);
    chunk->n_bytes = (int32_t)(to - encoder->payload);
}

/* Cuts a grid into chunks and sends them.
 *   fixed_bytes  of such a message without data */
static enum shef_err emit_grid(struct shef_encoder *encoder, const struct grid *grid,
                               int fixed_bytes,
                               enum shef_err (*emit)(struct shef_encoder *encoder,
                                                     const struct chunk *chunk))
{
    const size_t room_bytes = (size_t)(SHEF_MESSAGE_MAX_BYTES - fixed_bytes);
    struct chunk chunk = { 0 };

    for (int32_t row = 0; row < grid->n_rows; row = chunk_end(grid, row, room_bytes))
        chunk.n_chunks++;
    for (; chunk.index < chunk.n_chunks; chunk.index++) {
        chunk.first_row = chunk.end_row;
        chunk.end_row = chunk_end(grid, chunk.first_row, room_bytes);
        fill_payload(encoder, grid, &chunk);

        const enum shef_err result = emit(encoder, &chunk);

        if (result)
            return result;
    }
    return SHEF_OK;
}

enum shef_err shef_encoder_disparity(struct shef_encoder *encoder)
{
    const struct shef_result *result = encoder->result;
    const struct shef_picks *picks = &encoder->picks;
    const float per_px = 1.0f / shef_disparity_unit_px(result->max_disparity_px);
    const uint32_t n_picks = picks->row_start[picks->grid_h];
    const struct grid grid = {
        .mask = picks->mask,
        .row_start = picks->row_start,
        .codes = encoder->codes,
        .n_rows = picks->grid_h,
        .row_cells = picks->grid_w,
        .mask_bytes = picks->mask_bytes,
    };

    for (uint32_t i = 0; i < n_picks; i++)
        encoder->codes[i] =
            shef_disparity_code(shef_encoder_at(result->disparity, picks->pixels[i]),
                                shef_encoder_at(result->confidence, picks->pixels[i]), per_px);
    return emit_grid(encoder, &grid, shef_disparity_t_encoded_size(&(shef_disparity_t){ .n = 0 }),
                     emit_disparity);
}

enum shef_err shef_encoder_depth(struct shef_encoder *encoder)
{
    const struct shef_result *result = encoder->result;
    const struct shef_picks *picks = &encoder->picks;
    const struct grid grid = {
        .mask = encoder->depth_mask,
        .row_start = encoder->depth_start,
        .codes = encoder->codes,
        .sigmas = encoder->sigmas,
        .n_rows = picks->grid_h,
        .row_cells = picks->grid_w,
        .mask_bytes = picks->mask_bytes,
    };
    uint32_t n_codes = 0;

    memcpy(encoder->depth_mask, picks->mask, (size_t)picks->grid_h * (size_t)picks->mask_bytes);
    for (int32_t gy = 0; gy < picks->grid_h; gy++) {
        uint8_t *mask = encoder->depth_mask + (ptrdiff_t)gy * picks->mask_bytes;

        encoder->depth_start[gy] = n_codes;
        for (uint32_t i = picks->row_start[gy]; i < picks->row_start[gy + 1]; i++) {
            const uint32_t pixel = picks->pixels[i];
            const uint16_t code = shef_depth_code(shef_encoder_at(result->depth_m, pixel));

            if (code) {
                encoder->codes[n_codes] = code;
                encoder->sigmas[n_codes++] =
                    shef_sigma_code(shef_encoder_at(result->sigma_m, pixel));
            } else {
                const uint32_t gx = pixel % (uint32_t)picks->width_px / (uint32_t)picks->grid_step;

                mask[gx / 8] &= (uint8_t) ~(1u << gx % 8);
            }
        }
    }
    encoder->depth_start[picks->grid_h] = n_codes;
    return emit_grid(encoder, &grid, shef_depth_t_encoded_size(&(shef_depth_t){ .n = 0 }),
                     emit_depth);
}

/* Of a cell, the upper left pixel: neighbours hardly differ, and nothing is to be chosen. */
enum shef_err shef_encoder_dense(struct shef_encoder *encoder)
{
    const struct shef_result *result = encoder->result;
    const struct shef_picks *picks = &encoder->picks;
    const float per_px = 1.0f / shef_disparity_unit_px(result->max_disparity_px);
    const struct grid grid = {
        .codes = encoder->codes,
        .n_rows = picks->grid_h,
        .row_cells = picks->grid_w,
    };
    uint16_t *code = encoder->codes;

    for (int32_t gy = 0; gy < picks->grid_h; gy++) {
        const float *disparity = shef_row_f32(result->dense_disparity, gy * picks->grid_step);
        const float *confidence = shef_row_f32(result->dense_confidence, gy * picks->grid_step);

        for (int32_t x = 0; x < picks->width_px; x += picks->grid_step)
            *code++ = shef_disparity_code(disparity[x], confidence[x], per_px);
    }
    return emit_grid(encoder, &grid, shef_dense_t_encoded_size(&(shef_dense_t){ .n = 0 }),
                     emit_dense);
}
