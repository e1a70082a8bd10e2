/* What the state machines of the three formats share. Internal to the decoder. */
#ifndef SHEF_CODECS_EVT_DECODE_H
#define SHEF_CODECS_EVT_DECODE_H

#include "codecs/evt.h"
#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run.h"

#ifdef __cplusplus
extern "C" {
#endif

/* EVT2.1: spare bits of a TIME_HIGH that came unchanged so often are always the same. */
#define SHEF_EVT_SPARE_SURE 8

/* Why events have no row (EVT3). */
enum shef_evt_row_state {
    SHEF_EVT_ROW_NONE, /* no ADDR_Y yet */
    SHEF_EVT_ROW_VALID,
    SHEF_EVT_ROW_OUTSIDE, /* below the sensor's last one */
    SHEF_EVT_ROW_FOREIGN, /* of another kind of event, which is left out silently */
};

/* Each decodes whole words of its format and returns how many it took: all, unless the batch is
 * no longer ready or the alignment is lost. */
size_t shef_evt2_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                        struct shef_event_batch *batch);
size_t shef_evt21_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                         struct shef_event_batch *batch);
size_t shef_evt3_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                        struct shef_event_batch *batch);

/* Whether the batch has room, and its base fits the present time; sets the base of an empty one. */
bool shef_evt_is_ready(const struct shef_evt_decoder *decoder, struct shef_event_batch *batch);

/* Whether the next word can be decoded: the batch is ready and words are aligned. Gives the
 * alignment up where a sensor's time words stay away. */
bool shef_evt_can_take(struct shef_evt_decoder *decoder, struct shef_event_batch *batch);

/* Lets a kernel take ordinary words. */
size_t shef_evt_run(struct shef_evt_decoder *decoder, shef_evt_run_fn *kernel, const uint8_t *words,
                    size_t n_words, struct shef_event_batch *batch);

/* Takes the value of a TIME_HIGH word. */
void shef_evt_take_time_high(struct shef_evt_decoder *decoder, uint32_t value);

/* Takes a trigger, or counts that there is no time for it. */
void shef_evt_take_trigger(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                           uint32_t low_us, uint32_t channel, bool rising);

/* Counts an impossible word and gives the alignment up if there were too many. */
void shef_evt_take_bad_word(struct shef_evt_decoder *decoder);

/* Remembers a word that could be right but hardly is. */
void shef_evt_suspect_word(struct shef_evt_decoder *decoder);

static inline void shef_evt_note(struct shef_evt_decoder *decoder,
                                 enum shef_evt_violation violation, uint32_t n)
{
    decoder->stats.n_violations[violation] += n;
}

/* Appends one event inside the sensor; the clock runs and the batch is ready. */
static inline void shef_evt_put(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                                uint32_t low_us, uint32_t x_px, uint32_t y_px, bool on)
{
    const uint32_t high_us = (uint32_t)(decoder->clock.high_us - batch->base_us);

    batch->events[batch->n_events++] = shef_event_make(high_us + low_us, x_px, y_px, on);
    decoder->stats.n_events++;
}

#ifdef __cplusplus
}
#endif

#endif
