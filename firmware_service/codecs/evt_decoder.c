#include "codecs/evt.h"

#include <assert.h>

#include "codecs/evt_decode.h"

/* Room in a batch's 32-bit times for the largest low bits. */
#define LOW_US_LIMIT (1 << SHEF_EVT3_LOW_BITS)

void shef_evt_init(struct shef_evt_decoder *decoder, enum shef_evt_format format, uint32_t width_px,
                   uint32_t height_px, int64_t near_us, uint32_t features)
{
    assert(width_px >= 1 && width_px <= SHEF_EVT_MAX_SIDE_PX);
    assert(height_px >= 1 && height_px <= SHEF_EVT_MAX_SIDE_PX);
    assert(format >= 0 && format < SHEF_EVT_FORMATS);

    *decoder = (struct shef_evt_decoder){
        .format = format,
        .width_px = width_px,
        .height_px = height_px,
        .kernels = shef_evt_kernels_for(features),
        .n_silence_max = SHEF_EVT_SYNC_MAX_SILENCE_BYTES / shef_evt_word_bytes(format),
    };
    if (format == SHEF_EVT3)
        shef_evt_clock_init(&decoder->clock, SHEF_EVT3_HIGH_BITS, 1 << SHEF_EVT3_LOW_BITS, near_us);
    else
        shef_evt_clock_init(&decoder->clock, SHEF_EVT2_HIGH_BITS, 1 << SHEF_EVT2_LOW_BITS, near_us);
}

int64_t shef_evt_reached_us(const struct shef_evt_decoder *decoder)
{
    if (!decoder->clock.known)
        return decoder->clock.near_us + decoder->clock.offset_us;
    return decoder->clock.high_us + decoder->low_us;
}

bool shef_evt_is_ready(const struct shef_evt_decoder *decoder, struct shef_event_batch *batch)
{
    if (batch->n_events == 0) {
        assert(batch->capacity >= SHEF_EVT_MIN_ROOM);
        /* One step early, so that time may step back by one within the batch. */
        batch->base_us = decoder->clock.high_us - decoder->clock.step_us;
        return batch->n_triggers < SHEF_BATCH_TRIGGERS;
    }

    const int64_t high_us = decoder->clock.high_us - batch->base_us;

    return batch->capacity - batch->n_events >= SHEF_EVT_MIN_ROOM &&
           batch->n_triggers < SHEF_BATCH_TRIGGERS && high_us >= 0 &&
           high_us <= (int64_t)UINT32_MAX - LOW_US_LIMIT;
}

/* How many more words may come before the next TIME_HIGH of a sensor. */
static uint64_t n_words_until_silence(const struct shef_evt_decoder *decoder)
{
    const uint64_t n_max = decoder->n_silence_max;
    const uint64_t n_silent = decoder->stats.n_words - decoder->sync.last_tick;

    if (!shef_evt_clock_ticks(&decoder->clock))
        return UINT64_MAX;
    return n_silent < n_max ? n_max - n_silent : 0;
}

bool shef_evt_can_take(struct shef_evt_decoder *decoder, struct shef_event_batch *batch)
{
    if (!decoder->sync.hunting && n_words_until_silence(decoder) == 0)
        shef_evt_sync_lose(&decoder->sync, decoder->stats.n_words);
    return !decoder->sync.hunting && shef_evt_is_ready(decoder, batch);
}

size_t shef_evt_run(struct shef_evt_decoder *decoder, shef_evt_run_fn *kernel, const uint8_t *words,
                    size_t n_words, struct shef_event_batch *batch)
{
    if (!shef_evt_clock_runs(&decoder->clock))
        return 0;

    const uint64_t n_until_silence = n_words_until_silence(decoder);

    if (n_words > n_until_silence)
        n_words = (size_t)n_until_silence;

    struct shef_evt_run run = {
        .width_px = decoder->width_px,
        .height_px = decoder->height_px,
        .high_us = (uint32_t)(decoder->clock.high_us - batch->base_us),
        .upper_first = decoder->format == SHEF_EVT21_LEGACY,
        .events = batch->events,
        .capacity = batch->capacity,
        .n_events = batch->n_events,
        .low_us = decoder->low_us,
        .row_px = decoder->row_px,
        .base_px = decoder->base_px,
        .base_on = decoder->base_on,
        .base_known = decoder->base_known,
    };
    const size_t n_taken = kernel(&run, words, n_words);

    if (n_taken == 0)
        return 0;
    decoder->stats.n_words += n_taken;
    decoder->stats.n_events += run.n_events - batch->n_events;
    decoder->stats.n_violations[SHEF_EVT_TIME_BACK] += run.n_back;
    batch->n_events = run.n_events;
    decoder->low_us = run.low_us;
    decoder->row_px = run.row_px;
    decoder->base_px = run.base_px;
    decoder->base_on = run.base_on;
    decoder->base_known = run.base_known;
    decoder->last_type = 0;
    return n_taken;
}

static void note_time(struct shef_evt_decoder *decoder, enum shef_evt_tick tick)
{
    if (tick == SHEF_EVT_TICK_BACK || tick == SHEF_EVT_TICK_DOUBT_BACK)
        shef_evt_note(decoder, SHEF_EVT_TIME_BACK, 1);
    if (tick == SHEF_EVT_TICK_GAP || tick == SHEF_EVT_TICK_DOUBT_AHEAD)
        shef_evt_note(decoder, SHEF_EVT_TIME_GAP, 1);
}

