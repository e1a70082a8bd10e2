/* How long the frame side takes, for each instruction set, on one thread.
 *
 *   bench_frame [ISA ...]     default: all that this processor has; JSON lines with median,
 *                             95th percentile and best of the runs
 *
 * The peer is OpenCV on the same frame in the same run, one thread: remap alone (aliased), and
 * mean of 2 x 2 and remap (what ours is compared with for accuracy). Runs of ours and the peer's
 * alternate, so that both see the same other load. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "frame_cases.h"
#include "frame_opencv.h"
#include "pipeline/flow_search.h"
#include "pipeline/frame_edges.h"
#include "pipeline/frame_rectify.h"

#define N_RUNS 201

static struct shef_image_u8 raw;
static struct shef_image_u8 out;
static struct shef_image_u8 earlier;
static struct shef_frame_rectify *rectify;
static struct shef_frame_edges *edges;
static struct shef_flow_search *search;
static struct shef_edge_map map;
static struct shef_edge_map events;
static struct shef_test_opencv *peer;
static const double *velocity;

static void check(enum shef_err code, const struct shef_error *err)
{
    if (code == SHEF_OK)
        return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void run_rectify(void)
{
    shef_frame_rectify_run(rectify, raw, out);
}

static void run_remap(void)
{
    shef_test_opencv_remap(peer, raw);
}

static void run_halve_and_remap(void)
{
    shef_test_opencv_halve_and_remap(peer, raw);
}

static void run_unsigned(void)
{
    shef_frame_edges_unsigned(edges, out, &map);
}

static void run_along(void)
{
    shef_frame_edges_along(edges, out, velocity, &map);
}

static void run_temporal(void)
{
    shef_frame_edges_temporal(edges, earlier, out, &map);
}

static void run_search(void)
{
    struct shef_flow flow;

    shef_flow_search_run(search, out, &events, &flow);
}

static double now_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

struct task {
    const char *isa;
    const char *what;
    void (*run)(void);
};

/* Measures up to four tasks in turns. */
static void measure(const struct task *tasks, int n_tasks)
{
    static double us[4][N_RUNS];

    for (int i = 0; i < N_RUNS; i++)
        for (int k = 0; k < n_tasks; k++) {
            const double start_us = now_us();

            tasks[k].run();
            us[k][i] = now_us() - start_us;
        }
    for (int k = 0; k < n_tasks; k++) {
        qsort(us[k], N_RUNS, sizeof us[k][0], compare);
        printf("{\"bench\": \"frame\", \"isa\": \"%s\", \"what\": \"%s\", \"ms\": {\"median\": "
               "%.4f, \"p95\": %.4f, \"min\": %.4f}}\n",
               tasks[k].isa, tasks[k].what, us[k][N_RUNS / 2] * 1e-3,
               us[k][N_RUNS * 95 / 100] * 1e-3, us[k][0] * 1e-3);
    }
}

static void measure_rectify(const char *isa, uint32_t features, const char *profile,
                            const struct shef_rectification *r)
{
    struct shef_error err = { 0 };
    char what[3][64];
    const struct task tasks[] = {
        { isa, what[0], run_rectify },
        { "opencv", what[1], run_remap },
        { "opencv", what[2], run_halve_and_remap },
    };

    snprintf(what[0], sizeof what[0], "rectify, %s", profile);
    snprintf(what[1], sizeof what[1], "remap, %s", profile);
    snprintf(what[2], sizeof what[2], "2 x 2 mean and remap, %s", profile);
    check(shef_frame_rectify_create(&rectify, r, SHEF_FRAME_MONO8, features, &err), &err);
    peer = shef_test_opencv_create(r);
    measure(tasks, peer ? 3 : 1);
    shef_test_opencv_destroy(peer);
    shef_frame_rectify_destroy(rectify);
}

static void measure_edges(const char *isa, uint32_t features, const char *what, bool is_thin,
                          enum shef_edge_kind kind, void (*run)(void))
{
    const struct shef_rectification profile = shef_rectification_wide();
    const struct shef_image_u8 no_mask = { 0 };
    const struct task task = { isa, what, run };
    struct shef_frame_edges_params params = shef_frame_edges_default_params();
    struct shef_error err = { 0 };

