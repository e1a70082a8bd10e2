#include <stdlib.h>
#include <string.h>

#include "codecs/dat.h"

#define MAX_BATCH 256

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void demand(int condition)
{
    if (!condition)
        abort();
}

/* Decodes all records; what came out, as a number that depends on order. */
static uint64_t decode(const struct shef_dat_header *header, const uint8_t *bytes, size_t n_bytes,
                       size_t slice_bytes, uint32_t batch_events, struct shef_evt_stats *out_stats)
{
    struct shef_event events[MAX_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = batch_events };
    struct shef_dat_decoder decoder;
    uint64_t hash = 0;
    size_t at = header->n_bytes;

    shef_dat_init(&decoder, header);
    while (at < n_bytes) {
        const size_t n_left = n_bytes - at;
        const size_t n = n_left < slice_bytes ? n_left : slice_bytes;
        const size_t n_taken = shef_dat_decode(&decoder, bytes + at, n, &batch);

        demand(n_taken == n || batch.n_events > 0 || batch.n_triggers > 0);
        at += n_taken;
        for (uint32_t i = 0; i < batch.n_events; i++) {
            demand(events[i].x_px < header->width_px);
            demand(shef_event_y_px(events[i]) < header->height_px);
            hash = hash * 31 + (uint64_t)shef_event_batch_time_us(&batch, i);
            hash = hash * 31 + ((uint64_t)events[i].x_px << 16 | events[i].y_on);
        }
        for (uint32_t i = 0; i < batch.n_triggers; i++) {
            hash = hash * 31 + (uint64_t)batch.triggers[i].t_us;
            hash = hash * 31 + batch.triggers[i].channel * 2u + batch.triggers[i].rising;
        }
        shef_event_batch_clear(&batch);
    }
    shef_dat_finish(&decoder);
    *out_stats = decoder.stats;
    return hash;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_dat_header header;
    struct shef_evt_stats whole_stats;
    struct shef_evt_stats sliced_stats;
    struct shef_error err = { 0 };

    if (shef_dat_header_parse(bytes, n_bytes, &header, &err) != SHEF_OK) {
        demand(err.code != SHEF_OK && err.text[0] != '\0');
        return 0;
    }
    demand(header.n_bytes <= n_bytes);

    const size_t slice_bytes = bytes[n_bytes - 1] % 32 + 1u;
    const uint64_t whole = decode(&header, bytes, n_bytes, SIZE_MAX, MAX_BATCH, &whole_stats);
    const uint64_t sliced = decode(&header, bytes, n_bytes, slice_bytes, 1, &sliced_stats);

    demand(whole == sliced);
    demand(memcmp(&whole_stats, &sliced_stats, sizeof whole_stats) == 0);
    return 0;
}
