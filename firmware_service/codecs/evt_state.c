/* Names, and a decoder's state as bytes. */
#include <string.h>

#include "codecs/evt_decode.h"

/* Version 1 of the layout, little-endian:
 *   0  'E' 'V' 'S' 1
 *   4  u8 format, last type, row state, flags
 *   8  i64 TIME_HIGH's time in us
 *  16  u32 TIME_HIGH's value, u32 candidate in doubt
 *  24  u32 low bits in us, u16 row, u16 vector base in px
 *  32  u8 agreeing words, u8 repeats, u8 group phase, u8 carried bytes
 *  36  8 carried bytes
 *  44  u32 spare bits of a TIME_HIGH, u8 how often they came (EVT2.1)
 *  49  7 zero bytes
 *  56  i64 us that are added to what the first TIME_HIGH says, and are in the time at 8 once it is
 *      known
 * A hunt for the alignment is not kept: the next segment starts it anew, with the first words
 * that are impossible. */
static const uint8_t state_magic[4] = { 'E', 'V', 'S', 1 };

enum state_flag {
    FLAG_KNOWN = 1,
    FLAG_IN_DOUBT = 2,
    FLAG_BASE_KNOWN = 4,
    FLAG_BASE_ON = 8,
    FLAG_ALL = 15,
};

const char *shef_evt_format_name(enum shef_evt_format format)
{
    static const char *const names[SHEF_EVT_FORMATS] = {
        [SHEF_EVT2] = "EVT2",
        [SHEF_EVT21] = "EVT21",
        [SHEF_EVT21_LEGACY] = "EVT21",
        [SHEF_EVT3] = "EVT3",
    };

    return format >= 0 && format < SHEF_EVT_FORMATS ? names[format] : "unknown";
}

const char *shef_evt_violation_name(enum shef_evt_violation violation)
{
    static const char *const names[SHEF_EVT_VIOLATIONS] = {
        [SHEF_EVT_TIME_BACK] = "time went back",
        [SHEF_EVT_TIME_GAP] = "time jumped over lost data",
        [SHEF_EVT_NO_TIME] = "event without a time",
        [SHEF_EVT_NO_ROW] = "event without a row",
        [SHEF_EVT_OUTSIDE] = "event outside the sensor",
        [SHEF_EVT_BAD_VECTOR] = "broken vector",
        [SHEF_EVT_UNKNOWN_WORD] = "unknown word",
        [SHEF_EVT_CUT_WORD] = "word cut by the end",
    };

    return violation >= 0 && violation < SHEF_EVT_VIOLATIONS ? names[violation] : "unknown";
}

static void put(uint8_t *bytes, uint64_t value, int n_bytes)
{
    memcpy(bytes, &value, (size_t)n_bytes);
}

void shef_evt_save(const struct shef_evt_decoder *decoder, uint8_t out_state[SHEF_EVT_STATE_BYTES])
{
    const struct shef_evt_clock *clock = &decoder->clock;

    memset(out_state, 0, SHEF_EVT_STATE_BYTES);
    memcpy(out_state, state_magic, sizeof state_magic);
    put(out_state + 4, decoder->format, 1);
    put(out_state + 5, decoder->last_type, 1);
    put(out_state + 6, decoder->row_state, 1);
    put(out_state + 7,
        (clock->known ? FLAG_KNOWN : 0u) | (clock->in_doubt ? FLAG_IN_DOUBT : 0u) |
            (decoder->base_known ? FLAG_BASE_KNOWN : 0u) | (decoder->base_on ? FLAG_BASE_ON : 0u),
        1);
    put(out_state + 8, (uint64_t)(clock->known ? clock->high_us : clock->near_us), 8);
    put(out_state + 16, clock->high, 4);
    put(out_state + 20, clock->candidate, 4);
    put(out_state + 24, decoder->low_us, 4);
    put(out_state + 28, decoder->row_px, 2);
    put(out_state + 30, decoder->base_px, 2);
    put(out_state + 32, clock->n_agreeing, 1);
    put(out_state + 33, clock->n_repeats, 1);
    put(out_state + 34, decoder->group_phase, 1);
    put(out_state + 35, decoder->n_carried, 1);
    memcpy(out_state + 36, decoder->carried, sizeof decoder->carried);
    put(out_state + 44, decoder->spare, 4);
    put(out_state + 48, decoder->n_spare, 1);
    put(out_state + 56, (uint64_t)clock->offset_us, 8);
}

