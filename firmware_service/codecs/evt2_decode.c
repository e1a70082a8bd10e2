/* The state machines of EVT2 and EVT2.1: 32-bit words of one event, 64-bit words of up to 32. */
#include "codecs/evt_decode.h"

/* So many TIME_HIGH words in a row that are none: the alignment is lost. */
#define N_STRANGE_LOST 4

static void take_low(struct shef_evt_decoder *decoder, uint32_t low_us)
{
    if (low_us < decoder->low_us)
        shef_evt_note(decoder, SHEF_EVT_TIME_BACK, 1);
    decoder->low_us = low_us;
}

static void take_evt2_event(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                            uint32_t word)
{
    const uint32_t x_px = word >> 11 & 0x7ff;
    const uint32_t y_px = word & 0x7ff;

    if (!shef_evt_clock_runs(&decoder->clock)) {
        shef_evt_note(decoder, SHEF_EVT_NO_TIME, 1);
    } else if (x_px >= decoder->width_px || y_px >= decoder->height_px) {
        shef_evt_note(decoder, SHEF_EVT_OUTSIDE, 1);
    } else {
        take_low(decoder, word >> 22 & 0x3f);
        shef_evt_put(decoder, batch, decoder->low_us, x_px, y_px, word >> 28 == SHEF_EVT2_ON);
    }
}

/* Whether a word, of a type that exists, has bits that should be 0 or lacks its continuation. Its
 * upper half in EVT2.1. */
static bool is_odd(uint32_t word, uint32_t last_type)
{
    const uint32_t type = word >> 28;

    if (type == SHEF_EVT2_TRIGGER)
        return (word & 0x003fe0fe) != 0;
    if (type == SHEF_EVT2_OTHER && (word & 0x003e0000) != 0)
        return true;
    return (type == SHEF_EVT2_OTHER || type == SHEF_EVT2_IMU) &&
           (last_type == SHEF_EVT2_OTHER || last_type == SHEF_EVT2_IMU);
}

static void take_evt2_word(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                           uint32_t word)
{
    const uint32_t type = word >> 28;

    decoder->stats.n_words++;
    if (!shef_evt2_is_known(type, decoder->last_type)) {
        decoder->last_type = 0;
        shef_evt_take_bad_word(decoder);
        return;
    }
    if (is_odd(word, decoder->last_type))
        shef_evt_suspect_word(decoder);
    decoder->last_type = type;
    if (type <= SHEF_EVT2_ON)
        take_evt2_event(decoder, batch, word);
    else if (type == SHEF_EVT2_TIME_HIGH)
        shef_evt_take_time_high(decoder, word & ((1u << SHEF_EVT2_HIGH_BITS) - 1));
    else if (type == SHEF_EVT2_TRIGGER)
        shef_evt_take_trigger(decoder, batch, word >> 22 & 0x3f, word >> 8 & 0x1f, word & 1);
}

size_t shef_evt2_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                        struct shef_event_batch *batch)
{
    shef_evt_run_fn *const kernel = decoder->kernels->evt2;
    size_t i = 0;

    while (i < n_words && shef_evt_can_take(decoder, batch)) {
        const size_t n_run = shef_evt_run(decoder, kernel, words + i * 4, n_words - i, batch);

        i += n_run;
        if (i == n_words || (n_run > 0 && !shef_evt_can_take(decoder, batch)))
            break;
        take_evt2_word(decoder, batch, shef_load_u32(words + i * 4));
        i++;
    }
    return i;
}

static void take_evt21_vector(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                              uint64_t word)
{
    const uint32_t x_px = (uint32_t)(word >> 43) & 0x7ff;
    const uint32_t y_px = (uint32_t)(word >> 32) & 0x7ff;
    const bool on = word >> 60 == SHEF_EVT2_ON;
    uint32_t mask = (uint32_t)word;

    if (!shef_evt_clock_runs(&decoder->clock)) {
        shef_evt_note(decoder, SHEF_EVT_NO_TIME, (uint32_t)__builtin_popcount(mask));
        return;
    }
    take_low(decoder, (uint32_t)(word >> 54) & 0x3f);
    for (; mask != 0; mask &= mask - 1) {
        const uint32_t x_bit_px = x_px + (uint32_t)__builtin_ctz(mask);

        if (x_bit_px < decoder->width_px && y_px < decoder->height_px)
            shef_evt_put(decoder, batch, decoder->low_us, x_bit_px, y_px, on);
        else
            shef_evt_note(decoder, SHEF_EVT_OUTSIDE, 1);
    }
}

/* Whether a word is a TIME_HIGH by its spare bits too. Out of alignment those are an event's, and
 * its time is another event's pixels. */
static bool is_true_time_high(struct shef_evt_decoder *decoder, uint32_t spare)
{
    if (spare == decoder->spare) {
        decoder->n_strange = 0;
        decoder->n_spare += decoder->n_spare < SHEF_EVT_SPARE_SURE;
        return true;
    }
    if (decoder->n_spare < SHEF_EVT_SPARE_SURE) {
        decoder->spare = spare;
        decoder->n_spare = 0;
        return true;
    }
    return false;
}

static void take_evt21_time_high(struct shef_evt_decoder *decoder, uint64_t word)
{
    if (is_true_time_high(decoder, (uint32_t)word)) {
        shef_evt_take_time_high(decoder,
                                (uint32_t)(word >> 32) & ((1u << SHEF_EVT2_HIGH_BITS) - 1));
        return;
    }
    shef_evt_take_bad_word(decoder);
    if (++decoder->n_strange == N_STRANGE_LOST) {
        decoder->n_strange = 0;
        shef_evt_sync_lose(&decoder->sync, decoder->stats.n_words);
    }
}

static void take_evt21_word(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                            uint64_t word)
{
    const uint32_t type = (uint32_t)(word >> 60);
    const uint32_t upper = (uint32_t)(word >> 32);

    decoder->stats.n_words++;
    if (is_odd(upper, 0))
        shef_evt_suspect_word(decoder);
    if (!shef_evt21_is_known(type))
        shef_evt_take_bad_word(decoder);
    else if (type <= SHEF_EVT2_ON)
        take_evt21_vector(decoder, batch, word);
    else if (type == SHEF_EVT2_TIME_HIGH)
        take_evt21_time_high(decoder, word);
    else if (type == SHEF_EVT2_TRIGGER)
        shef_evt_take_trigger(decoder, batch, upper >> 22 & 0x3f, upper >> 8 & 0x1f, upper & 1);
}

size_t shef_evt21_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                         struct shef_event_batch *batch)
{
    const bool upper_first = decoder->format == SHEF_EVT21_LEGACY;
    size_t i = 0;

    while (i < n_words && shef_evt_can_take(decoder, batch)) {
        const size_t n_run =
            shef_evt_run(decoder, decoder->kernels->evt21, words + i * 8, n_words - i, batch);

        i += n_run;
        if (i == n_words || (n_run > 0 && !shef_evt_can_take(decoder, batch)))
            break;
        take_evt21_word(decoder, batch,
                        shef_evt21_order(shef_load_u64(words + i * 8), upper_first));
        i++;
    }
    return i;
}
