/* DAT event files: change events (`log_td.dat`, `*_td.dat`, `*_cd.dat`) and triggers
 * (`*_trigger.dat`), one 8-byte record each, little-endian.
 *
 *   events     u32 t in us, u32 x 13:0, y 27:14, polarity 31:28
 *   version 1  u32 t in us, u32 x  8:0, y 16:9,  polarity 17       (304 x 240 sensors)
 *   triggers   u32 t in us, u32 edge 3:0, channel 31:26
 *
 * Time is 32 bits and wraps after 71.6 min; it is counted on in 64. Thread: one per object. */
#ifndef SHEF_CODECS_DAT_H
#define SHEF_CODECS_DAT_H

#include "codecs/evt.h"
#include "codecs/text_header.h"
#include "core/error.h"
#include "core/packets.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_dat_content {
    SHEF_DAT_EVENTS,
    SHEF_DAT_TRIGGERS,
};

#define SHEF_DAT_MAX_SIDE_PX 16384 /* 14 bits */

struct shef_dat_header {
    enum shef_dat_content content;
    uint32_t version;  /* of the records: 1 or 2 */
    bool has_size;     /* given, and possible */
    bool absurd_size;  /* given, and impossible */
    uint32_t width_px; /* 1..16384; all that records can say where the size is not known */
    uint32_t height_px;
    size_t n_bytes; /* where the records start */
    char date[SHEF_TEXT_VALUE_BYTES];
};

/* Parses the front of a file.
 *   bytes  the first SHEF_TEXT_HEADER_MAX_BYTES of the file, or all if it is shorter
 * A file without a header is taken for version 2 events if its first records make sense.
 * SHEF_ERR_FORMAT: no DAT file, or one that ends in its header.
 * SHEF_ERR_UNSUPPORTED: records of another kind. */
SHEF_MUST_CHECK enum shef_err shef_dat_header_parse(const uint8_t *bytes, size_t n_bytes,
                                                    struct shef_dat_header *out_header,
                                                    struct shef_error *err);

#define SHEF_DAT_HEADER_BYTES 512

/* Writes a header for version 2 records. Returns its length. */
size_t shef_dat_header_write(const struct shef_dat_header *header,
                             uint8_t out_bytes[SHEF_DAT_HEADER_BYTES]);

/* Fields are the decoder's own but for stats. */
struct shef_dat_decoder {
    /* Set by init. */
    struct shef_dat_header header;
    /* Set by decode. */
    int64_t epoch_us; /* multiples of 2^32 us so far */
    uint32_t last_us; /* the last record's time */
    bool started;
    uint8_t n_carried;
    uint8_t carried[8];
    struct shef_evt_stats stats; /* words are records */
};

void shef_dat_init(struct shef_dat_decoder *decoder, const struct shef_dat_header *header);

/* Decodes the records behind the header. The same rules as shef_evt_decode(): any slices, and
 * fewer bytes taken than given where the batch must be used first. */
SHEF_MUST_CHECK size_t shef_dat_decode(struct shef_dat_decoder *decoder, const uint8_t *bytes,
                                       size_t n_bytes, struct shef_event_batch *batch);

/* Ends the file. Returns how many bytes of a cut record had come. */
uint32_t shef_dat_finish(struct shef_dat_decoder *decoder);

/* Writes all events (triggers: all triggers) of a batch as version 2 records.
 *   out_bytes  8 for each of them
 * Returns the number of bytes. */
size_t shef_dat_encode(enum shef_dat_content content, const struct shef_event_batch *batch,
                       uint8_t *out_bytes);

#ifdef __cplusplus
}
#endif

#endif
