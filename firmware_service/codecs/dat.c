#include "codecs/dat.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "codecs/evt_word.h"
#include "codecs/text_header.h"

#define RECORD_BYTES 8

/* The byte after the header text that names the records. */
#define TYPE_EVENT_2D 0x00 /* written by old tools for change events */
#define TYPE_CD       0x0c
#define TYPE_TRIGGER  0x0e

/* How many records of a file without a header must make sense. */
#define N_RECORDS_TO_BELIEVE   64
#define MAX_BELIEVABLE_SIDE_PX 2048

/* Event times step back by less than this, and wrap by more. */
#define HALF_RANGE_US ((uint32_t)1 << 31)

static bool take_number(const struct shef_text_line *line, const char *key, uint32_t *out_number)
{
    if (strcmp(line->key, key) != 0)
        return false;
    if (!shef_text_number(line->value, out_number))
        *out_number = 0;
    return true;
}

static bool records_make_sense(const uint8_t *bytes, size_t n_bytes)
{
    const size_t n_records = n_bytes / RECORD_BYTES;
    uint32_t last_us = 0;

    for (size_t i = 0; i < n_records && i < N_RECORDS_TO_BELIEVE; i++) {
        const uint32_t t_us = shef_load_u32(bytes + i * RECORD_BYTES);
        const uint32_t address = shef_load_u32(bytes + i * RECORD_BYTES + 4);

        if (t_us < last_us || (address & 0x3fff) >= MAX_BELIEVABLE_SIDE_PX ||
            (address >> 14 & 0x3fff) >= MAX_BELIEVABLE_SIDE_PX || address >> 28 > 1)
            return false;
        last_us = t_us;
    }
    return n_records > 0;
}

static enum shef_err take_type(struct shef_dat_header *header, const uint8_t *bytes, size_t n_bytes,
                               struct shef_error *err)
{
    if (n_bytes < header->n_bytes + 2)
        return shef_fail(err, SHEF_ERR_FORMAT, "the file ends inside its header; it is not whole");

    const uint8_t type = bytes[header->n_bytes];
    const uint8_t record_bytes = bytes[header->n_bytes + 1];

    if (type != TYPE_EVENT_2D && type != TYPE_CD && type != TYPE_TRIGGER)
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "DAT records of type %u cannot be read, only change events (0, 12) and "
                         "triggers (14)",
                         type);
    if (record_bytes != RECORD_BYTES)
        return shef_fail(err, SHEF_ERR_FORMAT, "DAT records of %u bytes, where 8 are expected",
                         record_bytes);
    header->content = type == TYPE_TRIGGER ? SHEF_DAT_TRIGGERS : SHEF_DAT_EVENTS;
    header->n_bytes += 2;
    return SHEF_OK;
}

static bool is_possible_side(uint32_t side_px)
{
    return side_px >= 1 && side_px <= SHEF_DAT_MAX_SIDE_PX;
}

enum shef_err shef_dat_header_parse(const uint8_t *bytes, size_t n_bytes,
                                    struct shef_dat_header *out_header, struct shef_error *err)
{
    struct shef_dat_header header = { .version = 2 };
    struct shef_text_line line;
    bool has_width = false;
    bool has_height = false;
    uint32_t width_px = 0;
    uint32_t height_px = 0;

    while (shef_text_header_next(bytes, n_bytes, &header.n_bytes, &line)) {
        take_number(&line, "Version", &header.version);
        has_width |= take_number(&line, "Width", &width_px);
        has_height |= take_number(&line, "Height", &height_px);
        if (strcmp(line.key, "Date") == 0)
            memcpy(header.date, line.value, sizeof line.value);
    }
    if (shef_text_header_is_cut(bytes, n_bytes, header.n_bytes))
        return shef_fail(err, SHEF_ERR_FORMAT, "the file ends inside its header; it is not whole");
    if (header.n_bytes == 0 && !records_make_sense(bytes, n_bytes))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "not a DAT recording: no header lines '%% key value', and the bytes are "
                         "no event records either");
    if (header.n_bytes > 0) {
        const enum shef_err code = take_type(&header, bytes, n_bytes, err);

        if (code != SHEF_OK)
            return code;
    }
    if (header.version != 1 && header.version != 2)
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "DAT version %u cannot be read, only versions 1 and 2", header.version);
    header.has_size = is_possible_side(width_px) && is_possible_side(height_px);
    header.absurd_size = (has_width || has_height) && !header.has_size;
    header.width_px = header.has_size ? width_px : SHEF_DAT_MAX_SIDE_PX;
    header.height_px = header.has_size ? height_px : SHEF_DAT_MAX_SIDE_PX;
    *out_header = header;
    return SHEF_OK;
}

