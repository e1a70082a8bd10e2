#include "two_ways.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "codecs/evt_encode.h"
#include "core/cpu.h"

#define MAX_BATCH 1024

#define DEMAND(condition)                                                                          \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

/* All that came out, as numbers that depend on order. */
struct summary {
    uint64_t n_events;
    uint64_t n_triggers;
    uint64_t events;
    uint64_t triggers;
};

struct setting {
    enum shef_evt_format format;
    uint32_t width_px;
    uint32_t height_px;
    size_t slice_bytes;
    uint32_t batch_events;
    uint32_t features;
    bool through_state; /* hand over to a second decoder half-way */
};

static uint64_t mix(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * 0x9e3779b97f4a7c15;
    return hash ^ hash >> 29;
}

static void add(struct summary *summary, const struct shef_event_batch *batch,
                const struct setting *setting)
{
    for (uint32_t i = 0; i < batch->n_triggers; i++) {
        const struct shef_trigger *trigger = &batch->triggers[i];

        DEMAND(trigger->n_before <= batch->n_events && trigger->channel < 32);
        summary->triggers = mix(summary->triggers, (uint64_t)trigger->t_us);
        summary->triggers = mix(summary->triggers, summary->n_events + trigger->n_before);
        summary->triggers = mix(summary->triggers, trigger->channel * 2u + trigger->rising);
    }
    for (uint32_t i = 0; i < batch->n_events; i++) {
        const struct shef_event event = batch->events[i];

        DEMAND(event.x_px < setting->width_px && shef_event_y_px(event) < setting->height_px);
        summary->events = mix(summary->events, (uint64_t)shef_event_batch_time_us(batch, i));
        summary->events = mix(summary->events, (uint64_t)event.x_px << 16 | event.y_on);
    }
    summary->n_events += batch->n_events;
    summary->n_triggers += batch->n_triggers;
}

/* Encodes what a decoder gives, and decodes it at once. */
struct echo {
    struct shef_evt_encoder encoder;
    struct shef_evt_decoder decoder;
    bool started;
    bool refused; /* something that the format cannot say; nothing is compared from there on */
    struct summary before;
    struct summary after;
};

static void echo_decode(struct echo *echo, const uint8_t *bytes, size_t n_bytes,
                        const struct setting *setting)
{
    static struct shef_event events[MAX_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = MAX_BATCH };
    size_t at = 0;

    while (at < n_bytes) {
        at += shef_evt_decode(&echo->decoder, bytes + at, n_bytes - at, &batch);
        add(&echo->after, &batch, setting);
        shef_event_batch_clear(&batch);
    }
}

static void echo_add(struct echo *echo, const struct shef_event_batch *batch,
                     const struct setting *setting)
{
    uint8_t bytes[4096];
    size_t n_bytes;
    enum shef_err code;

    if (echo->refused || (batch->n_events == 0 && batch->n_triggers == 0))
        return;
    if (!echo->started) {
        const int64_t first_us = batch->n_triggers > 0 && batch->triggers[0].n_before == 0
                                     ? batch->triggers[0].t_us
                                     : shef_event_batch_time_us(batch, 0);

        shef_evt_encoder_init(&echo->encoder, setting->format, SHEF_EVT_TICKS_SPARSE,
                              setting->width_px, setting->height_px);
        shef_evt_init(&echo->decoder, setting->format, setting->width_px, setting->height_px,
                      first_us, setting->features);
        echo->started = true;
    }
    do {
        code = shef_evt_encode(&echo->encoder, batch, bytes, sizeof bytes, &n_bytes);
        echo_decode(echo, bytes, n_bytes, setting);
    } while (code == SHEF_ERR_FULL);
    if (code == SHEF_ERR_INVALID)
        echo->refused = true;
    else
        add(&echo->before, batch, setting);
}

static struct shef_evt_stats decode(struct setting setting, const uint8_t *bytes, size_t n_bytes,
                                    struct summary *out_summary, struct echo *echo)
{
    static struct shef_event events[MAX_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = setting.batch_events };
    struct shef_evt_decoder decoder;
    struct shef_evt_stats earlier = { 0 };
    size_t at = 0;

    *out_summary = (struct summary){ 0 };
    shef_evt_init(&decoder, setting.format, setting.width_px, setting.height_px, 0,
                  setting.features);
    while (at < n_bytes) {
        const size_t n_left = n_bytes - at;
        const size_t n = n_left < setting.slice_bytes ? n_left : setting.slice_bytes;
        const size_t n_taken = shef_evt_decode(&decoder, bytes + at, n, &batch);

        DEMAND(n_taken == n || batch.n_events > 0 || batch.n_triggers > 0);
        at += n_taken;
        if (n_taken < n || at == n_bytes) {
            add(out_summary, &batch, &setting);
            if (echo)
                echo_add(echo, &batch, &setting);
            shef_event_batch_clear(&batch);
        }
        if (setting.through_state && at >= n_bytes / 2 && !decoder.sync.hunting) {
            uint8_t state[SHEF_EVT_STATE_BYTES];

            shef_evt_save(&decoder, state);
            earlier = decoder.stats;
            shef_evt_init(&decoder, setting.format, setting.width_px, setting.height_px, 0,
                          setting.features);
            DEMAND(shef_evt_restore(&decoder, state, NULL) == SHEF_OK);
            setting.through_state = false;
        }
    }
    shef_evt_finish(&decoder);
    decoder.stats.n_events += earlier.n_events;
    DEMAND(decoder.stats.n_events == out_summary->n_events);
    return decoder.stats;
}

void decode_two_ways(enum shef_evt_format format, const uint8_t *bytes, size_t n_bytes)
{
    static const uint32_t widths_px[] = { 2048, 1280, 640, 40 };
    struct setting setting = {
        .format = format,
        .slice_bytes = SIZE_MAX,
        .batch_events = MAX_BATCH,
        .features = shef_cpu_features(),
    };
    struct summary whole;
    struct summary sliced;
    struct echo echo = { 0 };

    if (n_bytes < 4)
        return;
    setting.width_px = widths_px[bytes[0] % 4];
    setting.height_px = bytes[1] % 2 ? 2048 : 480;
    const struct shef_evt_stats expected = decode(setting, bytes + 4, n_bytes - 4, &whole, &echo);

    DEMAND(memcmp(&echo.before, &echo.after, sizeof echo.before) == 0 || echo.refused);

    setting.slice_bytes = bytes[2] + 1u;
    setting.batch_events = SHEF_EVT_MIN_ROOM + bytes[3];
    setting.features = SHEF_CPU_NONE;
    const struct shef_evt_stats actual = decode(setting, bytes + 4, n_bytes - 4, &sliced, NULL);

    DEMAND(memcmp(&whole, &sliced, sizeof whole) == 0);
    DEMAND(memcmp(&expected, &actual, sizeof expected) == 0);

    /* A saved state knows nothing of earlier trouble, so only undamaged streams must agree. */
    setting.through_state = true;
    decode(setting, bytes + 4, n_bytes - 4, &sliced, NULL);
    DEMAND(memcmp(&whole, &sliced, sizeof whole) == 0 || expected.n_resyncs > 0 ||
           expected.n_bytes_skipped > 0 || expected.n_violations[SHEF_EVT_UNKNOWN_WORD] > 0 ||
           expected.n_violations[SHEF_EVT_TIME_GAP] > 0 ||
           expected.n_violations[SHEF_EVT_TIME_BACK] > 0);
}
