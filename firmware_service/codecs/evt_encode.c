#include "codecs/evt_encode.h"

#include <assert.h>

#include "codecs/evt_word.h"

#define TICK_US 16

/* A minute of ticks takes 15 MB in EVT2. A day of them, because some time is wrong, must not. */
#define TICKING_MAX_US 60000000

/* How often a jump is said: once, and again for each word that has to agree. */
#define N_SAID_JUMP (1 + SHEF_EVT_CLOCK_N_AGREEING)

/* Other readers take a short counter's jump of half its range for a step back. */
#define EVT3_AHEAD_MAX 2047

/* A group costs three words, and its base one. */
#define MIN_EVENTS_OF_GROUP 4

void shef_evt_encoder_init(struct shef_evt_encoder *encoder, enum shef_evt_format format,
                           enum shef_evt_ticks ticks, uint32_t width_px, uint32_t height_px)
{
    const int32_t n_high_bits = format == SHEF_EVT3 ? SHEF_EVT3_HIGH_BITS : SHEF_EVT2_HIGH_BITS;

    assert(width_px >= 1 && width_px <= SHEF_EVT_MAX_SIDE_PX);
    assert(height_px >= 1 && height_px <= SHEF_EVT_MAX_SIDE_PX);
    *encoder = (struct shef_evt_encoder){
        .format = format,
        .ticks = ticks,
        .width_px = width_px,
        .height_px = height_px,
        .low_bits = format == SHEF_EVT3 ? SHEF_EVT3_LOW_BITS : SHEF_EVT2_LOW_BITS,
        .mask = ((int64_t)1 << n_high_bits) - 1,
        .n_back_max = format == SHEF_EVT3 ? 256 : (int64_t)1 << (n_high_bits - 1),
        .n_ahead_max = format == SHEF_EVT3 ? EVT3_AHEAD_MAX : ((int64_t)1 << (n_high_bits - 1)) - 1,
    };
}

static uint8_t *put_u16(uint8_t *out, uint32_t type, uint32_t value)
{
    const uint16_t word = (uint16_t)(type << 12 | value);

    memcpy(out, &word, sizeof word);
    return out + sizeof word;
}

/* One word of EVT2, or of EVT2.1 with the valid bits given. */
static uint8_t *put_word(const struct shef_evt_encoder *encoder, uint8_t *out, uint32_t upper,
                         uint32_t valid)
{
    if (encoder->format == SHEF_EVT2) {
        memcpy(out, &upper, sizeof upper);
        return out + sizeof upper;
    }

    const uint64_t word =
        shef_evt21_order((uint64_t)upper << 32 | valid, encoder->format == SHEF_EVT21_LEGACY);

    memcpy(out, &word, sizeof word);
    return out + sizeof word;
}

static uint8_t *put_high(struct shef_evt_encoder *encoder, uint8_t *out, int64_t high)
{
    const uint32_t value = (uint32_t)(high & encoder->mask);

    if (!encoder->started || high != encoder->high)
        encoder->low_known = false;
    encoder->started = true;
    encoder->high = high;
    if (encoder->format == SHEF_EVT3)
        return put_u16(out, SHEF_EVT3_TIME_HIGH, value);
    return put_word(encoder, out, (uint32_t)SHEF_EVT2_TIME_HIGH << 28 | value, 0);
}

static uint8_t *put_low(struct shef_evt_encoder *encoder, uint8_t *out, int64_t t_us)
{
    const uint32_t low_us = (uint32_t)(t_us & (((int64_t)1 << encoder->low_bits) - 1));

    if (encoder->format != SHEF_EVT3 || (encoder->low_known && encoder->low_us == low_us))
        return out;
    encoder->low_known = true;
    encoder->low_us = low_us;
    return put_u16(out, SHEF_EVT3_TIME_LOW, low_us);
}

static uint8_t *put_tick(struct shef_evt_encoder *encoder, uint8_t *out)
{
    out = put_high(encoder, out, encoder->next_tick_us >> encoder->low_bits);
    out = put_low(encoder, out, encoder->next_tick_us);
    encoder->next_tick_us += TICK_US;
    return out;
}

/* Writes the next time words on the way to t_us.
 * Returns NULL if there is no way, out itself if none is needed. */
