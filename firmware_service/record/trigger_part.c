#include "record/trigger_part.h"

#include <string.h>

#include "core/little_endian.h"

void shef_edge_encode(const struct shef_edge *edge, uint8_t out_bytes[SHEF_EDGE_BYTES])
{
    memset(out_bytes, 0, SHEF_EDGE_BYTES);
    shef_put_u64_le(out_bytes, (uint64_t)edge->time.ns);
    shef_put_u32_le(out_bytes + 8, edge->number);
    out_bytes[12] = edge->line;
    out_bytes[13] = edge->is_high;
}

struct shef_edge shef_edge_decode(const uint8_t bytes[SHEF_EDGE_BYTES])
{
    return (struct shef_edge){
        .time = { (int64_t)shef_get_u64_le(bytes) },
        .number = shef_get_u32_le(bytes + 8),
        .line = bytes[12],
        .is_high = bytes[13] != 0,
    };
}
