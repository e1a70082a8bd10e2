#include "sheftool/events_bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "pipeline/filter.h"

static const char *const isas[] = { "c", "avx2", "avx512", "neon" };

#define N_ISAS ((int)(sizeof isas / sizeof isas[0]))

/* What a case works on. Cases without a filter only decode, those without a stream only filter. */
struct state {
    const struct shef_events_material *material;
    const struct shef_bench_stream *stream;
    const struct shef_event *events; /* for the filter, without a stream */
    uint32_t features;
    struct shef_filter *filter;
    int64_t base_us;   /* moves on with every run, so that time never steps back */
    uint64_t n_events; /* of the last run */
    uint64_t checksum;
    _Alignas(64) struct shef_event batch[SHEF_BATCH_EVENTS];
};

static void destroy(void *opaque)
{
    struct state *state = opaque;

    shef_filter_destroy(state->filter);
    free(state);
}

/* Each field enters the sum, and where batches end does not. */
static uint64_t sum_of(const struct shef_event_batch *batch)
{
    uint64_t sum = (uint64_t)batch->base_us * batch->n_events;

    for (uint32_t i = 0; i < batch->n_events; i++) {
        uint64_t bits;

        memcpy(&bits, &batch->events[i], sizeof bits);
        sum += bits;
    }
    return sum;
}

static void filter_all(struct state *state, const struct shef_event *events, uint32_t n,
                       int64_t base_us)
{
    const shef_event_time never = { INT64_MAX };

    for (uint32_t at = 0; at < n;)
        at += shef_filter_apply(state->filter, events + at, n - at, base_us, never);
}

static enum shef_err run_stream(void *opaque, const struct shef_bench_pair *pair, int64_t number,
                                struct shef_error *err)
{
    struct state *state = opaque;
    struct shef_event_batch batch = { .events = state->batch, .capacity = SHEF_BATCH_EVENTS };
    struct shef_evt_decoder decoder;

    (void)pair;
    (void)number;
    (void)err;
    shef_evt_init(&decoder, state->stream->format, state->material->width_px,
                  state->material->height_px, 0, state->features);
    state->n_events = 0;
    state->checksum = 0;
    for (size_t at = 0; at < state->stream->n_bytes;) {
        at += shef_evt_decode(&decoder, state->stream->bytes + at, state->stream->n_bytes - at,
                              &batch);
        if (state->filter)
            filter_all(state, batch.events, batch.n_events, batch.base_us + state->base_us);
        else
            state->checksum += sum_of(&batch);
        state->n_events += batch.n_events;
        shef_event_batch_clear(&batch);
    }
    state->base_us += shef_evt_reached_us(&decoder) + 1;
    return SHEF_OK;
}

static enum shef_err run_filter(void *opaque, const struct shef_bench_pair *pair, int64_t number,
                                struct shef_error *err)
{
    struct state *state = opaque;
    const uint32_t n = state->material->n_events;

    (void)pair;
    (void)number;
    (void)err;
    for (uint32_t at = 0; at < n; at += SHEF_BATCH_EVENTS)
        filter_all(state, state->events + at,
                   n - at < SHEF_BATCH_EVENTS ? n - at : SHEF_BATCH_EVENTS, state->base_us);
    state->n_events = n;
    state->base_us += state->events[n - 1].t_us + 1;
    return SHEF_OK;
}

/* Adds a case. Gives its state for what is special about it, or NULL. */
static struct state *add(struct shef_bench *bench, const struct shef_events_material *material,
                         const char *name, const char *isa, bool with_filter, uint32_t features,
                         struct shef_error *err)
{
    struct state *state = aligned_alloc(64, (sizeof *state + 63) / 64 * 64);
    const struct shef_filter_params params =
        shef_filter_default_params((int32_t)material->width_px, (int32_t)material->height_px);
    struct shef_bench_case one = { .state = state, .run = run_stream, .destroy = destroy };

