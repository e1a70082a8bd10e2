/* The header of RAW event files, of both generations.
 *
 * Until about 2021 a file said "% evt 2.0" and often not the sensor's size; later ones say
 * "% format EVT3;height=720;width=1280" and close with "% end". Both are read, and both are
 * written so that readers of either generation find what they look for. */
#ifndef SHEF_CODECS_RAW_HEADER_H
#define SHEF_CODECS_RAW_HEADER_H

#include "codecs/evt.h"
#include "codecs/text_header.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_raw_size {
    SHEF_RAW_SIZE_GIVEN,
    SHEF_RAW_SIZE_OF_SYSTEM, /* not given, but system_ID names a known camera */
    SHEF_RAW_SIZE_UNKNOWN,   /* not given: 2048 x 2048, the format's own limit */
    SHEF_RAW_SIZE_ABSURD,    /* given, but impossible: the same limit */
};

struct shef_raw_header {
    enum shef_evt_format format;
    enum shef_raw_size size;
    uint32_t width_px; /* 1..2048 */
    uint32_t height_px;
    int32_t system_id; /* -1: not given */
    bool has_end;      /* "% end" */
    size_t n_bytes;    /* the first byte of events */
    /* As written; "" where missing. */
    char size_text[SHEF_TEXT_VALUE_BYTES]; /* what SHEF_RAW_SIZE_ABSURD is about */
    char date[SHEF_TEXT_VALUE_BYTES];      /* YYYY-MM-DD HH:MM:SS */
    char serial[SHEF_TEXT_VALUE_BYTES];
    char integrator[SHEF_TEXT_VALUE_BYTES];
    char plugin[SHEF_TEXT_VALUE_BYTES];
    char sensor[SHEF_TEXT_VALUE_BYTES];
};

/* Parses the front of a file.
 *   bytes  the first SHEF_TEXT_HEADER_MAX_BYTES of the file, or all if it is shorter
 * SHEF_ERR_FORMAT: not a RAW file, or one that does not say its format or ends in its header.
 * SHEF_ERR_UNSUPPORTED: a format that is not EVT2, EVT2.1 or EVT3. */
SHEF_MUST_CHECK enum shef_err shef_raw_header_parse(const uint8_t *bytes, size_t n_bytes,
                                                    struct shef_raw_header *out_header,
                                                    struct shef_error *err);

enum shef_raw_generation {
    SHEF_RAW_OLD, /* date, evt, system_ID */
    SHEF_RAW_NEW, /* format, geometry, integrators; and what the old ones had */
};

#define SHEF_RAW_HEADER_BYTES 2048

/* Writes a header; empty texts and unknown numbers are left out, and what readers insist on gets
 * a default. The text always ends with "% end", so that events cannot be taken for a line.
 * Returns its length in out_text, without the final 0. */
size_t shef_raw_header_write(const struct shef_raw_header *header,
                             enum shef_raw_generation generation,
                             char out_text[SHEF_RAW_HEADER_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
