/* The words of the EVT formats, as decoders, encoders and kernels see them.
 *
 *   EVT2    32 bits  type 31:28, time 27:22, x 21:11, y 10:0
 *   EVT2.1  64 bits  type 63:60, time 59:54, x 53:43, y 42:32, valid mask 31:0 (bit i: x + i)
 *   EVT3    16 bits  type 15:12, value 11:0
 *
 * All little-endian on the wire; "legacy" EVT2.1 sends the upper half of a word first. */
#ifndef SHEF_CODECS_EVT_WORD_H
#define SHEF_CODECS_EVT_WORD_H

#include <stdint.h>
#include <string.h>

#include "codecs/evt.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the codecs read and write little-endian words as they lie in memory"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* EVT2 and EVT2.1: the upper four bits. */
enum shef_evt2_type {
    SHEF_EVT2_OFF = 0x0,
    SHEF_EVT2_ON = 0x1,
    SHEF_EVT2_TIME_HIGH = 0x8,
    SHEF_EVT2_TRIGGER = 0xa,
    SHEF_EVT2_IMU = 0xd,
    SHEF_EVT2_OTHER = 0xe,
    SHEF_EVT2_CONTINUED = 0xf,
};

enum shef_evt3_type {
    SHEF_EVT3_ROW = 0x0,         /* ADDR_Y: y 10:0; bit 11 names the camera of a wired pair */
    SHEF_EVT3_FOREIGN_ROW = 0x1, /* a row whose events are not change events */
    SHEF_EVT3_EVENT = 0x2,       /* ADDR_X: x 10:0, polarity 11 */
    SHEF_EVT3_BASE = 0x3,        /* VECT_BASE_X: x 10:0, polarity 11 */
    SHEF_EVT3_VECTOR_12 = 0x4,
    SHEF_EVT3_VECTOR_8 = 0x5,
    SHEF_EVT3_TIME_LOW = 0x6,
    SHEF_EVT3_CONTINUED_4 = 0x7,
    SHEF_EVT3_TIME_HIGH = 0x8,
    SHEF_EVT3_PADDING = 0x9, /* 0x9999, sent by some boards to fill a transfer */
    SHEF_EVT3_TRIGGER = 0xa, /* channel 11:8, edge 0 */
    SHEF_EVT3_IMU = 0xd,
    SHEF_EVT3_OTHER = 0xe,
    SHEF_EVT3_CONTINUED_12 = 0xf,
};

#define SHEF_EVT2_LOW_BITS    6
#define SHEF_EVT2_HIGH_BITS   28
#define SHEF_EVT3_LOW_BITS    12
#define SHEF_EVT3_HIGH_BITS   12
#define SHEF_EVT_MAX_SIDE_PX  2048 /* 11 bits */
#define SHEF_EVT3_GROUP_WORDS 3    /* VECT_12, VECT_12, VECT_8: 32 pixels, as sensors send them */

static inline uint16_t shef_load_u16(const uint8_t *bytes)
{
    uint16_t value;

    memcpy(&value, bytes, sizeof value);
    return value;
}

static inline uint32_t shef_load_u32(const uint8_t *bytes)
{
    uint32_t value;

    memcpy(&value, bytes, sizeof value);
    return value;
}

static inline uint64_t shef_load_u64(const uint8_t *bytes)
{
    uint64_t value;

    memcpy(&value, bytes, sizeof value);
    return value;
}

/* Exchanges the halves of a word where the format sends the upper one first. */
static inline uint64_t shef_evt21_order(uint64_t word, bool upper_first)
{
    return upper_first ? word << 32 | word >> 32 : word;
}

/* Whether a word can stand in a stream, by its type and that of the word before it. */
static inline bool shef_evt2_is_known(uint32_t type, uint32_t last_type)
{
    /* A continuation follows what it continues. */
    if (type == SHEF_EVT2_CONTINUED)
        return last_type >= SHEF_EVT2_IMU;
    return type <= SHEF_EVT2_ON || type == SHEF_EVT2_TIME_HIGH || type == SHEF_EVT2_TRIGGER ||
           type == SHEF_EVT2_IMU || type == SHEF_EVT2_OTHER;
}

static inline bool shef_evt21_is_known(uint32_t type)
{
    return type <= SHEF_EVT2_ON || type == SHEF_EVT2_TIME_HIGH || type == SHEF_EVT2_TRIGGER ||
           type == SHEF_EVT2_OTHER;
}

static inline bool shef_evt3_is_known(uint32_t word, uint32_t last_type)
{
    const uint32_t type = word >> 12;

    if (type == SHEF_EVT3_CONTINUED_4 || type == SHEF_EVT3_CONTINUED_12)
        return last_type >= SHEF_EVT3_IMU;
    return type <= SHEF_EVT3_TIME_LOW || type == SHEF_EVT3_TIME_HIGH || word == 0x9999 ||
           type == SHEF_EVT3_TRIGGER || type == SHEF_EVT3_IMU || type == SHEF_EVT3_OTHER;
}

/* Bytes of one word. */
static inline uint32_t shef_evt_word_bytes(enum shef_evt_format format)
{
    return format == SHEF_EVT2 ? 4 : format == SHEF_EVT3 ? 2 : 8;
}

#ifdef __cplusplus
}
#endif

#endif
