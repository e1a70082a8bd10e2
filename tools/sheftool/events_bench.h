/* What `events bench` measures: decoders per instruction set, the filter, and both together.
 *
 * Events are decoded from memory into batches that fit the L2 cache, and every field of every
 * event enters a checksum, which must be the same for all. Thread: main. */
#ifndef SHEFTOOL_EVENTS_BENCH_H
#define SHEFTOOL_EVENTS_BENCH_H

#include <jansson.h>
#include <stdint.h>

#include "codecs/evt.h"
#include "core/error.h"
#include "sheftool/bench.h"

/* A stream in one format. */
struct shef_bench_stream {
    enum shef_evt_format format;
    uint8_t *bytes; /* owned */
    size_t n_bytes;
};

/* The same events in every form that a case needs. */
struct shef_events_material {
    uint32_t width_px;
    uint32_t height_px;
    struct shef_event *events; /* owned; times count from base_us */
    uint32_t n_events;
    int64_t base_us;
    struct shef_event *shuffled;         /* owned: as many events of random pixels */
    struct shef_bench_stream streams[3]; /* EVT2, EVT2.1, EVT3 */
};

/* Decodes a RAW file, up to max_events, and encodes its events in the two other formats; its own
 * bytes stay as they are. */
SHEF_MUST_CHECK enum shef_err shef_events_material_load(struct shef_events_material *material,
                                                        const char *path, uint32_t max_events,
                                                        struct shef_error *err);

/* Makes n_events of a synthetic VGA scene of moving edges, 20 Mev/s. */
SHEF_MUST_CHECK enum shef_err shef_events_material_make(struct shef_events_material *material,
                                                        uint32_t n_events, struct shef_error *err);

/* A zeroed material is allowed. */
void shef_events_material_free(struct shef_events_material *material);

/* Adds decode-evt2, decode-evt21, decode-evt3 for every instruction set, filter, filter-random
 * and evt3-to-filter. The material outlives the bench. */
SHEF_MUST_CHECK enum shef_err shef_bench_add_events(struct shef_bench *bench,
                                                    const struct shef_events_material *material,
                                                    uint32_t cpu_features, struct shef_error *err);

/* Whether all decoders of a format agreed on its events.
 * SHEF_ERR_INVALID: the sentence names the case that did not. */
SHEF_MUST_CHECK enum shef_err shef_bench_check_events(const struct shef_bench *bench,
                                                      struct shef_error *err);

/* A list of {name, isa, median_ms, p95_ms, min_ms, cpu_median_ms, mev_per_s, n_events,
 * bytes_per_event}; mev_per_s: millions of events a second of the shortest time. */
json_t *shef_bench_events_json(struct shef_bench *bench);

#endif