size_t shef_dat_header_write(const struct shef_dat_header *header,
                             uint8_t out_bytes[SHEF_DAT_HEADER_BYTES])
{
    char text[SHEF_DAT_HEADER_BYTES - 2];
    const bool is_trigger = header->content == SHEF_DAT_TRIGGERS;
    const int n = snprintf(text, sizeof text,
                           "%% Data file containing %s events.\n%% Version 2\n%% Date %s\n"
                           "%% Height %u\n%% Width %u\n",
                           is_trigger ? "external trigger" : "CD", header->date, header->height_px,
                           header->width_px);

    assert(n > 0 && (size_t)n < sizeof text);
    memcpy(out_bytes, text, (size_t)n);
    out_bytes[n] = is_trigger ? TYPE_TRIGGER : TYPE_CD;
    out_bytes[n + 1] = RECORD_BYTES;
    return (size_t)n + 2;
}

void shef_dat_init(struct shef_dat_decoder *decoder, const struct shef_dat_header *header)
{
    *decoder = (struct shef_dat_decoder){ .header = *header };
}

/* Where a record's time lies, and the multiple of 2^32 us that goes with it. */
static int64_t time_of(const struct shef_dat_decoder *decoder, uint32_t t_us, int64_t *out_epoch_us)
{
    *out_epoch_us = decoder->epoch_us;
    if (decoder->started && t_us < decoder->last_us && decoder->last_us - t_us > HALF_RANGE_US)
        *out_epoch_us += (int64_t)1 << 32;
    else if (t_us > decoder->last_us && t_us - decoder->last_us > HALF_RANGE_US &&
             decoder->epoch_us > 0)
        *out_epoch_us -= (int64_t)1 << 32; /* a straggler from before the wrap */
    return *out_epoch_us + t_us;
}

/* Whether the batch can take a record at this time. Sets its base if it is empty. */
static bool is_ready(struct shef_event_batch *batch, int64_t time_us)
{
    if (batch->n_events == 0)
        batch->base_us = time_us - (1 << SHEF_EVT3_LOW_BITS);
    return batch->n_events < batch->capacity && batch->n_triggers < SHEF_BATCH_TRIGGERS &&
           time_us >= batch->base_us && time_us - batch->base_us <= UINT32_MAX;
}

static void put_event(struct shef_dat_decoder *decoder, struct shef_event_batch *batch,
                      int64_t time_us, uint32_t address)
{
    const bool is_old = decoder->header.version == 1;
    const uint32_t x_px = is_old ? address & 0x1ff : address & 0x3fff;
    const uint32_t y_px = is_old ? address >> 9 & 0xff : address >> 14 & 0x3fff;
    const uint32_t polarity = is_old ? address >> 17 & 1 : address >> 28;

    if (x_px >= decoder->header.width_px || y_px >= decoder->header.height_px) {
        decoder->stats.n_violations[SHEF_EVT_OUTSIDE]++;
        return;
    }
    batch->events[batch->n_events++] =
        shef_event_make((uint32_t)(time_us - batch->base_us), x_px, y_px, (polarity & 1) != 0);
    decoder->stats.n_events++;
}

static void put_trigger(struct shef_dat_decoder *decoder, struct shef_event_batch *batch,
                        int64_t time_us, uint32_t word)
{
    const uint32_t channel = word >> 26;

    if (channel > 31) {
        decoder->stats.n_violations[SHEF_EVT_UNKNOWN_WORD]++;
        return;
    }
    batch->triggers[batch->n_triggers++] = (struct shef_trigger){
        .t_us = time_us,
        .n_before = batch->n_events,
        .channel = (uint8_t)channel,
        .rising = (word & 1) != 0,
    };
    decoder->stats.n_triggers++;
}

/* Takes one record, or returns false if the batch must be used first. */
static bool take_record(struct shef_dat_decoder *decoder, const uint8_t *record,
                        struct shef_event_batch *batch)
{
    const uint32_t t_us = shef_load_u32(record);
    int64_t epoch_us;
    const int64_t time_us = time_of(decoder, t_us, &epoch_us);

    if (!is_ready(batch, time_us))
        return false;
    if (decoder->started) {
        const int64_t last_us = decoder->epoch_us + decoder->last_us;

        decoder->stats.n_violations[SHEF_EVT_TIME_BACK] += time_us < last_us;
        decoder->stats.n_wraps += epoch_us > decoder->epoch_us;
    }
    decoder->epoch_us = epoch_us;
    decoder->last_us = t_us;
    decoder->started = true;
    decoder->stats.n_words++;
    if (decoder->header.content == SHEF_DAT_TRIGGERS)
        put_trigger(decoder, batch, time_us, shef_load_u32(record + 4));
    else
        put_event(decoder, batch, time_us, shef_load_u32(record + 4));
    return true;
}