    params.is_thin = is_thin;
    check(shef_frame_edges_create(&edges, &profile, no_mask, &params, features, &err), &err);
    check(shef_edge_map_create(&map, kind, profile.width_px, profile.height_px, &err), &err);
    measure(&task, 1);
    shef_edge_map_destroy(&map);
    shef_frame_edges_destroy(edges);
}

static void measure_search(const char *isa, uint32_t features)
{
    static const double leftwards[3] = { 1, 0, 0 };
    const struct shef_rectification profile = shef_rectification_wide();
    const struct shef_image_u8 no_mask = { 0 };
    const struct shef_frame_edges_params params = shef_frame_edges_default_params();
    const struct shef_flow_search_params search_params = shef_flow_search_default_params(&profile);
    const struct task task = { isa, "flow search", run_search };
    struct shef_error err = { 0 };

    check(shef_frame_edges_create(&edges, &profile, no_mask, &params, features, &err), &err);
    check(
        shef_edge_map_create(&events, SHEF_EDGE_GRADED, profile.width_px, profile.height_px, &err),
        &err);
    shef_frame_edges_along(edges, out, leftwards, &events);
    check(shef_flow_search_create(&search, &profile, &search_params, features, &err), &err);
    measure(&task, 1);
    shef_flow_search_destroy(search);
    shef_edge_map_destroy(&events);
    shef_frame_edges_destroy(edges);
}

static void measure_isa(uint32_t features)
{
    static const double across[3] = { 0.3, 0.1, 0 };
    static const double ahead[3] = { 0.3, 0.1, 0.1 };
    const struct shef_rectification paper = shef_test_frame_paper();
    const struct shef_rectification wide = shef_test_frame_wide();
    const char *isa = shef_cpu_isa_name(features);

    measure_rectify(isa, features, "paper", &paper);
    measure_rectify(isa, features, "wide", &wide);
    measure_edges(isa, features, "edges, unsigned", false, SHEF_EDGE_UNSIGNED, run_unsigned);
    measure_edges(isa, features, "edges, thin", true, SHEF_EDGE_UNSIGNED, run_unsigned);
    velocity = across;
    measure_edges(isa, features, "edges along, ternary", false, SHEF_EDGE_TERNARY, run_along);
    measure_edges(isa, features, "edges along, graded", false, SHEF_EDGE_GRADED, run_along);
    velocity = ahead;
    measure_edges(isa, features, "edges along, graded, moving along z", false, SHEF_EDGE_GRADED,
                  run_along);
    measure_edges(isa, features, "edges temporal, graded", false, SHEF_EDGE_GRADED, run_temporal);
    measure_search(isa, features);
}

int main(int argc, char **argv)
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };
    struct shef_test_random random = { 1 };
    struct shef_error err = { 0 };
    char cpu[128];

    shef_cpu_model(cpu, sizeof cpu);
    printf("{\"bench\": \"frame\", \"cpu\": \"%s\", \"runs\": %d}\n", cpu, N_RUNS);
    check(shef_image_create_u8(&raw, 2048, 1536, &err), &err);
    check(shef_image_create_u8(&out, 640, 480, &err), &err);
    check(shef_image_create_u8(&earlier, 640, 480, &err), &err);
    shef_test_fill_texture(raw, 40, 2, &random);
    shef_test_fill_texture(earlier, 17, 1, &random);
    for (int i = 0; i < 4; i++) {
        const char *name = argc > 1 ? (i + 1 < argc ? argv[i + 1] : NULL) : names[i];
        const uint32_t features = name ? shef_cpu_features_of(name) : UINT32_MAX;

        if (name && (features & shef_cpu_features()) == features)
            measure_isa(features);
    }
    shef_image_destroy_u8(&raw);
    shef_image_destroy_u8(&out);
    shef_image_destroy_u8(&earlier);
    return 0;
}
