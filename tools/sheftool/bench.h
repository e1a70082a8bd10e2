/* Measures several ways to do one job side by side.
 *
 * The cases take turns, so that a disturbance of the machine hits all of them and not one. A turn
 * is two successive pairs, of which the second is counted: live, too, a matcher finds its memory
 * as its previous frame left it. The first round warms up and is not counted. Each case runs on
 * the calling thread only. Thread: main. */
#ifndef SHEFTOOL_BENCH_H
#define SHEFTOOL_BENCH_H

#include <jansson.h>
#include <stdint.h>

#include "core/error.h"
#include "pipeline/edge_map.h"
#include "sheftool/stopwatch.h"

#define SHEF_BENCH_MAX_CASES 32

/* The same pair as every kind of map. */
struct shef_bench_pair {
    struct shef_edge_map frame[3]; /* indexed by enum shef_edge_kind */
    struct shef_edge_map event[3];
};

/* Pairs to run on, in order and again from the first. */
struct shef_bench_pairs {
    struct shef_bench_pair *at; /* owned */
    int32_t n;
    int32_t width_px;
    int32_t height_px;
};

/* Takes up to n_pairs pairs of a data folder.
 * Ternary and graded maps are made from the binary ones: 8 x 8 px patches share a sign, grades
 * run from 64 to 127. */
SHEF_MUST_CHECK enum shef_err shef_bench_pairs_load(struct shef_bench_pairs *out_pairs,
                                                    const char *folder, int32_t n_pairs,
                                                    struct shef_error *err);

/* Makes n_pairs synthetic pairs of a size. */
SHEF_MUST_CHECK enum shef_err shef_bench_pairs_make(struct shef_bench_pairs *out_pairs,
                                                    int32_t width_px, int32_t height_px,
                                                    int32_t n_pairs, struct shef_error *err);

void shef_bench_pairs_free(struct shef_bench_pairs *pairs);

/* One way to do the job. */
struct shef_bench_case {
    char name[40];
    char isa[16]; /* "avx512"; OpenCV dispatches for itself: "opencv" */
    void *state;
    /* Not timed; NULL: nothing to do. */
    enum shef_err (*prepare)(void *state, const struct shef_bench_pair *pair,
                             struct shef_error *err);
    enum shef_err (*run)(void *state, const struct shef_bench_pair *pair, int64_t number,
                         struct shef_error *err);
    void (*destroy)(void *state);
    size_t memory_bytes; /* 0: unknown */
    struct shef_timings wall;
    struct shef_timings cpu;
};

struct shef_bench {
    struct shef_bench_case cases[SHEF_BENCH_MAX_CASES];
    int32_t n;
    int32_t width_px; /* of the maps the cases are made for */
    int32_t height_px;
    int32_t max_disparity_px;
};

/* Adds a case; the bench destroys its state. */
void shef_bench_add(struct shef_bench *bench, const struct shef_bench_case *one);

/* Runs all cases n_rounds times. */
SHEF_MUST_CHECK enum shef_err shef_bench_run(struct shef_bench *bench,
                                             const struct shef_bench_pairs *pairs, int32_t n_rounds,
                                             struct shef_error *err);

/* A list of {name, isa, median_ms, p95_ms, min_ms, cpu_median_ms, mde_per_s, ratio_to_stereobm,
 * memory_bytes}. mde_per_s: millions of width x height x disparities a second, ratio: time of
 * opencv-stereobm over time, both of the shortest times; null where there is none. */
json_t *shef_bench_results_json(struct shef_bench *bench);

void shef_bench_destroy(struct shef_bench *bench);

/* Cases for the two benches. cpu_features: what this processor has. */
SHEF_MUST_CHECK enum shef_err shef_bench_add_correlate(struct shef_bench *bench, int32_t window_px,
                                                       uint32_t cpu_features,
                                                       struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_bench_add_frame(struct shef_bench *bench, uint32_t cpu_features,
                                                   struct shef_error *err);
/* OpenCV's StereoBM (block_px) and StereoSGBM (block 5), library defaults otherwise. */
SHEF_MUST_CHECK enum shef_err shef_bench_add_opencv(struct shef_bench *bench, int32_t block_px,
                                                    struct shef_error *err);

#endif