/* Takes version 2 events for as long as time goes on within the batch's reach and places lie inside
 * the sensor. Returns how many; take_record() takes the next one. */
static size_t take_ordinary(struct shef_dat_decoder *decoder, const uint8_t *records,
                            size_t n_records, struct shef_event_batch *batch)
{
    const uint32_t width_px = decoder->header.width_px;
    const uint32_t height_px = decoder->header.height_px;
    struct shef_event *const out = batch->events + batch->n_events;
    const size_t n_room = batch->capacity - batch->n_events;
    const int64_t offset_us = decoder->epoch_us - batch->base_us;
    uint32_t last_us = decoder->last_us;
    size_t i = 0;

    if (decoder->header.content != SHEF_DAT_EVENTS || decoder->header.version != 2 ||
        batch->n_events == 0 || offset_us + last_us < 0)
        return 0;
    if (n_records > n_room)
        n_records = n_room;
    for (; i < n_records; i++) {
        const uint32_t t_us = shef_load_u32(records + i * RECORD_BYTES);
        const uint32_t address = shef_load_u32(records + i * RECORD_BYTES + 4);
        const uint32_t x_px = address & 0x3fff;
        const uint32_t y_px = address >> 14 & 0x3fff;

        if (t_us < last_us || t_us - last_us > HALF_RANGE_US || offset_us + t_us > UINT32_MAX ||
            x_px >= width_px || y_px >= height_px)
            break;
        out[i] =
            shef_event_make((uint32_t)(offset_us + t_us), x_px, y_px, (address >> 28 & 1) != 0);
        last_us = t_us;
    }
    decoder->last_us = last_us;
    decoder->stats.n_words += i;
    decoder->stats.n_events += i;
    batch->n_events += (uint32_t)i;
    return i;
}

size_t shef_dat_decode(struct shef_dat_decoder *decoder, const uint8_t *bytes, size_t n_bytes,
                       struct shef_event_batch *batch)
{
    size_t i = 0;

    assert(batch->capacity >= 1);
    while (i < n_bytes) {
        if (decoder->n_carried == 0 && n_bytes - i >= RECORD_BYTES) {
            i += take_ordinary(decoder, bytes + i, (n_bytes - i) / RECORD_BYTES, batch) *
                 RECORD_BYTES;
            if (n_bytes - i < RECORD_BYTES)
                continue;
            if (!take_record(decoder, bytes + i, batch))
                break;
            i += RECORD_BYTES;
            continue;
        }
        /* The last byte is not taken before its record fits. */
        decoder->carried[decoder->n_carried] = bytes[i];
        if (decoder->n_carried + 1 < RECORD_BYTES) {
            decoder->n_carried++;
        } else {
            if (!take_record(decoder, decoder->carried, batch))
                break;
            decoder->n_carried = 0;
        }
        i++;
    }
    batch->reached_us = decoder->epoch_us + decoder->last_us;
    decoder->stats.n_bytes += i;
    return i;
}

uint32_t shef_dat_finish(struct shef_dat_decoder *decoder)
{
    const uint32_t n_cut = decoder->n_carried;

    decoder->stats.n_violations[SHEF_EVT_CUT_WORD] += n_cut > 0;
    decoder->n_carried = 0;
    return n_cut;
}

static void put_record(uint8_t *out_bytes, int64_t time_us, uint32_t word)
{
    const uint32_t t_us = (uint32_t)time_us;

    memcpy(out_bytes, &t_us, sizeof t_us);
    memcpy(out_bytes + 4, &word, sizeof word);
}

size_t shef_dat_encode(enum shef_dat_content content, const struct shef_event_batch *batch,
                       uint8_t *out_bytes)
{
    if (content == SHEF_DAT_TRIGGERS) {
        for (uint32_t i = 0; i < batch->n_triggers; i++) {
            const struct shef_trigger trigger = batch->triggers[i];

            put_record(out_bytes + (size_t)i * RECORD_BYTES, trigger.t_us,
                       (uint32_t)trigger.channel << 26 | trigger.rising);
        }
        return (size_t)batch->n_triggers * RECORD_BYTES;
    }
    for (uint32_t i = 0; i < batch->n_events; i++) {
        const struct shef_event event = batch->events[i];

        put_record(out_bytes + (size_t)i * RECORD_BYTES, shef_event_batch_time_us(batch, i),
                   event.x_px | (uint32_t)shef_event_y_px(event) << 14 |
                       (uint32_t)shef_event_is_on(event) << 28);
    }
    return (size_t)batch->n_events * RECORD_BYTES;
}
