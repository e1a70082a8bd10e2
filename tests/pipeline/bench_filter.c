/* How fast the filter takes events, on one thread, and how fast memory would allow it to.
 *
 *   bench_filter             JSON lines: median, 95th percentile and best of the runs
 *
 * Streams: uniformly random pixels (the worst case for caches), vertical edges that move (runs of
 * neighbours in a column), and one hot column. `bare` only reads, changes and writes the eight
 * bytes of state, in the same order: no filter can be faster. Where the real recordings are, also
 * from their bytes in memory to the filter's state. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "codecs/evt.h"
#include "codecs/raw_header.h"
#include "core/cpu.h"
#include "core/file.h"
#include "core/memory.h"
#include "pipeline/filter.h"
#include "pipeline/kernels/decay.h"
#include "support/support.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480
#define N_EVENTS  (1u << 20)
#define BATCH     SHEF_BATCH_EVENTS
#define N_RUNS    41

static struct shef_event *events;
static struct shef_filter *filter;
static struct shef_decay_cell *cells;

static double now_ns(void)
{
    struct timespec t;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static void fill_random(struct shef_test_random *random)
{
    for (uint32_t i = 0; i < N_EVENTS; i++) {
        const uint64_t bits = shef_test_random_u64(random);

        events[i] = shef_event_make(i / 20, (uint32_t)(bits % WIDTH_PX),
                                    (uint32_t)((bits >> 20) % HEIGHT_PX), bits >> 63);
    }
}

/* 24 upright edges that drift to the right; their pixels fire in random order of rows. */
static void fill_edges(struct shef_test_random *random)
{
    for (uint32_t i = 0; i < N_EVENTS; i++) {
        const uint64_t bits = shef_test_random_u64(random);
        const uint32_t edge = (uint32_t)(bits % 24);
        const uint32_t x_px = (edge * 27 + i / 8192 + (uint32_t)((bits >> 8) % 2)) % WIDTH_PX;

        events[i] =
            shef_event_make(i / 20, x_px, (uint32_t)((bits >> 20) % HEIGHT_PX), edge % 2 != 0);
    }
}

static void fill_column(struct shef_test_random *random)
{
    for (uint32_t i = 0; i < N_EVENTS; i++) {
        const uint64_t bits = shef_test_random_u64(random);

        events[i] = shef_event_make(i / 20, 320, (uint32_t)(bits % HEIGHT_PX), bits >> 63);
    }
}

static void run_filter(int64_t base_us)
{
    for (uint32_t i = 0; i < N_EVENTS; i += BATCH)
        if (shef_filter_apply(filter, events + i, BATCH, base_us, (shef_event_time){ INT64_MAX }) !=
            BATCH)
            abort();
}

