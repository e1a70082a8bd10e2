#include "record/frame_part.h"

#include <string.h>

#include "core/little_endian.h"

enum state_field {
    STATE_NUMBER = 0,
    STATE_TIME = 8,
    STATE_EXPOSURE = 16,
    STATE_GAIN = 20,
    STATE_WIDTH = 24,
    STATE_HEIGHT = 28,
    STATE_ROW_BYTES = 32,
    STATE_FORMAT = 36,
    STATE_CODING = 40,
    STATE_LENGTH = 44,
    STATE_STATUS = 48,
};

static uint32_t bits_of(uint32_t pixel_format)
{
    return pixel_format >> 16 & 0xff;
}

static bool is_size(uint32_t width_px, uint32_t height_px, uint32_t pixel_format)
{
    return width_px >= 1 && width_px <= SHEF_FRAME_MAX_SIDE_PX && height_px >= 1 &&
           height_px <= SHEF_FRAME_MAX_SIDE_PX && bits_of(pixel_format) >= 1 &&
           bits_of(pixel_format) <= 64;
}

uint32_t shef_frame_bytes(const struct shef_frame_info *info)
{
    if (!is_size(info->width_px, info->height_px, info->pixel_format) ||
        info->row_bytes > SHEF_FRAME_MAX_BYTES ||
        (uint64_t)info->row_bytes * 8 < (uint64_t)info->width_px * bits_of(info->pixel_format) ||
        (uint64_t)info->row_bytes * info->height_px > SHEF_FRAME_MAX_BYTES)
        return 0;
    return info->row_bytes * info->height_px;
}

bool shef_frame_is_usable(const struct shef_frame_info *info, const struct shef_frame_part *part)
{
    return info->status == 0 && info->width_px == part->width_px &&
           info->height_px == part->height_px && info->pixel_format == part->pixel_format;
}

void shef_frame_part_encode(const struct shef_frame_part *part,
                            uint8_t out_info[SHEF_PART_INFO_BYTES])
{
    memset(out_info, 0, SHEF_PART_INFO_BYTES);
    shef_put_u32_le(out_info, part->width_px);
    shef_put_u32_le(out_info + 4, part->height_px);
    shef_put_u32_le(out_info + 8, part->pixel_format);
}

bool shef_frame_part_decode(const uint8_t info[SHEF_PART_INFO_BYTES],
                            struct shef_frame_part *out_part)
{
    const struct shef_frame_part part = {
        .width_px = shef_get_u32_le(info),
        .height_px = shef_get_u32_le(info + 4),
        .pixel_format = shef_get_u32_le(info + 8),
    };

    if (!is_size(part.width_px, part.height_px, part.pixel_format))
        return false;
    *out_part = part;
    return true;
}

void shef_frame_state_encode(const struct shef_frame_info *info, enum shef_frame_coding coding,
                             uint8_t out_state[SHEF_BLOCK_STATE_BYTES])
{
    memset(out_state, 0, SHEF_BLOCK_STATE_BYTES);
    shef_put_u64_le(out_state + STATE_NUMBER, info->number);
    shef_put_u64_le(out_state + STATE_TIME, (uint64_t)info->time.ns);
    shef_put_u32_le(out_state + STATE_EXPOSURE, info->exposure_us);
    shef_put_u32_le(out_state + STATE_GAIN, info->gain_mdb);
    shef_put_u32_le(out_state + STATE_WIDTH, info->width_px);
    shef_put_u32_le(out_state + STATE_HEIGHT, info->height_px);
    shef_put_u32_le(out_state + STATE_ROW_BYTES, info->row_bytes);
    shef_put_u32_le(out_state + STATE_FORMAT, info->pixel_format);
    shef_put_u32_le(out_state + STATE_CODING, coding);
    shef_put_u32_le(out_state + STATE_LENGTH, shef_frame_bytes(info));
    shef_put_u32_le(out_state + STATE_STATUS, info->status);
}

bool shef_frame_state_decode(const struct shef_block_record *record,
                             struct shef_frame_info *out_info, enum shef_frame_coding *out_coding)
{
    const uint8_t *state = record->state;
    const uint32_t coding = shef_get_u32_le(state + STATE_CODING);
    const struct shef_frame_info info = {
        .number = shef_get_u64_le(state + STATE_NUMBER),
        .time = { (int64_t)shef_get_u64_le(state + STATE_TIME) },
        .arrived = record->arrived,
        .exposure_us = shef_get_u32_le(state + STATE_EXPOSURE),
        .gain_mdb = shef_get_u32_le(state + STATE_GAIN),
        .width_px = shef_get_u32_le(state + STATE_WIDTH),
        .height_px = shef_get_u32_le(state + STATE_HEIGHT),
        .row_bytes = shef_get_u32_le(state + STATE_ROW_BYTES),
        .pixel_format = shef_get_u32_le(state + STATE_FORMAT),
        .status = shef_get_u32_le(state + STATE_STATUS),
    };
    const uint32_t n_bytes = shef_frame_bytes(&info);

    if (n_bytes == 0 || n_bytes != shef_get_u32_le(state + STATE_LENGTH) ||
        coding >= SHEF_FRAME_CODINGS || (coding == SHEF_FRAME_RAW && record->n_bytes != n_bytes))
        return false;
    *out_info = info;
    *out_coding = (enum shef_frame_coding)coding;
    return true;
}
