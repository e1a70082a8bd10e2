#include "shef_lcm_decode.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include <shef_cloud_t.h>
#include <shef_dense_t.h>
#include <shef_depth_t.h>
#include <shef_disparity_t.h>
#include <shef_pose_t.h>
#include <shef_status_t.h>

#define CRC_OFFSET  104
#define CLOUD_BYTES 16
#define MAX_SIDE_PX 16384
#define MAX_STEP    16

/* Reads a message from its front; past the end it gives zeros and remembers. */
struct reader {
    const uint8_t *next;
    size_t left;
    bool is_short;
};

static uint64_t take(struct reader *reader, size_t n_bytes)
{
    uint64_t value = 0;

    if (reader->left < n_bytes) {
        reader->is_short = true;
        reader->left = 0;
        return 0;
    }
    for (size_t i = 0; i < n_bytes; i++)
        value = value << 8 | reader->next[i];
    reader->next += n_bytes;
    reader->left -= n_bytes;
    return value;
}

static int64_t take_i64(struct reader *reader)
{
    return (int64_t)take(reader, 8);
}

static int32_t take_i32(struct reader *reader)
{
    return (int32_t)(uint32_t)take(reader, 4);
}

static double take_double(struct reader *reader)
{
    const uint64_t bits = take(reader, 8);
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

static float take_float(struct reader *reader)
{
    const uint32_t bits = (uint32_t)take(reader, 4);
    float value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

/* CRC-32C, four bits at a time: small, and fast enough for a few datagrams a frame. */
static uint32_t crc32c(uint32_t crc, const uint8_t *bytes, size_t n_bytes)
{
    static const uint32_t table[16] = {
        0x00000000, 0x105ec76f, 0x20bd8ede, 0x30e349b1, 0x417b1dbc, 0x5125dad3,
        0x61c69362, 0x7198540d, 0x82f63b78, 0x92a8fc17, 0xa24bb5a6, 0xb21572c9,
        0xc38d26c4, 0xd3d3e1ab, 0xe330a81a, 0xf36e6f75,
    };

    for (size_t i = 0; i < n_bytes; i++) {
        crc ^= bytes[i];
        crc = crc >> 4 ^ table[crc & 15];
        crc = crc >> 4 ^ table[crc & 15];
    }
    return crc;
}

const char *shef_lcm_result_text(enum shef_lcm_result result)
{
    switch (result) {
    case SHEF_LCM_OK:
        return "fine";
    case SHEF_LCM_WRONG_TYPE:
        return "another message, or one of another version";
    case SHEF_LCM_WRONG_SIZE:
        return "cut short, or with bytes left over";
    case SHEF_LCM_WRONG_CRC:
        return "damaged on the way";
    case SHEF_LCM_WRONG_DATA:
        return "says things that cannot be";
    }
    return "unknown";
}

/* Checks type and checksum and reads the header. */
static enum shef_lcm_result begin(struct reader *reader, const void *message, size_t n_bytes,
                                  int64_t type, struct shef_lcm_header *header)
{
    const uint8_t *bytes = message;

    *reader = (struct reader){ .next = bytes, .left = n_bytes };
    if (n_bytes < 8)
        return SHEF_LCM_WRONG_SIZE;
    if (take_i64(reader) != type)
        return SHEF_LCM_WRONG_TYPE;
    if (n_bytes < CRC_OFFSET + 4)
        return SHEF_LCM_WRONG_SIZE;

    static const uint8_t zeros[4];
    uint32_t crc = crc32c(UINT32_MAX, bytes, CRC_OFFSET);

    crc = crc32c(crc, zeros, sizeof zeros);
    crc = ~crc32c(crc, bytes + CRC_OFFSET + 4, n_bytes - CRC_OFFSET - 4);

    header->utime_us = take_i64(reader);
    header->mono_ns = take_i64(reader);
    header->event_us = take_i64(reader);
    header->utc_minus_mono_ns = take_i64(reader);
    header->t_err_ns = take_i64(reader);
    header->seq = take_i64(reader);
    header->session_id = take_i64(reader);
    for (int i = 0; i < 32; i++)
        header->calib_id[i] = (uint8_t)take(reader, 1);
    header->chunk = take_i32(reader);
    header->n_chunks = take_i32(reader);
    if ((uint32_t)take_i32(reader) != crc)
        return SHEF_LCM_WRONG_CRC;
    return header->chunk >= 0 && header->chunk < header->n_chunks ? SHEF_LCM_OK
                                                                  : SHEF_LCM_WRONG_DATA;
}

/* Reads the size of data and checks that it is what is left. */
static enum shef_lcm_result begin_data(struct reader *reader, int64_t expected_bytes)
{
    const int32_t n_bytes = take_i32(reader);

    if (reader->is_short)
        return SHEF_LCM_WRONG_SIZE;
    if (n_bytes != expected_bytes)
        return SHEF_LCM_WRONG_DATA;
    return (int64_t)reader->left == expected_bytes ? SHEF_LCM_OK : SHEF_LCM_WRONG_SIZE;
}

/* 1s in a mask; -1 if there are any in a row's padding. */
static int64_t count_mask(const struct shef_lcm_grid *grid, int32_t mask_bytes)
{
    const int32_t used_bits = (grid->grid_w - 1) % 8 + 1;
    int64_t n_points = 0;

    for (int32_t y = 0; y < grid->n_rows; y++) {
        const uint8_t *row = grid->mask + (ptrdiff_t)y * mask_bytes;

        for (int32_t i = 0; i < mask_bytes; i++)
            n_points += __builtin_popcount(row[i]);
        if (row[mask_bytes - 1] >> used_bits)
            return -1;
    }
    return n_points;
}

static bool has_sane_view(const struct shef_lcm_grid *grid)
{
    return grid->width_px >= 1 && grid->width_px <= MAX_SIDE_PX && grid->height_px >= 1 &&
           grid->height_px <= MAX_SIDE_PX && grid->grid_step >= 1 && grid->grid_step <= MAX_STEP &&
           isfinite(grid->f_px) && grid->f_px > 0.0 && isfinite(grid->cx_px) &&
           isfinite(grid->cy_px) && isfinite(grid->baseline_m) && isfinite(grid->unit) &&
           grid->unit > 0.0f;
}

static enum shef_lcm_result decode_grid(const void *message, size_t n_bytes, int64_t type,
                                        bool has_mask, bool has_sigmas,
                                        struct shef_lcm_grid *out_grid)
{
    struct shef_lcm_grid grid;
    struct reader reader;
    enum shef_lcm_result result = begin(&reader, message, n_bytes, type, &grid.header);

    if (result)
        return result;
    grid.width_px = take_i32(&reader);
    grid.height_px = take_i32(&reader);
    grid.grid_step = take_i32(&reader);
    grid.f_px = take_double(&reader);
    grid.cx_px = take_double(&reader);
    grid.cy_px = take_double(&reader);
    grid.baseline_m = take_double(&reader);
    grid.mode = take_i32(&reader);
    grid.shed_bits = take_i32(&reader);
    grid.validity = take_i32(&reader);
    grid.first_row = take_i32(&reader);
    grid.n_rows = take_i32(&reader);
    grid.unit = take_float(&reader);
    grid.n_points = take_i32(&reader);
    if (reader.is_short)
        return SHEF_LCM_WRONG_SIZE;
    if (!has_sane_view(&grid))
        return SHEF_LCM_WRONG_DATA;
    grid.grid_w = (grid.width_px + grid.grid_step - 1) / grid.grid_step;
    grid.grid_h = (grid.height_px + grid.grid_step - 1) / grid.grid_step;
    if (grid.first_row < 0 || grid.n_rows < 1 || grid.n_rows > grid.grid_h - grid.first_row ||
        grid.n_points < 0 || grid.n_points > (int64_t)grid.n_rows * grid.grid_w)
        return SHEF_LCM_WRONG_DATA;

    const int32_t mask_bytes = has_mask ? (grid.grid_w + 7) / 8 : 0;
    const int64_t n_values = has_mask ? grid.n_points : (int64_t)grid.n_rows * grid.grid_w;

    result =
        begin_data(&reader, (int64_t)grid.n_rows * mask_bytes + n_values * (has_sigmas ? 3 : 2));
    if (result)
        return result;
    grid.mask = has_mask ? reader.next : NULL;
    grid.values = reader.next + (ptrdiff_t)grid.n_rows * mask_bytes;
    grid.sigmas = has_sigmas ? grid.values + 2 * n_values : NULL;
    if (has_mask && count_mask(&grid, mask_bytes) != grid.n_points)
        return SHEF_LCM_WRONG_DATA;
    *out_grid = grid;
    return SHEF_LCM_OK;
}

enum shef_lcm_result shef_lcm_decode_disparity(const void *message, size_t n_bytes,
                                               struct shef_lcm_grid *out_grid)
{
    return decode_grid(message, n_bytes, __shef_disparity_t_get_hash(), true, false, out_grid);
}

enum shef_lcm_result shef_lcm_decode_depth(const void *message, size_t n_bytes,
                                           struct shef_lcm_grid *out_grid)
{
    return decode_grid(message, n_bytes, __shef_depth_t_get_hash(), true, true, out_grid);
}

enum shef_lcm_result shef_lcm_decode_dense(const void *message, size_t n_bytes,
                                           struct shef_lcm_grid *out_grid)
{
    return decode_grid(message, n_bytes, __shef_dense_t_get_hash(), false, false, out_grid);
}

static float sigma_of(uint8_t code, float unit)
{
    return ldexpf(unit * (1.0f + (float)(code & 15) / 16.0f), code >> 4);
}

void shef_lcm_grid_images(const struct shef_lcm_grid *grid, float *first, float *second)
{
    const int32_t mask_bytes = (grid->grid_w + 7) / 8;
    size_t n = 0; /* values used up */

    for (int32_t y = 0; y < grid->n_rows; y++) {
        for (int32_t x = 0; x < grid->grid_w; x++) {
            const ptrdiff_t cell = (ptrdiff_t)(grid->first_row + y) * grid->grid_w + x;
            float a = 0.0f, b = 0.0f;

            if (!grid->mask || grid->mask[(ptrdiff_t)y * mask_bytes + x / 8] >> x % 8 & 1) {
                const uint32_t code = grid->values[2 * n] | (uint32_t)grid->values[2 * n + 1] << 8;

                a = (float)(grid->sigmas ? code : code & 0xfff) * grid->unit;
                b = grid->sigmas ? sigma_of(grid->sigmas[n], grid->unit)
                                 : (float)(code >> 12) / 15.0f;
                n++;
            }
            first[cell] = a;
            if (second)
                second[cell] = b;
        }
    }
}

double shef_lcm_grid_pixel(const struct shef_lcm_grid *grid, int32_t cell)
{
    return cell * (double)grid->grid_step + (grid->grid_step - 1) / 2.0;
}

enum shef_lcm_result shef_lcm_decode_cloud(const void *message, size_t n_bytes,
                                           struct shef_lcm_cloud *out_cloud)
{
    struct shef_lcm_cloud cloud;
    struct reader reader;
    enum shef_lcm_result result =
        begin(&reader, message, n_bytes, __shef_cloud_t_get_hash(), &cloud.header);

    if (result)
        return result;
    cloud.mode = take_i32(&reader);
    cloud.shed_bits = take_i32(&reader);
    cloud.validity = take_i32(&reader);
    cloud.first_point = take_i32(&reader);
    cloud.n_points = take_i32(&reader);
    if (reader.is_short)
        return SHEF_LCM_WRONG_SIZE;
    if (cloud.first_point < 0 || cloud.n_points < 0)
        return SHEF_LCM_WRONG_DATA;
    result = begin_data(&reader, (int64_t)cloud.n_points * CLOUD_BYTES);
    if (result)
        return result;
    cloud.points = reader.next;
    *out_cloud = cloud;
    return SHEF_LCM_OK;
}

static float float_le(const uint8_t *bytes)
{
    const uint32_t bits =
        bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
    float value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

struct shef_lcm_point shef_lcm_cloud_point(const struct shef_lcm_cloud *cloud, int32_t i)
{
    const uint8_t *bytes = cloud->points + (ptrdiff_t)i * CLOUD_BYTES;

    return (struct shef_lcm_point){
        .x_m = float_le(bytes),
        .y_m = float_le(bytes + 4),
        .z_m = float_le(bytes + 8),
        .grey = bytes[12],
        .confidence = (float)bytes[13] / 255.0f,
        .sigma_m = (float)(bytes[14] | bytes[15] << 8) / 1000.0f,
    };
}

enum shef_lcm_result shef_lcm_decode_pose(const void *message, size_t n_bytes,
                                          struct shef_lcm_pose *out_pose)
{
    struct shef_lcm_pose pose;
    struct reader reader;
    const enum shef_lcm_result result =
        begin(&reader, message, n_bytes, __shef_pose_t_get_hash(), &pose.header);

    if (result)
        return result;
    pose.validity = take_i32(&reader);
    for (int i = 0; i < 3; i++)
        pose.pos_m[i] = take_double(&reader);
    for (int i = 0; i < 4; i++)
        pose.orientation_wxyz[i] = take_double(&reader);
    for (int i = 0; i < 36; i++)
        pose.covariance[i] = take_double(&reader);
    if (reader.is_short || reader.left > 0)
        return SHEF_LCM_WRONG_SIZE;
    *out_pose = pose;
    return SHEF_LCM_OK;
}

enum shef_lcm_result shef_lcm_decode_status(const void *message, size_t n_bytes,
                                            struct shef_lcm_status *out_status)
{
    struct shef_lcm_status status;
    struct reader reader;
    const enum shef_lcm_result result =
        begin(&reader, message, n_bytes, __shef_status_t_get_hash(), &status.header);

    if (result)
        return result;

    const int32_t text_bytes = take_i32(&reader); /* its end counts */

    if (reader.is_short || text_bytes < 1 || (size_t)text_bytes > reader.left)
        return SHEF_LCM_WRONG_SIZE;
    status.state = (const char *)reader.next;
    if (memchr(status.state, '\0', (size_t)text_bytes) != status.state + text_bytes - 1)
        return SHEF_LCM_WRONG_DATA;
    reader.next += text_bytes;
    reader.left -= (size_t)text_bytes;
    status.mode = take_i32(&reader);
    status.shed_bits = take_i32(&reader);
    status.n_events = take_i64(&reader);
    status.n_frames = take_i64(&reader);
    status.n_published = take_i64(&reader);
    status.n_shed = take_i64(&reader);
    status.n_unmatched = take_i64(&reader);
    status.n_unpublished = take_i64(&reader);
    status.n_damaged = take_i64(&reader);
    status.events_per_s = take_float(&reader);
    status.frames_per_s = take_float(&reader);
    status.cpu_cores = take_float(&reader);
    status.memory_mib = take_i32(&reader);
    status.backlog = take_i32(&reader);
    status.complete_to_published_p50_ns = take_i64(&reader);
    status.complete_to_published_p99_ns = take_i64(&reader);
    status.mid_to_published_p50_ns = take_i64(&reader);
    status.mid_to_published_p99_ns = take_i64(&reader);
    if (reader.is_short || reader.left > 0)
        return SHEF_LCM_WRONG_SIZE;
    *out_status = status;
    return SHEF_LCM_OK;
}