    if (!state) {
        shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
        return NULL;
    }
    *state = (struct state){ .material = material, .features = features };
    if (with_filter && shef_filter_create(&state->filter, &params, features, err) != SHEF_OK) {
        free(state);
        return NULL;
    }
    snprintf(one.name, sizeof one.name, "%s", name);
    snprintf(one.isa, sizeof one.isa, "%s", isa);
    shef_bench_add(bench, &one);
    return state;
}

static enum shef_err add_decoders(struct shef_bench *bench,
                                  const struct shef_events_material *material,
                                  uint32_t cpu_features, struct shef_error *err)
{
    static const char *const names[] = { "decode-evt2", "decode-evt21", "decode-evt3" };

    for (int i = 0; i < 3; i++)
        for (int k = 0; k < N_ISAS; k++) {
            const uint32_t features = shef_cpu_features_of(isas[k]);

            if ((features & cpu_features) != features)
                continue;

            struct state *state = add(bench, material, names[i], isas[k], false, features, err);

            if (!state)
                return SHEF_ERR_NO_MEMORY;
            state->stream = &material->streams[i];
        }
    return SHEF_OK;
}

static enum shef_err add_filters(struct shef_bench *bench,
                                 const struct shef_events_material *material, uint32_t cpu_features,
                                 struct shef_error *err)
{
    const char *isa = shef_cpu_isa_name(cpu_features);
    const struct shef_event *const events[] = { material->events, material->shuffled };
    static const char *const names[] = { "filter", "filter-random" };

    for (int i = 0; i < 2; i++) {
        struct state *state = add(bench, material, names[i], isa, true, cpu_features, err);

        if (!state)
            return SHEF_ERR_NO_MEMORY;
        state->events = events[i];
        bench->cases[bench->n - 1].run = run_filter;
    }

    struct state *state = add(bench, material, "evt3-to-filter", isa, true, cpu_features, err);

    if (!state)
        return SHEF_ERR_NO_MEMORY;
    state->stream = &material->streams[2];
    return SHEF_OK;
}

enum shef_err shef_bench_add_events(struct shef_bench *bench,
                                    const struct shef_events_material *material,
                                    uint32_t cpu_features, struct shef_error *err)
{
    const enum shef_err code = add_decoders(bench, material, cpu_features, err);

    return code == SHEF_OK ? add_filters(bench, material, cpu_features, err) : code;
}

enum shef_err shef_bench_check_events(const struct shef_bench *bench, struct shef_error *err)
{
    for (int32_t i = 1; i < bench->n; i++) {
        const struct shef_bench_case *before = &bench->cases[i - 1];
        const struct shef_bench_case *one = &bench->cases[i];
        const struct state *expected = before->state;
        const struct state *actual = one->state;

        if (strcmp(before->name, one->name) != 0 || actual->filter)
            continue;
        if (expected->checksum != actual->checksum || expected->n_events != actual->n_events)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "%s with %s gives other events than with %s: this build is broken",
                             one->name, one->isa, before->isa);
    }
    return SHEF_OK;
}

json_t *shef_bench_events_json(struct shef_bench *bench)
{
    json_t *list = json_array();

    for (int32_t i = 0; i < bench->n; i++) {
        struct shef_bench_case *one = &bench->cases[i];
        const struct state *state = one->state;
        const struct shef_timing_summary wall = shef_timings_summary(&one->wall);
        const double n_events = (double)state->n_events;

        json_array_append_new(
            list, json_pack("{s:s, s:s, s:f, s:f, s:f, s:f, s:o, s:I, s:o}", "name", one->name,
                            "isa", one->isa, "median_ms", wall.median_ms, "p95_ms", wall.p95_ms,
                            "min_ms", wall.min_ms, "cpu_median_ms",
                            shef_timings_summary(&one->cpu).median_ms, "mev_per_s",
                            wall.min_ms > 0 ? json_real(n_events / wall.min_ms / 1e3) : json_null(),
                            "n_events", (json_int_t)state->n_events, "bytes_per_event",
                            state->stream ? json_real((double)state->stream->n_bytes / n_events)
                                          : json_null()));
    }
    return list;
}
