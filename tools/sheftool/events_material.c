/* The events that `events bench` runs on. */
#include <stdlib.h>
#include <string.h>

#include "codecs/evt_encode.h"
#include "codecs/raw_header.h"
#include "core/cpu.h"
#include "core/file.h"
#include "core/memory.h"
#include "sheftool/events_bench.h"

#define MAX_FILE_BYTES ((size_t)1 << 30)
#define ROOM_BYTES     (1u << 16)

/* SplitMix64, as in tests/support: repeatable without a state of its own. */
static uint64_t mixed(uint64_t i)
{
    uint64_t z = i * UINT64_C(0x9e3779b97f4a7c15);

    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

static enum shef_err fail_memory(struct shef_error *err)
{
    return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
}

static enum shef_err append(struct shef_bench_stream *stream, size_t *capacity,
                            const uint8_t *bytes, size_t n_bytes, struct shef_error *err)
{
    if (stream->n_bytes + n_bytes > *capacity) {
        const size_t larger = 2 * (stream->n_bytes + n_bytes);
        uint8_t *grown = realloc(stream->bytes, larger);

        if (!grown)
            return fail_memory(err);
        stream->bytes = grown;
        *capacity = larger;
    }
    memcpy(stream->bytes + stream->n_bytes, bytes, n_bytes);
    stream->n_bytes += n_bytes;
    return SHEF_OK;
}

/* Encodes all events as a sensor would send them. */
static enum shef_err encode(const struct shef_events_material *material,
                            struct shef_bench_stream *stream, struct shef_error *err)
{
    struct shef_event_batch batch = {
        .events = material->events,
        .capacity = material->n_events,
        .n_events = material->n_events,
        .base_us = material->base_us,
    };
    struct shef_evt_encoder encoder;
    uint8_t *room = malloc(ROOM_BYTES);
    size_t capacity = 0;
    enum shef_err code = room ? SHEF_ERR_FULL : fail_memory(err);

    if (material->n_events > 0)
        batch.reached_us = shef_event_batch_time_us(&batch, material->n_events - 1);
    shef_evt_encoder_init(&encoder, stream->format, SHEF_EVT_TICKS_SENSOR, material->width_px,
                          material->height_px);
    while (code == SHEF_ERR_FULL) {
        size_t n_bytes;

        code = shef_evt_encode(&encoder, &batch, room, ROOM_BYTES, &n_bytes);
        if (code == SHEF_ERR_INVALID) {
            shef_fail(err, code, "bench: %s cannot hold these events; name another file",
                      shef_evt_format_name(stream->format));
            break;
        }

        const enum shef_err append_code = append(stream, &capacity, room, n_bytes, err);

        code = append_code == SHEF_OK ? code : append_code;
    }
    free(room);
    return code;
}

/* Fills in what follows from the events: random pixels, and the streams that are missing. */
static enum shef_err complete(struct shef_events_material *material, struct shef_error *err)
{
    static const enum shef_evt_format formats[] = { SHEF_EVT2, SHEF_EVT21, SHEF_EVT3 };
    enum shef_err code = SHEF_OK;

    material->shuffled = shef_memory_create(material->n_events, sizeof *material->shuffled);
    if (!material->shuffled)
        return fail_memory(err);
    for (uint32_t i = 0; i < material->n_events; i++) {
        const uint64_t bits = mixed(i + 1);

        material->shuffled[i] =
            shef_event_make(material->events[i].t_us, (uint32_t)(bits % material->width_px),
                            (uint32_t)((bits >> 24) % material->height_px), bits >> 63);
    }
    for (int i = 0; code == SHEF_OK && i < 3; i++) {
        material->streams[i].format =
            material->streams[i].bytes ? material->streams[i].format : formats[i];
        if (!material->streams[i].bytes)
            code = encode(material, &material->streams[i], err);
    }
    return code;
}

/* Decodes the file's own stream; bytes after the last event wanted are dropped. */
static enum shef_err decode_own(struct shef_events_material *material,
                                struct shef_bench_stream *stream, uint32_t max_events,
                                struct shef_error *err)
{
    struct shef_event_batch batch = { .events =
                                          shef_memory_create(max_events, sizeof *batch.events),
                                      .capacity = max_events };
    struct shef_evt_decoder decoder;

    if (!batch.events)
        return fail_memory(err);
    material->events = batch.events;
    shef_evt_init(&decoder, stream->format, material->width_px, material->height_px, 0,
                  shef_cpu_features());
    /* Triggers end a batch; they are not measured here. */
    for (size_t at = 0; at < stream->n_bytes;) {
        const size_t n_taken =
            shef_evt_decode(&decoder, stream->bytes + at, stream->n_bytes - at, &batch);

        at += n_taken;
        if (n_taken == 0 && batch.n_triggers < SHEF_BATCH_TRIGGERS) {
            stream->n_bytes = at;
            break;
        }
        batch.n_triggers = 0;
    }
    material->n_events = batch.n_events;
    material->base_us = batch.base_us;
    return SHEF_OK;
}

enum shef_err shef_events_material_load(struct shef_events_material *material, const char *path,
                                        uint32_t max_events, struct shef_error *err)
{
    struct shef_raw_header header;
    uint8_t *bytes;
    size_t n_bytes;

    *material = (struct shef_events_material){ .n_events = 0 };

    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_raw_header_parse(bytes, n_bytes, &header, err);
    if (code != SHEF_OK) {
        free(bytes);
        return shef_fail_context(err, "bench runs on RAW files: '%s'", path);
    }

    struct shef_bench_stream *own = &material->streams[header.format == SHEF_EVT2   ? 0
                                                       : header.format == SHEF_EVT3 ? 2
                                                                                    : 1];

    memmove(bytes, bytes + header.n_bytes, n_bytes - header.n_bytes);
    *own = (struct shef_bench_stream){ header.format, bytes, n_bytes - header.n_bytes };
    material->width_px = header.width_px;
    material->height_px = header.height_px;
    code = decode_own(material, own, max_events, err);
    if (code == SHEF_OK && material->n_events == 0)
        code = shef_fail(err, SHEF_ERR_INVALID, "'%s' holds no events to measure with", path);
    if (code == SHEF_OK)
        code = complete(material, err);
    if (code != SHEF_OK)
        shef_events_material_free(material);
    return code;
}

enum shef_err shef_events_material_make(struct shef_events_material *material, uint32_t n_events,
                                        struct shef_error *err)
{
    *material = (struct shef_events_material){
        .width_px = 640,
        .height_px = 480,
        .events = shef_memory_create(n_events, sizeof *material->events),
        .n_events = n_events,
    };
    if (!material->events)
        return fail_memory(err);
    /* 24 upright edges that drift to the right. The sensor reads a row at a time: the events of
     * one instant share theirs. */
    for (uint32_t i = 0; i < n_events; i++) {
        const uint32_t row = (uint32_t)(mixed(i / 8) % 480);
        const uint32_t edge = (uint32_t)(mixed(~(uint64_t)i) % 24);

        material->events[i] =
            shef_event_make(i / 20, (edge * 27 + i / 8192) % 640, row, edge % 2 != 0);
    }

    const enum shef_err code = complete(material, err);

    if (code != SHEF_OK)
        shef_events_material_free(material);
    return code;
}

void shef_events_material_free(struct shef_events_material *material)
{
    for (int i = 0; i < 3; i++)
        free(material->streams[i].bytes);
    free(material->events);
    free(material->shuffled);
    *material = (struct shef_events_material){ .n_events = 0 };
}