/* Times that can be added and subtracted: 70 000 years. */
static bool is_time(const uint8_t *bytes)
{
    const int64_t us = (int64_t)shef_load_u64(bytes);

    return us > INT64_MIN / 4 && us < INT64_MAX / 4;
}

/* Whether every field is one that save() could have written for this decoder. */
static bool is_plausible(const struct shef_evt_decoder *decoder, const uint8_t *state)
{
    const uint32_t low_limit_us = (uint32_t)decoder->clock.step_us;

    return state[4] == decoder->format && is_time(state + 8) && is_time(state + 56) &&
           state[5] <= 15 && state[6] <= SHEF_EVT_ROW_FOREIGN && state[7] <= FLAG_ALL &&
           shef_load_u32(state + 16) <= decoder->clock.mask &&
           shef_load_u32(state + 20) <= decoder->clock.mask &&
           shef_load_u32(state + 24) < low_limit_us &&
           (state[6] != SHEF_EVT_ROW_VALID || shef_load_u16(state + 28) < decoder->height_px) &&
           shef_load_u16(state + 30) < 2 * SHEF_EVT_MAX_SIDE_PX &&
           state[34] < SHEF_EVT3_GROUP_WORDS && state[35] < shef_evt_word_bytes(decoder->format) &&
           state[48] <= SHEF_EVT_SPARE_SURE;
}

enum shef_err shef_evt_restore(struct shef_evt_decoder *decoder,
                               const uint8_t state[SHEF_EVT_STATE_BYTES], struct shef_error *err)
{
    struct shef_evt_clock *clock = &decoder->clock;

    if (memcmp(state, state_magic, sizeof state_magic) != 0 || !is_plausible(decoder, state))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the saved decoder state is damaged or not of a %s stream of %u x %u px",
                         shef_evt_format_name(decoder->format), decoder->width_px,
                         decoder->height_px);

    const int64_t time_us = (int64_t)shef_load_u64(state + 8);

    clock->known = (state[7] & FLAG_KNOWN) != 0;
    clock->in_doubt = (state[7] & FLAG_IN_DOUBT) != 0;
    clock->offset_us = (int64_t)shef_load_u64(state + 56);
    clock->near_us = time_us - (clock->known ? clock->offset_us : 0);
    clock->high_us = clock->known ? time_us : 0;
    clock->high = shef_load_u32(state + 16);
    clock->candidate = shef_load_u32(state + 20);
    clock->n_agreeing = state[32];
    clock->n_repeats = state[33];
    clock->n_wraps = (uint32_t)decoder->stats.n_wraps;
    shef_evt_clock_mark(clock, &decoder->calm);
    decoder->calm.known = shef_evt_clock_runs(clock);
    decoder->sync = (struct shef_evt_sync){ .last_bad_word = decoder->stats.n_words,
                                            .last_tick = decoder->stats.n_words };
    decoder->last_type = state[5];
    decoder->row_state = state[6];
    decoder->low_us = shef_load_u32(state + 24);
    decoder->row_px = shef_load_u16(state + 28);
    decoder->base_px = shef_load_u16(state + 30);
    decoder->base_known = (state[7] & FLAG_BASE_KNOWN) != 0;
    decoder->base_on = (state[7] & FLAG_BASE_ON) != 0;
    decoder->group_phase = state[34];
    decoder->n_carried = state[35];
    memcpy(decoder->carried, state + 36, sizeof decoder->carried);
    decoder->spare = shef_load_u32(state + 44);
    decoder->n_spare = state[48];
    decoder->n_strange = 0;
    return SHEF_OK;
}

void shef_evt_state_shift(uint8_t state[SHEF_EVT_STATE_BYTES], int64_t shift_us)
{
    const bool known = (state[7] & FLAG_KNOWN) != 0;

    put(state + 8, shef_load_u64(state + 8) + (known ? (uint64_t)shift_us : 0), 8);
    put(state + 56, shef_load_u64(state + 56) + (uint64_t)shift_us, 8);
}
