/* How long a snapshot and its edge map take, for each instruction set, on one thread.
 *
 *   bench_event_edges [ISA ...]     default: all that this processor has; JSON lines with median,
 *                                   95th percentile and best of the runs
 *
 * decay + warp: read the filter at an instant, then fetch the rectified profile with an offset
 * per square; accrue: one of the three steps of a centred read-out; edge map: quantile and map
 * from the rectified values. The state has a few events everywhere. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/event_edges.h"
#include "pipeline/filter.h"
#include "pipeline/snapshot_pool.h"
#include "support/support.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480
#define N_RUNS    201
#define END_US    60000

static struct shef_filter *filter;
static struct shef_snapshot_pool *pool;
static struct shef_snapshot *snapshot;
static struct shef_image_i16 before;
static struct shef_image_i16 rectified;
static struct shef_warp_map map;
static struct shef_warp_shift shift;
static const struct shef_warp_kernel *warp;
static struct shef_event_edges *edges;
static struct shef_edge_map edge_map;

static void check(enum shef_err code, const struct shef_error *err)
{
    if (code == SHEF_OK)
        return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static double now_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static void read_filter(void)
{
    shef_filter_read(filter, (shef_event_time){ END_US * SHEF_NS_PER_US }, snapshot->values);
}

static void run_warp(void)
{
    shef_warp_run(&map, warp, &shift, snapshot->values, rectified);
}

static void read_and_warp(void)
{
    read_filter();
    run_warp();
}

static void accrue(void)
{
    shef_filter_accrue_sums(filter, 0.5, snapshot->values, before);
}

static void make_map(void)
{
    shef_event_edges_of_values(edges, snapshot->values, &shift, &edge_map);
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

static double measure(const char *isa, const char *profile, const char *what, void (*run)(void),
                      double minus_us)
{
    double us[N_RUNS];

    for (int i = 0; i < N_RUNS; i++) {
        const double start_us = now_us();

        run();
        us[i] = now_us() - start_us;
    }
    qsort(us, N_RUNS, sizeof us[0], compare);
    printf("{\"bench\": \"event_edges\", \"isa\": \"%s\", \"profile\": \"%s\", \"what\": \"%s\", "
           "\"ms\": {\"median\": %.4f, \"p95\": %.4f, \"min\": %.4f}}\n",
           isa, profile, what, (us[N_RUNS / 2] - minus_us) * 1e-3,
           (us[N_RUNS * 95 / 100] - minus_us) * 1e-3, (us[0] - minus_us) * 1e-3);
    return us[N_RUNS / 2];
}

static void make_state(uint32_t features)
{
    const struct shef_filter_params params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_test_random random = { 1 };
    struct shef_error err = { 0 };

    check(shef_filter_create(&filter, &params, features, &err), &err);
    for (uint32_t i = 0; i < 1000000; i++) {
        const uint64_t bits = shef_test_random_u64(&random);
        const struct shef_event event =
            shef_event_make((uint32_t)((uint64_t)i * END_US / 1000000), (uint32_t)(bits % WIDTH_PX),
                            (uint32_t)((bits >> 20) % HEIGHT_PX), bits >> 62);

        if (shef_filter_apply(filter, &event, 1, 0, (shef_event_time){ INT64_MAX }) != 1)
            abort();
    }
}

static void measure_maps(const char *isa, const char *profile, uint32_t features, double warp_us)
{
    static const struct {
        const char *what;
        enum shef_edge_kind kind;
        bool is_thin;
    } kinds[] = {
        { "edge map, unsigned", SHEF_EDGE_UNSIGNED, false },
        { "edge map, thin", SHEF_EDGE_UNSIGNED, true },
        { "edge map, ternary", SHEF_EDGE_TERNARY, false },
        { "edge map, graded", SHEF_EDGE_GRADED, false },
    };

    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        struct shef_event_edges_params params = shef_event_edges_default_params(kinds[i].kind);
        struct shef_error err = { 0 };

        params.is_thin = kinds[i].is_thin;
        check(shef_event_edges_create(&edges, &map, &params, features, &err), &err);
        check(shef_edge_map_create(&edge_map, kinds[i].kind, WIDTH_PX, HEIGHT_PX, &err), &err);
        measure(isa, profile, kinds[i].what, make_map, warp_us);
        shef_edge_map_destroy(&edge_map);
        shef_event_edges_destroy(edges);
    }
}

/* A real lens and mount: rows bend by several pixels and are tilted. */
static struct shef_rectification with_lens(struct shef_rectification r)
{
    const double a = 0.01;
    const double turn[9] = { cos(a), -sin(a), 0, sin(a), cos(a), 0, 0, 0, 1 };

    r.camera.distortion[0] = -0.11;
    r.camera.distortion[1] = 0.09;
    for (int i = 0; i < 9; i++)
        r.r_camera_rectified[i] = turn[i];
    return r;
}

static void measure_isa(uint32_t features)
{
    const struct {
        const char *name;
        struct shef_rectification rectification;
    } profiles[] = {
        { "wide", with_lens(shef_rectification_wide()) },
        { "paper", with_lens(shef_rectification_paper()) },
    };
    const char *isa = shef_cpu_isa_name(features);
    struct shef_error err = { 0 };

    make_state(features);
    warp = shef_warp_pick(features);
    for (int i = 0; i < 2; i++) {
        check(shef_warp_map_create(&map, &profiles[i].rectification, &err), &err);
        check(shef_warp_shift_create(&shift, &map, &err), &err);
        shef_warp_shift_set(&shift, (double[3]){ .3, .1, .05 }, SHEF_EVENT_EDGES_LAG_PX);
        if (i == 0) {
            measure(isa, "sensor", "decay", read_filter, 0);
            measure(isa, "sensor", "accrue", accrue, 0);
            read_filter();
        }

        const double warp_us = measure(isa, profiles[i].name, "warp", run_warp, 0);

        measure(isa, profiles[i].name, "decay + warp", read_and_warp, 0);
        measure_maps(isa, profiles[i].name, features, warp_us);
        shef_warp_shift_destroy(&shift);
        shef_warp_map_destroy(&map);
    }
    shef_filter_destroy(filter);
}

int main(int argc, char **argv)
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };
    struct shef_error err = { 0 };
    char cpu[128];

    shef_cpu_model(cpu, sizeof cpu);
    printf("{\"bench\": \"event_edges\", \"cpu\": \"%s\", \"runs\": %d}\n", cpu, N_RUNS);
    check(shef_snapshot_pool_create(&pool, 4, WIDTH_PX, HEIGHT_PX, &err), &err);
    snapshot = shef_snapshot_pool_begin(pool, &before);
    check(shef_image_create_i16(&rectified, WIDTH_PX, HEIGHT_PX, &err), &err);
    for (int i = 0; i < 4; i++) {
        const char *name = argc > 1 ? (i + 1 < argc ? argv[i + 1] : NULL) : names[i];
        const uint32_t features = name ? shef_cpu_features_of(name) : UINT32_MAX;

        if (name && (features & shef_cpu_features()) == features)
            measure_isa(features);
    }
    shef_image_destroy_i16(&rectified);
    shef_snapshot_pool_destroy(pool);
    return 0;
}
