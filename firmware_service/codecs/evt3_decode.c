/* The state machine of EVT3: 16-bit words that each change one part of the state. */
#include "codecs/evt_decode.h"

/* Whether an event of the current row can come out; counts n of them if not. */
static bool has_place(struct shef_evt_decoder *decoder, uint32_t n)
{
    if (decoder->row_state == SHEF_EVT_ROW_FOREIGN)
        return false;
    if (!shef_evt_clock_runs(&decoder->clock))
        shef_evt_note(decoder, SHEF_EVT_NO_TIME, n);
    else if (decoder->row_state == SHEF_EVT_ROW_NONE)
        shef_evt_note(decoder, SHEF_EVT_NO_ROW, n);
    else if (decoder->row_state == SHEF_EVT_ROW_OUTSIDE)
        shef_evt_note(decoder, SHEF_EVT_OUTSIDE, n);
    else
        return true;
    return false;
}

static void take_row(struct shef_evt_decoder *decoder, uint32_t y_px)
{
    decoder->row_px = y_px;
    decoder->row_state = y_px < decoder->height_px ? SHEF_EVT_ROW_VALID : SHEF_EVT_ROW_OUTSIDE;
}

static void take_event(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                       uint32_t x_px, bool on)
{
    if (x_px >= decoder->width_px)
        shef_evt_note(decoder, SHEF_EVT_OUTSIDE, 1);
    else
        shef_evt_put(decoder, batch, decoder->low_us, x_px, decoder->row_px, on);
}

/* A group is 12 + 12 + 8 pixels; anything else between its words means that words are missing.
 * What is there is kept: the first vectors are right, and later ones are at most some pixels
 * off. */
static void follow_group(struct shef_evt_decoder *decoder, uint32_t type)
{
    static const uint8_t expected[] = { SHEF_EVT3_VECTOR_12, SHEF_EVT3_VECTOR_12,
                                        SHEF_EVT3_VECTOR_8 };
    const bool is_vector = type == SHEF_EVT3_VECTOR_12 || type == SHEF_EVT3_VECTOR_8;

    if (is_vector && type == expected[decoder->group_phase]) {
        decoder->group_phase = (decoder->group_phase + 1) % SHEF_EVT3_GROUP_WORDS;
        return;
    }
    if (is_vector || decoder->group_phase != 0)
        shef_evt_note(decoder, SHEF_EVT_BAD_VECTOR, 1);
    decoder->group_phase = type == SHEF_EVT3_VECTOR_12;
}

static void take_vector(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                        uint32_t mask, uint32_t n_px)
{
    const uint32_t base_px = decoder->base_px;

    if (!decoder->base_known) {
        shef_evt_note(decoder, SHEF_EVT_BAD_VECTOR, 1);
        return;
    }
    if (base_px < SHEF_EVT_MAX_SIDE_PX)
        decoder->base_px += n_px;
    if (mask == 0 || !has_place(decoder, (uint32_t)__builtin_popcount(mask)))
        return;
    for (; mask != 0; mask &= mask - 1)
        take_event(decoder, batch, base_px + (uint32_t)__builtin_ctz(mask), decoder->base_on);
}

static void take_time_low(struct shef_evt_decoder *decoder, uint32_t low_us)
{
    if (low_us < decoder->low_us && shef_evt_clock_runs(&decoder->clock))
        shef_evt_note(decoder, SHEF_EVT_TIME_BACK, 1);
    decoder->low_us = low_us;
}

static void take_word(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                      uint32_t word)
{
    const uint32_t type = word >> 12;
    const uint32_t address_px = word & 0x7ff;
    const bool on = (word & 0x800) != 0;

    decoder->stats.n_words++;
    follow_group(decoder, type);
    if (!shef_evt3_is_known(word, decoder->last_type)) {
        decoder->last_type = 0;
        shef_evt_take_bad_word(decoder);
        return;
    }
    /* A trigger's other bits are 0, and a counter or IMU word has its continuation. */
    if ((type == SHEF_EVT3_TRIGGER && (word & 0xfe) != 0) ||
        ((type == SHEF_EVT3_OTHER || type == SHEF_EVT3_IMU) &&
         (decoder->last_type == SHEF_EVT3_OTHER || decoder->last_type == SHEF_EVT3_IMU)))
        shef_evt_suspect_word(decoder);
    decoder->last_type = type;
    switch (type) {
    case SHEF_EVT3_ROW:
        take_row(decoder, address_px);
        break;
    case SHEF_EVT3_FOREIGN_ROW:
        decoder->row_state = SHEF_EVT_ROW_FOREIGN;
        break;
    case SHEF_EVT3_EVENT:
        if (has_place(decoder, 1))
            take_event(decoder, batch, address_px, on);
        break;
    case SHEF_EVT3_BASE:
        decoder->base_px = address_px;
        decoder->base_on = on;
        decoder->base_known = true;
        break;
    case SHEF_EVT3_VECTOR_12:
        take_vector(decoder, batch, word & 0xfff, 12);
        break;
    case SHEF_EVT3_VECTOR_8:
        take_vector(decoder, batch, word & 0xff, 8);
        break;
    case SHEF_EVT3_TIME_LOW:
        take_time_low(decoder, word & 0xfff);
        break;
    case SHEF_EVT3_TIME_HIGH:
        shef_evt_take_time_high(decoder, word & 0xfff);
        break;
    case SHEF_EVT3_TRIGGER:
        shef_evt_take_trigger(decoder, batch, decoder->low_us, word >> 8 & 0xf, word & 1);
        break;
    default: /* counters, IMU, padding: known and of no use here */
        break;
    }
}

size_t shef_evt3_decode(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                        struct shef_event_batch *batch)
{
    size_t i = 0;

    while (i < n_words && shef_evt_can_take(decoder, batch)) {
        if (decoder->row_state == SHEF_EVT_ROW_VALID && decoder->group_phase == 0) {
            const size_t n_run =
                shef_evt_run(decoder, decoder->kernels->evt3, words + i * 2, n_words - i, batch);

            i += n_run;
            if (i == n_words || (n_run > 0 && !shef_evt_can_take(decoder, batch)))
                break;
        }
        take_word(decoder, batch, shef_load_u16(words + i * 2));
        i++;
    }
    return i;
}
