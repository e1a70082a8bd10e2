/* Encoder for EVT2, EVT2.1 and EVT3: batches in, the bytes a sensor would send out.
 *
 * A pure state machine that fills whatever room it is given. What it writes decodes to the same
 * events and triggers in the same order, here and in other people's readers: time words are laid
 * so that every wrap of the counter is seen, and a step back is said as often as our
 * decoder asks. Thread: one at a time per encoder. */
#ifndef SHEF_CODECS_EVT_ENCODE_H
#define SHEF_CODECS_EVT_ENCODE_H

#include "codecs/evt.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_evt_ticks {
    SHEF_EVT_TICKS_SPARSE, /* a TIME_HIGH only when it changes: small files */
    SHEF_EVT_TICKS_SENSOR, /* one every 16 us, events or not, as sensors do, so that a reader finds
                            * its way after damage; a pause of more than a minute is jumped over,
                            * and readers count it as lost data */
};

/* All fields are the encoder's own. */
struct shef_evt_encoder {
    /* Set by init. */
    enum shef_evt_format format;
    enum shef_evt_ticks ticks;
    uint32_t width_px;
    uint32_t height_px;
    int32_t low_bits;   /* of time, outside TIME_HIGH */
    int64_t mask;       /* of TIME_HIGH's value */
    int64_t n_back_max; /* steps of TIME_HIGH */
    int64_t n_ahead_max;
    /* Where it is in the batch. */
    uint32_t at_event;
    uint32_t at_trigger;
    /* What the decoder knows. */
    int64_t high; /* time >> low_bits of the last TIME_HIGH, not wrapped */
    int64_t next_tick_us;
    bool started;
    bool low_known; /* EVT3, and so on */
    bool row_known;
    bool base_known;
    bool base_on;
    uint32_t low_us;
    uint32_t row_px;
    uint32_t base_px;
};

/* Less room than this is never filled. */
#define SHEF_EVT_ENCODE_MIN_ROOM 64

/*   width_px, height_px  1..2048 */
void shef_evt_encoder_init(struct shef_evt_encoder *encoder, enum shef_evt_format format,
                           enum shef_evt_ticks ticks, uint32_t width_px, uint32_t height_px);

/* Encodes a batch, or as much of it as there is room for.
 *   out        capacity bytes, at least SHEF_EVT_ENCODE_MIN_ROOM
 *   out_bytes  how many were written, also after an error
 * SHEF_OK: the whole batch, and with sensor ticks the time up to its reached_us.
 * SHEF_ERR_FULL: call again with the same batch and new room.
 * SHEF_ERR_INVALID: the event at_event or the trigger at_trigger cannot be said: it lies outside
 * the sensor, has a channel above 31 (EVT3: 15), or goes back in time by more than 2^33 us (EVT3:
 * 2^20 us). */
SHEF_MUST_CHECK enum shef_err shef_evt_encode(struct shef_evt_encoder *encoder,
                                              const struct shef_event_batch *batch, uint8_t *out,
                                              size_t capacity, size_t *out_bytes);

#ifdef __cplusplus
}
#endif

#endif