static uint8_t *step_to(struct shef_evt_encoder *encoder, uint8_t *out, int64_t t_us)
{
    const int64_t high = t_us >> encoder->low_bits;
    const bool ticking = encoder->ticks == SHEF_EVT_TICKS_SENSOR;
    int64_t n_steps = high - encoder->high;

    if (!encoder->started) {
        encoder->next_tick_us = (t_us / TICK_US + 1) * TICK_US;
        return put_high(encoder, out, high);
    }
    if (ticking && encoder->next_tick_us <= t_us && t_us - encoder->next_tick_us <= TICKING_MAX_US)
        return put_tick(encoder, out);
    if (n_steps > 1) {
        /* Readers see a wrap by its last and first value, so those are never skipped. */
        const int64_t n_to_wrap = encoder->mask - (encoder->high & encoder->mask);
        const int64_t n_free = n_to_wrap > 0 ? n_to_wrap : 1;

        if (n_steps > encoder->n_ahead_max)
            n_steps = encoder->n_ahead_max;
        if (n_steps > n_free)
            n_steps = n_free;
    }
    if (n_steps < -encoder->n_back_max)
        return NULL;
    if (n_steps < -1 || (n_steps > 1 && ticking)) {
        const int64_t next_high = encoder->high + n_steps;

        encoder->next_tick_us = (t_us / TICK_US + 1) * TICK_US;
        for (int32_t i = 0; i < N_SAID_JUMP; i++)
            out = put_high(encoder, out, next_high);
        return out;
    }
    return n_steps == 0 ? out : put_high(encoder, out, encoder->high + n_steps);
}

/* How many events from at_event on are one vector: same time, row and polarity, x rising within
 * 32 pixels from base_px. Their valid bits go to *out_valid. */
static uint32_t vector_at(const struct shef_evt_encoder *encoder,
                          const struct shef_event_batch *batch, uint32_t n_limit, uint32_t base_px,
                          uint32_t *out_valid)
{
    const struct shef_event *events = batch->events + encoder->at_event;
    uint32_t n = 0;
    uint32_t valid = 0;

    for (; n < n_limit; n++) {
        const uint32_t bit = (uint32_t)events[n].x_px - base_px;

        if (events[n].t_us != events[0].t_us || events[n].y_on != events[0].y_on || bit > 31 ||
            valid >> bit != 0)
            break;
        valid |= 1u << bit;
    }
    *out_valid = valid;
    return n;
}

/* Writes the EVT3 words of the events at at_event, at a time already set. */
static uint8_t *put_evt3_events(struct shef_evt_encoder *encoder, uint8_t *out,
                                const struct shef_event_batch *batch, uint32_t n_limit)
{
    const struct shef_event event = batch->events[encoder->at_event];
    const bool on = shef_event_is_on(event);
    const uint32_t row_px = shef_event_y_px(event);
    uint32_t valid;

    if (!encoder->row_known || encoder->row_px != row_px) {
        encoder->row_known = true;
        encoder->row_px = row_px;
        out = put_u16(out, SHEF_EVT3_ROW, row_px);
    }
    if (encoder->width_px >= 32) {
        /* Sensors lay groups on multiples of 32; readers refuse one that crosses the edge. */
        const uint32_t last_px = encoder->width_px - 32;
        const uint32_t aligned_px = event.x_px & ~31u;
        const uint32_t base_px = aligned_px < last_px ? aligned_px : last_px;
        const uint32_t n = vector_at(encoder, batch, n_limit, base_px, &valid);

        if (n >= MIN_EVENTS_OF_GROUP) {
            if (!encoder->base_known || encoder->base_px != base_px || encoder->base_on != on)
                out = put_u16(out, SHEF_EVT3_BASE, base_px | (on ? 0x800u : 0u));
            out = put_u16(out, SHEF_EVT3_VECTOR_12, valid & 0xfff);
            out = put_u16(out, SHEF_EVT3_VECTOR_12, valid >> 12 & 0xfff);
            out = put_u16(out, SHEF_EVT3_VECTOR_8, valid >> 24);
            encoder->base_known = true;
            encoder->base_on = on;
            encoder->base_px = base_px + 32;
            encoder->at_event += n;
            return out;
        }
    }
    /* Some readers keep one x and one polarity for single events and vectors alike. */
    encoder->base_known = false;
    encoder->at_event++;
    return put_u16(out, SHEF_EVT3_EVENT, event.x_px | (on ? 0x800u : 0u));
}

