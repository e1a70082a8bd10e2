/* Decoder for the sensors' event streams: EVT2, EVT2.1 (both word orders) and EVT3.
 *
 * A pure state machine: bytes in, batches of events out. Slices may have any size and end
 * anywhere, also in the middle of a word; the events are the same for every way of slicing.
 * Nothing is allocated and nothing is read twice. What breaks the format's rules is counted by
 * class and decoding goes on; where words have lost their alignment, the decoder finds it again.
 * Thread: one at a time per decoder. */
#ifndef SHEF_CODECS_EVT_H
#define SHEF_CODECS_EVT_H

#include <stddef.h>
#include <stdint.h>

#include "codecs/evt_clock.h"
#include "codecs/evt_sync.h"
#include "core/error.h"
#include "core/packets.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_evt_format {
    SHEF_EVT2,
    SHEF_EVT21,        /* plain little-endian 64-bit words */
    SHEF_EVT21_LEGACY, /* the upper 32 bits first */
    SHEF_EVT3,
    SHEF_EVT_FORMATS,
};

/* What breaks the rules. Events and triggers of the classes marked "dropped" do not come out. */
enum shef_evt_violation {
    SHEF_EVT_TIME_BACK,    /* a time before the one before it; kept if time went on from there */
    SHEF_EVT_TIME_GAP,     /* time jumped ahead in a stream that never jumps: data was lost */
    SHEF_EVT_NO_TIME,      /* before the first TIME_HIGH, or after a doubtful one; dropped */
    SHEF_EVT_NO_ROW,       /* EVT3: an event or vector before any ADDR_Y; dropped */
    SHEF_EVT_OUTSIDE,      /* coordinates outside the sensor; dropped */
    SHEF_EVT_BAD_VECTOR,   /* EVT3: a group not of 12 + 12 + 8, or without its base; the latter
                            * dropped */
    SHEF_EVT_UNKNOWN_WORD, /* a type that the format does not have, or a stray continuation */
    SHEF_EVT_CUT_WORD,     /* the stream ended in the middle of a word */
    SHEF_EVT_VIOLATIONS,
};

struct shef_evt_stats {
    uint64_t n_bytes; /* taken */
    uint64_t n_words; /* whole and aligned */
    uint64_t n_events;
    uint64_t n_triggers;
    uint64_t n_violations[SHEF_EVT_VIOLATIONS];
    uint64_t n_resyncs;       /* how often the alignment of words was found again */
    uint64_t n_bytes_skipped; /* while it was lost */
    uint64_t n_wraps;         /* of the stream's own time counter */
};

struct shef_evt_kernels;

/* Fields are the decoder's own but for stats. */
struct shef_evt_decoder {
    /* Set by init. */
    enum shef_evt_format format;
    uint32_t width_px;
    uint32_t height_px;
    const struct shef_evt_kernels *kernels;
    uint32_t n_silence_max; /* words of a sensor without a TIME_HIGH */
    /* Set by decode. */
    struct shef_evt_clock clock;
    struct shef_evt_clock_mark calm; /* time before the latest impossible words */
    struct shef_evt_sync sync;
    uint32_t low_us;    /* low bits of the last event (EVT2, 2.1) or TIME_LOW (EVT3) */
    uint32_t last_type; /* of the word before, for continuations */
    uint32_t spare;     /* EVT2.1: the bits of a TIME_HIGH that mean nothing, in the last one */
    uint8_t n_spare;    /* how often they came unchanged, up to SHEF_EVT_SPARE_SURE */
    uint8_t n_strange;  /* TIME_HIGH words in a row with other ones */
    uint32_t row_state; /* EVT3: enum of the implementation */
    uint32_t row_px;
    uint32_t base_px;
    bool base_on;
    bool base_known;
    uint8_t group_phase; /* EVT3: words of a 12 + 12 + 8 group taken, 0..2 */
    uint8_t n_carried;   /* bytes of a word cut by the end of a slice */
    uint8_t carried[8];
    struct shef_evt_stats stats;
};

/* A word can hold 32 events; a batch with less free room than this counts as full. */
#define SHEF_EVT_MIN_ROOM 64

/* Prepares a decoder at the start of a stream.
 *   width_px, height_px  the sensor's size, 1..2048; 2048 x 2048 accepts every address
 *   near_us              a time within half the counter's range of the stream's start (2^33 us,
 *                        EVT3: 2^23 us) where one is known, so that segments join; else 0
 *   features             the instruction sets to use, usually shef_cpu_features() */
void shef_evt_init(struct shef_evt_decoder *decoder, enum shef_evt_format format, uint32_t width_px,
                   uint32_t height_px, int64_t near_us, uint32_t features);

/* Decodes bytes and appends to the batch.
 *   batch  capacity at least SHEF_EVT_MIN_ROOM; cleared by the caller before its first use
 * Returns how many bytes were taken. Fewer than n_bytes: the batch is full, or time has left the
 * range of its base; use and clear it, then call again with the rest. */
SHEF_MUST_CHECK size_t shef_evt_decode(struct shef_evt_decoder *decoder, const uint8_t *bytes,
                                       size_t n_bytes, struct shef_event_batch *batch);

/* Ends the stream: counts a word that its end has cut. The decoder can go on with another part of
 * the stream, whose words start anew; time and row are kept.
 * Returns how many bytes of the cut word had come, 0 for a clean end. */
uint32_t shef_evt_finish(struct shef_evt_decoder *decoder);

/* How far the stream's own time has come; the near_us of init before the first TIME_HIGH. */
int64_t shef_evt_reached_us(const struct shef_evt_decoder *decoder);

/* The name of a format as files write it: "EVT2", "EVT21" or "EVT3". Never NULL. */
const char *shef_evt_format_name(enum shef_evt_format format);

/* A few words for reports, e.g. "time went back". Never NULL. */
const char *shef_evt_violation_name(enum shef_evt_violation violation);

#define SHEF_EVT_STATE_BYTES 64

/* Writes what a decoder needs to go on from here: a recording's index keeps it for each segment.
 * Counts are not part of it. Little-endian, the same on every machine. */
void shef_evt_save(const struct shef_evt_decoder *decoder, uint8_t out_state[SHEF_EVT_STATE_BYTES]);

/* Continues from a saved state; the decoder has been initialised with the same format. Counts go
 * on.
 * SHEF_ERR_FORMAT: the bytes are not such a state; the decoder is unchanged. */
SHEF_MUST_CHECK enum shef_err shef_evt_restore(struct shef_evt_decoder *decoder,
                                               const uint8_t state[SHEF_EVT_STATE_BYTES],
                                               struct shef_error *err);

/* Makes a saved state's time later by shift_us, so that what is decoded from it is, too. */
void shef_evt_state_shift(uint8_t state[SHEF_EVT_STATE_BYTES], int64_t shift_us);

#ifdef __cplusplus
}
#endif

#endif