void shef_evt_take_time_high(struct shef_evt_decoder *decoder, uint32_t value)
{
    struct shef_evt_sync *sync = &decoder->sync;
    const uint64_t n_words = decoder->stats.n_words;
    const bool was_in_doubt = decoder->clock.in_doubt;
    const enum shef_evt_tick tick = shef_evt_clock_push(&decoder->clock, value);

    if (!was_in_doubt)
        note_time(decoder, tick);
    if (decoder->clock.in_doubt) {
        shef_evt_sync_bad_word(sync, n_words);
        return;
    }
    if (was_in_doubt && (tick == SHEF_EVT_TICK_GAP || tick == SHEF_EVT_TICK_BACK))
        shef_evt_sync_forgive(sync, SHEF_EVT_CLOCK_N_AGREEING);
    sync->last_tick = n_words;
    if (tick == SHEF_EVT_TICK_SAME)
        return;
    decoder->low_us = 0;
    decoder->stats.n_wraps = decoder->clock.n_wraps;
    if (shef_evt_sync_is_calm(sync, n_words))
        shef_evt_clock_mark(&decoder->clock, &decoder->calm);
}

void shef_evt_suspect_word(struct shef_evt_decoder *decoder)
{
    shef_evt_sync_bad_word(&decoder->sync, decoder->stats.n_words);
}

void shef_evt_take_bad_word(struct shef_evt_decoder *decoder)
{
    shef_evt_note(decoder, SHEF_EVT_UNKNOWN_WORD, 1);
    shef_evt_suspect_word(decoder);
}

void shef_evt_take_trigger(struct shef_evt_decoder *decoder, struct shef_event_batch *batch,
                           uint32_t low_us, uint32_t channel, bool rising)
{
    if (!shef_evt_clock_runs(&decoder->clock)) {
        shef_evt_note(decoder, SHEF_EVT_NO_TIME, 1);
        return;
    }
    batch->triggers[batch->n_triggers++] = (struct shef_trigger){
        .t_us = decoder->clock.high_us + low_us,
        .n_before = batch->n_events,
        .channel = (uint8_t)channel,
        .rising = rising,
    };
    decoder->stats.n_triggers++;
}

/* Returns how many bytes it took to find the alignment, or all of them. */
static size_t hunt(struct shef_evt_decoder *decoder, const uint8_t *bytes, size_t n_bytes)
{
    const bool is_spare_sure = decoder->n_spare == SHEF_EVT_SPARE_SURE;
    const uint32_t *const spare = is_spare_sure ? &decoder->spare : NULL;
    size_t i = 0;
    uint32_t high = 0;

    while (i < n_bytes)
        if (shef_evt_sync_feed(&decoder->sync, decoder->format, spare, bytes[i++], &high))
            break;
    decoder->stats.n_bytes_skipped += i;
    if (decoder->sync.hunting)
        return i;

    decoder->stats.n_resyncs++;
    decoder->sync.last_tick = decoder->stats.n_words;
    /* Words out of alignment may have set the clock to anything. */
    note_time(decoder, shef_evt_clock_rejoin(&decoder->clock, &decoder->calm, high));
    decoder->stats.n_wraps = decoder->clock.n_wraps;
    decoder->low_us = 0;
    decoder->last_type = 0;
    decoder->group_phase = 0;
    decoder->base_known = false;
    decoder->row_state = SHEF_EVT_ROW_NONE;
    return i;
}

static size_t decode_words(struct shef_evt_decoder *decoder, const uint8_t *words, size_t n_words,
                           struct shef_event_batch *batch)
{
    if (decoder->format == SHEF_EVT2)
        return shef_evt2_decode(decoder, words, n_words, batch);
    if (decoder->format == SHEF_EVT3)
        return shef_evt3_decode(decoder, words, n_words, batch);
    return shef_evt21_decode(decoder, words, n_words, batch);
}

/* Completes the word that the last slice has cut, as far as the bytes go. */
static size_t decode_carried(struct shef_evt_decoder *decoder, const uint8_t *bytes, size_t n_bytes,
                             struct shef_event_batch *batch)
{
    const uint32_t word_bytes = shef_evt_word_bytes(decoder->format);
    size_t i = 0;

    while (i < n_bytes && decoder->n_carried < word_bytes)
        decoder->carried[decoder->n_carried++] = bytes[i++];
    if (decoder->n_carried == word_bytes) {
        decoder->n_carried = 0;
        const size_t n_taken = decode_words(decoder, decoder->carried, 1, batch);

        assert(n_taken == 1); /* the batch is ready */
        (void)n_taken;
    }
    return i;
}

size_t shef_evt_decode(struct shef_evt_decoder *decoder, const uint8_t *bytes, size_t n_bytes,
                       struct shef_event_batch *batch)
{
    const uint32_t word_bytes = shef_evt_word_bytes(decoder->format);
    size_t i = 0;

    while (i < n_bytes && shef_evt_is_ready(decoder, batch)) {
        const size_t n_words = (n_bytes - i) / word_bytes;
        const bool between_words = decoder->n_carried == 0;

        if (decoder->sync.hunting || (between_words && !shef_evt_can_take(decoder, batch)))
            i += hunt(decoder, bytes + i, n_bytes - i);
        else if (!between_words || n_words == 0)
            i += decode_carried(decoder, bytes + i, n_bytes - i, batch);
        else
            i += decode_words(decoder, bytes + i, n_words, batch) * word_bytes;
    }
    batch->reached_us = shef_evt_reached_us(decoder);
    decoder->stats.n_bytes += i;
    return i;
}

uint32_t shef_evt_finish(struct shef_evt_decoder *decoder)
{
    const uint32_t n_cut = decoder->n_carried;

    if (n_cut > 0)
        shef_evt_note(decoder, SHEF_EVT_CUT_WORD, 1);
    decoder->n_carried = 0;
    return n_cut;
}
