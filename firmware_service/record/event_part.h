/* What the writer and the readers of the event part agree on. Thread: any. */
#ifndef SHEF_RECORD_EVENT_PART_H
#define SHEF_RECORD_EVENT_PART_H

#include <stdbool.h>
#include <stdint.h>

#include "codecs/evt.h"
#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_EVENT_FOLDER "events"
#define SHEF_EVENT_ENDING ".raw"

/* What drivers ask the sensor for at once; larger buffers become several blocks. */
#define SHEF_EVENT_BLOCK_MAX_BYTES (128u << 10)

/* How to decode the blocks: the part's own bytes in the index header. */
struct shef_event_part {
    enum shef_evt_format format;
    uint32_t width_px; /* 1..2048 */
    uint32_t height_px;
};

void shef_event_part_encode(const struct shef_event_part *part,
                            uint8_t out_info[SHEF_PART_INFO_BYTES]);

/* Returns false if the format or the size is impossible. */
bool shef_event_part_decode(const uint8_t info[SHEF_PART_INFO_BYTES],
                            struct shef_event_part *out_part);

#ifdef __cplusplus
}
#endif

#endif
