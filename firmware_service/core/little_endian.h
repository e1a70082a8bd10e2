/* Numbers in files: little-endian, at any address. Thread: any. */
#ifndef SHEF_CORE_LITTLE_ENDIAN_H
#define SHEF_CORE_LITTLE_ENDIAN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

static inline void shef_put_u32_le(uint8_t *bytes, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(value >> 8 * i);
}

static inline void shef_put_u64_le(uint8_t *bytes, uint64_t value)
{
    shef_put_u32_le(bytes, (uint32_t)value);
    shef_put_u32_le(bytes + 4, (uint32_t)(value >> 32));
}

static inline uint32_t shef_get_u32_le(const uint8_t *bytes)
{
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline uint64_t shef_get_u64_le(const uint8_t *bytes)
{
    return shef_get_u32_le(bytes) | (uint64_t)shef_get_u32_le(bytes + 4) << 32;
}

#ifdef __cplusplus
}
#endif

#endif