/* Writes the words of the events at at_event, up to n_limit of them. */
static uint8_t *put_events(struct shef_evt_encoder *encoder, uint8_t *out,
                           const struct shef_event_batch *batch, uint32_t n_limit, int64_t t_us)
{
    const struct shef_event event = batch->events[encoder->at_event];
    const uint32_t y_px = shef_event_y_px(event);
    const uint32_t head = (uint32_t)shef_event_is_on(event) << 28 | (uint32_t)(t_us & 0x3f) << 22;
    uint32_t valid;

    if (encoder->format == SHEF_EVT3)
        return put_evt3_events(encoder, put_low(encoder, out, t_us), batch, n_limit);
    if (encoder->format == SHEF_EVT2) {
        encoder->at_event++;
        return put_word(encoder, out, head | (uint32_t)event.x_px << 11 | y_px, 0);
    }

    const uint32_t base_px = event.x_px & ~31u;

    encoder->at_event += vector_at(encoder, batch, n_limit, base_px, &valid);
    return put_word(encoder, out, head | base_px << 11 | y_px, valid);
}

static uint8_t *put_trigger(struct shef_evt_encoder *encoder, uint8_t *out,
                            const struct shef_trigger *trigger)
{
    encoder->at_trigger++;
    if (encoder->format == SHEF_EVT3)
        return put_u16(put_low(encoder, out, trigger->t_us), SHEF_EVT3_TRIGGER,
                       (uint32_t)trigger->channel << 8 | trigger->rising);
    return put_word(encoder, out,
                    (uint32_t)SHEF_EVT2_TRIGGER << 28 | (uint32_t)(trigger->t_us & 0x3f) << 22 |
                        (uint32_t)trigger->channel << 8 | trigger->rising,
                    0);
}

/* Writes what comes next in the batch, or a part of the way there in time.
 * Returns NULL if it cannot be said, out itself at the end of the batch. */
static uint8_t *put_next(struct shef_evt_encoder *encoder, uint8_t *out,
                         const struct shef_event_batch *batch)
{
    const bool has_trigger = encoder->at_trigger < batch->n_triggers;
    const struct shef_trigger *trigger = &batch->triggers[encoder->at_trigger];
    const uint32_t max_channel = encoder->format == SHEF_EVT3 ? 15 : 31;

    if (has_trigger && trigger->n_before <= encoder->at_event) {
        uint8_t *const stepped = step_to(encoder, out, trigger->t_us);

        if (trigger->channel > max_channel || stepped != out)
            return trigger->channel > max_channel ? NULL : stepped;
        return put_trigger(encoder, out, trigger);
    }
    if (encoder->at_event < batch->n_events) {
        const struct shef_event event = batch->events[encoder->at_event];
        const uint32_t n_end = has_trigger && trigger->n_before < batch->n_events
                                   ? trigger->n_before
                                   : batch->n_events;
        const int64_t t_us = batch->base_us + event.t_us;

        if (event.x_px >= encoder->width_px || shef_event_y_px(event) >= encoder->height_px)
            return NULL;
        uint8_t *const stepped = step_to(encoder, out, t_us);

        if (stepped != out)
            return stepped;
        return put_events(encoder, out, batch, n_end - encoder->at_event, t_us);
    }
    if (encoder->ticks == SHEF_EVT_TICKS_SENSOR && encoder->started &&
        encoder->next_tick_us <= batch->reached_us)
        return put_tick(encoder, out);
    return out;
}

enum shef_err shef_evt_encode(struct shef_evt_encoder *encoder,
                              const struct shef_event_batch *batch, uint8_t *out, size_t capacity,
                              size_t *out_bytes)
{
    uint8_t *at = out;

    assert(capacity >= SHEF_EVT_ENCODE_MIN_ROOM);
    while (capacity - (size_t)(at - out) >= SHEF_EVT_ENCODE_MIN_ROOM) {
        uint8_t *const next = put_next(encoder, at, batch);

        *out_bytes = (size_t)(at - out);
        if (!next)
            return SHEF_ERR_INVALID;
        if (next == at) {
            encoder->at_event = 0;
            encoder->at_trigger = 0;
            return SHEF_OK;
        }
        at = next;
    }
    *out_bytes = (size_t)(at - out);
    return SHEF_ERR_FULL;
}
