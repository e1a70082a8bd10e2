#include "record/event_part.h"

#include <string.h>

#include "codecs/evt_word.h"

/* Little-endian: u32 format, u32 width, u32 height; the rest is zero. */

static void put_u32(uint8_t *bytes, uint32_t value)
{
    memcpy(bytes, &value, sizeof value);
}

void shef_event_part_encode(const struct shef_event_part *part,
                            uint8_t out_info[SHEF_PART_INFO_BYTES])
{
    memset(out_info, 0, SHEF_PART_INFO_BYTES);
    put_u32(out_info, part->format);
    put_u32(out_info + 4, part->width_px);
    put_u32(out_info + 8, part->height_px);
}

bool shef_event_part_decode(const uint8_t info[SHEF_PART_INFO_BYTES],
                            struct shef_event_part *out_part)
{
    const uint32_t format = shef_load_u32(info);
    const uint32_t width_px = shef_load_u32(info + 4);
    const uint32_t height_px = shef_load_u32(info + 8);

    if (format >= SHEF_EVT_FORMATS || width_px < 1 || width_px > SHEF_EVT_MAX_SIDE_PX ||
        height_px < 1 || height_px > SHEF_EVT_MAX_SIDE_PX)
        return false;
    *out_part = (struct shef_event_part){ (enum shef_evt_format)format, width_px, height_px };
    return true;
}
