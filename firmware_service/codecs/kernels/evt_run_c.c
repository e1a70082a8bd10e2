#include "codecs/kernels/evt_run.h"

#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run_parts.h"

static bool has_room(const struct shef_evt_run *run)
{
    return run->capacity - run->n_events >= SHEF_EVT_RUN_ROOM;
}

size_t shef_evt2_run_c(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    struct shef_event *out = run->events + run->n_events;
    size_t n_room = has_room(run) ? run->capacity - run->n_events : 0;
    size_t i = 0;

    if (n_words > n_room)
        n_words = n_room;
    for (; i < n_words; i++) {
        const uint32_t word = shef_load_u32(words + i * 4);
        const uint32_t x_px = word >> 11 & 0x7ff;
        const uint32_t y_px = word & 0x7ff;
        const uint32_t low_us = word >> 22 & 0x3f;

        if (word >> 28 > SHEF_EVT2_ON || x_px >= run->width_px || y_px >= run->height_px)
            break;
        run->n_back += low_us < run->low_us;
        run->low_us = low_us;
        out[i] = shef_event_make(run->high_us + low_us, x_px, y_px, word >> 28 == SHEF_EVT2_ON);
    }
    run->n_events += (uint32_t)i;
    return i;
}

/* One event for each set bit: bit i stands for pixel x_px + i. */
static void put_vector(struct shef_evt_run *run, uint32_t mask, uint32_t t_us, uint32_t x_px,
                       uint32_t y_on)
{
    while (mask != 0) {
        const uint32_t bit = (uint32_t)__builtin_ctz(mask);

        run->events[run->n_events++] =
            (struct shef_event){ t_us, (uint16_t)(x_px + bit), (uint16_t)y_on };
        mask &= mask - 1;
    }
}

size_t shef_evt21_run_c(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    struct shef_evt21_vector vector;
    size_t i = 0;

    for (; i < n_words && has_room(run) && shef_evt21_take(run, words + i * 8, &vector); i++)
        put_vector(run, vector.mask, vector.t_us, vector.x_px, vector.y_on);
    return i;
}

/* The valid bits of a group at words, or false if there is none or it reaches too far. */
static bool whole_group(const struct shef_evt_run *run, const uint8_t *words, size_t n_words,
                        uint32_t *out_mask)
{
    if (!run->base_known || n_words < SHEF_EVT3_GROUP_WORDS)
        return false;

    const uint32_t first = shef_load_u16(words);
    const uint32_t second = shef_load_u16(words + 2);
    const uint32_t third = shef_load_u16(words + 4);

    *out_mask = (first & 0xfff) | (second & 0xfff) << 12 | (third & 0xff) << 24;
    return first >> 12 == SHEF_EVT3_VECTOR_12 && second >> 12 == SHEF_EVT3_VECTOR_12 &&
           third >> 12 == SHEF_EVT3_VECTOR_8 && run->base_px + 32 <= run->width_px;
}

/* The words from i on that are not vectors; returns the number of the first that is something
 * else. Which type comes next is hardly predictable, so nothing here branches on it: every word
 * writes an event and only ADDR_X counts it. */
static size_t run_of_singles(struct shef_evt_run *run, const uint8_t *words, size_t i,
                             size_t n_words)
{
    const uint32_t singles = 1u << SHEF_EVT3_ROW | 1u << SHEF_EVT3_EVENT | 1u << SHEF_EVT3_TIME_LOW;
    const uint32_t limits[8] = { [SHEF_EVT3_ROW] = run->height_px,
                                 [SHEF_EVT3_EVENT] = run->width_px,
                                 [SHEF_EVT3_TIME_LOW] = SHEF_EVT_MAX_SIDE_PX };
    struct shef_event *events = run->events;
    uint32_t n_events = run->n_events;
    uint32_t row_px = run->row_px;
    uint32_t low_us = run->low_us;
    uint32_t n_back = run->n_back;

    for (; i < n_words && run->capacity - n_events >= SHEF_EVT_RUN_ROOM; i++) {
        const uint32_t word = shef_load_u16(words + i * 2);
        const uint32_t type = word >> 12;

        if (!(singles >> type & 1) || (word & 0x7ff) >= limits[type])
            break;
        const uint32_t is_row = 0u - (type == SHEF_EVT3_ROW);
        const uint32_t is_low = 0u - (type == SHEF_EVT3_TIME_LOW);
        const uint32_t new_low_us = (low_us & ~is_low) | (word & 0xfff & is_low);

        row_px = (row_px & ~is_row) | (word & 0x7ff & is_row);
        n_back += new_low_us < low_us;
        low_us = new_low_us;
        events[n_events] = (struct shef_event){ run->high_us + low_us, word & 0x7ff,
                                                (uint16_t)(row_px | (word & 0x800) << 4) };
        n_events += type == SHEF_EVT3_EVENT;
    }
    run->n_events = n_events;
    run->row_px = row_px;
    run->low_us = low_us;
    run->n_back = n_back;
    return i;
}

size_t shef_evt3_run_c(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    size_t i = 0;

    while ((i = run_of_singles(run, words, i, n_words)) < n_words && has_room(run)) {
        const uint32_t word = shef_load_u16(words + i * 2);
        uint32_t mask;

        if (word >> 12 == SHEF_EVT3_BASE) {
            run->base_px = word & 0x7ff;
            run->base_on = (word & 0x800) != 0;
            run->base_known = true;
            i++;
        } else if (whole_group(run, words + i * 2, n_words - i, &mask)) {
            put_vector(run, mask, run->high_us + run->low_us, run->base_px,
                       run->row_px | (run->base_on ? SHEF_EVENT_ON : 0u));
            run->base_px += 32;
            i += SHEF_EVT3_GROUP_WORDS;
        } else {
            break;
        }
    }
    return i;
}