static void run_bare(int64_t base_us)
{
    static const int32_t steps[2] = { -SHEF_FILTER_LEVEL_STEP, SHEF_FILTER_LEVEL_STEP };

    for (uint32_t i = 0; i < N_EVENTS; i++) {
        const struct shef_event event = events[i];
        struct shef_decay_cell *cell =
            &cells[(uint32_t)shef_event_y_px(event) * WIDTH_PX + event.x_px];

        cell->level = (int32_t)((uint32_t)cell->level + (uint32_t)steps[event.y_on >> 15]);
        cell->t_us = event.t_us + (uint32_t)base_us;
    }
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

static void report(const char *what, const char *stream, double ns[N_RUNS])
{
    qsort(ns, N_RUNS, sizeof ns[0], compare);
    printf("{\"bench\": \"filter\", \"what\": \"%s\", \"stream\": \"%s\", \"ns_per_event\": "
           "{\"median\": %.3f, \"p95\": %.3f, \"min\": %.3f}, \"mev_per_s\": {\"median\": %.1f, "
           "\"best\": %.1f}}\n",
           what, stream, ns[N_RUNS / 2], ns[N_RUNS * 95 / 100], ns[0], 1e3 / ns[N_RUNS / 2],
           1e3 / ns[0]);
}

static void measure(const char *what, const char *stream, void (*run)(int64_t base_us))
{
    static int64_t base_us;
    double ns[N_RUNS];

    for (int i = 0; i < N_RUNS; i++) {
        const double start_ns = now_ns();

        run(base_us);
        ns[i] = (now_ns() - start_ns) / N_EVENTS;
        base_us += N_EVENTS / 20;
    }
    report(what, stream, ns);
}

/* Decodes a recording again and again, its time going on, and filters it. */
static void measure_recording(const char *name)
{
    struct shef_raw_header header;
    struct shef_filter *wide;
    struct shef_event_batch batch = { .events = events, .capacity = BATCH };
    uint8_t *bytes;
    size_t n_bytes;
    double ns[N_RUNS];
    char path[1024];

    snprintf(path, sizeof path, "%s/%s", shef_test_data("events"), name);
    if (shef_file_read(path, 1 << 26, &bytes, &n_bytes, NULL) != SHEF_OK)
        return;
    if (shef_raw_header_parse(bytes, n_bytes, &header, NULL) != SHEF_OK)
        abort();

    const struct shef_filter_params params =
        shef_filter_default_params((int32_t)header.width_px, (int32_t)header.height_px);

    if (shef_filter_create(&wide, &params, shef_cpu_features(), NULL) != SHEF_OK)
        abort();
    for (int i = 0; i < N_RUNS; i++) {
        const double start_ns = now_ns();
        struct shef_evt_decoder decoder;
        uint64_t n_events = 0;
        size_t at = header.n_bytes;

        shef_evt_init(&decoder, header.format, header.width_px, header.height_px, 0,
                      shef_cpu_features());
        while (at < n_bytes) {
            shef_event_batch_clear(&batch);
            at += shef_evt_decode(&decoder, bytes + at, n_bytes - at, &batch);
            /* Each run is a second later than the one before. */
            if (shef_filter_apply(wide, batch.events, batch.n_events,
                                  batch.base_us + i * INT64_C(1000000),
                                  (shef_event_time){ INT64_MAX }) != batch.n_events)
                abort();
            n_events += batch.n_events;
        }
        ns[i] = (now_ns() - start_ns) / (double)n_events;
    }
    report("bytes to filter state", name, ns);
    shef_filter_destroy(wide);
    free(bytes);
}

int main(void)
{
    static void (*const fills[])(struct shef_test_random *) = { fill_random, fill_edges,
                                                                fill_column };
    static const char *const names[] = { "random pixels", "moving edges", "one column" };
    static struct shef_filter_gain gains[WIDTH_PX * HEIGHT_PX];
    const struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_test_random random = { 1 };
    struct shef_error err = { 0 };
    char cpu[128];

    events = shef_memory_create(N_EVENTS, sizeof *events);
    cells = shef_memory_create((size_t)WIDTH_PX * HEIGHT_PX, sizeof *cells);
    if (!events || !cells ||
        shef_filter_create(&filter, &params, shef_cpu_features(), &err) != SHEF_OK)
        return 1;
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        gains[i] = (struct shef_filter_gain){ 260, 250 };
    shef_cpu_model(cpu, sizeof cpu);
    printf("{\"bench\": \"filter\", \"cpu\": \"%s\", \"events\": %u, \"batch\": %u}\n", cpu,
           N_EVENTS, BATCH);
    for (int i = 0; i < 3; i++) {
        fills[i](&random);
        measure("bare", names[i], run_bare);
        measure("filter", names[i], run_filter);
        if (shef_filter_set_gains(filter, gains, &err) != SHEF_OK)
            return 1;
        measure("filter with gain map", names[i], run_filter);
        if (shef_filter_set_gains(filter, NULL, &err) != SHEF_OK)
            return 1;
    }
    if (shef_test_data("events")) {
        measure_recording("evt2_sample.raw");
        measure_recording("evt3_sample.raw");
    }
    shef_filter_destroy(filter);
    free(events);
    free(cells);
    return 0;
}
