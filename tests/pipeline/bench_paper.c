/* How fast the correlation runs per instruction set, window, kind, range and size, and the paper
 * modes with the authors' filter. Real edge maps where they are (pair 8), else random ones.
 *
 *   bench_paper [ISA ...]     default: all that this processor has */
#include "pipeline/kernels/bin_corr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/outlier_authors.h"
#include "pipeline/paper.h"
#include "real_pairs.h"

#define N_RUNS 40

static double now_ms(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void stop(const struct shef_error *err)
{
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void measure(const char *what, const struct shef_bin_corr_params *params, uint32_t features,
                    const struct shef_edge_map *left, const struct shef_edge_map *right)
{
    struct shef_image_i16 disparity = shef_test_image_i16(params->width_px, params->height_px);
    struct shef_image_i16 sum = shef_test_image_i16(params->width_px, params->height_px);
    struct shef_error err = { 0 };
    struct shef_bin_corr *corr;
    double best_ms = 1e9;
    double total_ms = 0;

    if (shef_bin_corr_create(&corr, params, features, 1, &err) != SHEF_OK)
        stop(&err);
    shef_bin_corr_run(corr, left, right, NULL, disparity, sum);
    for (int i = 0; i < N_RUNS; i++) {
        const double start_ms = now_ms();

        shef_bin_corr_run(corr, left, right, NULL, disparity, sum);

        const double ms = now_ms() - start_ms;

        total_ms += ms;
        best_ms = ms < best_ms ? ms : best_ms;
    }

    const double cells =
        (double)params->width_px * params->height_px * (params->d_max - params->d_min + 1);

    printf("%-7s %4d x %4d  d %3d..%3d  window %3d  %-10s  min %7.3f ms  mean %7.3f ms  %6.0f MDE/s"
           "  %5.1f MB\n",
           shef_bin_corr_isa(corr), params->width_px, params->height_px, params->d_min,
           params->d_max, params->window_px, what, best_ms, total_ms / N_RUNS,
           cells / best_ms * 1e-3, (double)shef_bin_corr_bytes(corr) * 1e-6);
    shef_bin_corr_destroy(corr);
    shef_image_destroy_i16(&disparity);
    shef_image_destroy_i16(&sum);
}

/* Real edges where they are, else random ones of the same density. */
static struct shef_test_pair edges_to_measure(struct shef_test_random *random)
{
    if (shef_test_data("shef"))
        return shef_test_read_pair(8);
    return (struct shef_test_pair){
        .left = shef_test_random_map(random, SHEF_EDGE_UNSIGNED, 640, 480, 0.28),
        .right = shef_test_random_map(random, SHEF_EDGE_UNSIGNED, 640, 480, 0.25),
    };
}

static void measure_windows(uint32_t features, const struct shef_test_pair *pair)
{
    static const int32_t windows[] = { 21, 51, 121 };

    for (size_t i = 0; i < sizeof windows / sizeof windows[0]; i++) {
        const struct shef_bin_corr_params params = { 640, 480, windows[i], 1, 80, false };

        measure("edges", &params, features, &pair->left, &pair->right);
    }
}

static void measure_kinds(uint32_t features, const struct shef_test_pair *pair,
                          struct shef_test_random *random)
{
    struct shef_bin_corr_params params = { 640, 480, 21, 1, 80, true };
    struct shef_edge_map ternary = shef_test_random_map(random, SHEF_EDGE_TERNARY, 640, 480, 0.28);
    struct shef_edge_map none = shef_test_random_map(random, SHEF_EDGE_UNSIGNED, 640, 480, 0);

    measure("everywhere", &params, features, &pair->left, &pair->right);
    params.everywhere = false;
    measure("ternary", &params, features, &ternary, &pair->right);
    measure("no edges", &params, features, &none, &pair->right); /* the running boxes alone */
    shef_edge_map_destroy(&ternary);
    shef_edge_map_destroy(&none);
}

static void measure_ranges(uint32_t features, const struct shef_test_pair *pair)
{
    static const int32_t ranges[] = { 16, 32, 64, 80, 128, 160, 256 };

    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++) {
        const struct shef_bin_corr_params params = { 640, 480, 21, 1, ranges[i], false };

        measure("ranges", &params, features, &pair->left, &pair->right);
    }
}

static void measure_sizes(uint32_t features, struct shef_test_random *random)
{
    static const int32_t sizes[][2] = { { 320, 240 }, { 640, 480 }, { 1280, 720 } };

    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const struct shef_bin_corr_params params = { sizes[i][0], sizes[i][1], 21, 1, 80, false };
        struct shef_edge_map left = shef_test_random_map(random, SHEF_EDGE_UNSIGNED,
                                                         params.width_px, params.height_px, 0.28);
        struct shef_edge_map right = shef_test_random_map(random, SHEF_EDGE_UNSIGNED,
                                                          params.width_px, params.height_px, 0.25);

        measure("random", &params, features, &left, &right);
        shef_edge_map_destroy(&left);
        shef_edge_map_destroy(&right);
    }
}

/* A whole frame of a paper mode, and one pass of the authors' filter over it. */
static void measure_preset(const char *name, uint32_t features, const struct shef_test_pair *pair)
{
    struct shef_image_f32 disparity = shef_test_image_f32(640, 480);
    struct shef_image_f32 filtered = shef_test_image_f32(640, 480);
    struct shef_paper_report best = { .stage_ns = { INT64_MAX, INT64_MAX, INT64_MAX } };
    double best_match_ms = 1e9;
    double best_filter_ms = 1e9;
    struct shef_paper_params params;
    struct shef_paper *paper;
    struct shef_outlier_authors *filter;
    struct shef_error err = { 0 };

    if (shef_paper_preset(name, &params, &err) != SHEF_OK ||
        shef_paper_create(&paper, 640, 480, &params, features, NULL, &err) != SHEF_OK ||
        shef_outlier_authors_create(&filter, 640, 480, 50, features, &err) != SHEF_OK)
        stop(&err);
    for (int i = 0; i < N_RUNS; i++) {
        struct shef_paper_report report;
        const double start_ms = now_ms();
        const enum shef_err code =
            shef_paper_match(paper, &pair->left, &pair->right, disparity, &report);
        const double matched_ms = now_ms();

        shef_outlier_authors_run(filter, disparity, 50, filtered);

        const double filtered_ms = now_ms();

        if (code != SHEF_OK)
            stop(&err);
        best_match_ms = fmin(best_match_ms, matched_ms - start_ms);
        best_filter_ms = fmin(best_filter_ms, filtered_ms - matched_ms);
        for (int k = 0; k < SHEF_PAPER_N_STAGES; k++)
            if (report.stage_ns[k] < best.stage_ns[k])
                best.stage_ns[k] = report.stage_ns[k];
    }
    printf("%-7s %s  min %.3f ms (", shef_paper_isa(paper), name, best_match_ms);
    for (int k = 0; k < SHEF_PAPER_N_STAGES; k++)
        printf("%s%s %.3f", k > 0 ? ", " : "", shef_paper_stage_name(k),
               (double)best.stage_ns[k] * 1e-6);
    printf(")  %.1f MB, authors' filter %.3f ms\n", (double)shef_paper_bytes(paper) * 1e-6,
           best_filter_ms);
    shef_paper_destroy(paper);
    shef_outlier_authors_destroy(filter);
    shef_image_destroy_f32(&disparity);
    shef_image_destroy_f32(&filtered);
}

static void measure_isa(uint32_t features)
{
    struct shef_test_random random = { 1 };
    struct shef_test_pair pair = edges_to_measure(&random);

    measure_windows(features, &pair);
    measure_kinds(features, &pair, &random);
    measure_ranges(features, &pair);
    measure_sizes(features, &random);
    measure_preset("paper-ds", features, &pair);
    measure_preset("paper-dp", features, &pair);
    shef_test_free_pair(&pair);
}

int main(int argc, char **argv)
{
    uint32_t isas[4];
    int n_isas = 0;

    for (int i = 1; i < argc && n_isas < 4; i++) {
        const uint32_t features = shef_cpu_features_of(argv[i]);

        if ((features & shef_cpu_features()) != features) {
            fprintf(stderr, "instruction set '%s': unknown, or not on this processor\n", argv[i]);
            return 1;
        }
        isas[n_isas++] = features;
    }
    if (n_isas == 0)
        n_isas = shef_test_isas(isas);
    for (int i = 0; i < n_isas; i++)
        measure_isa(isas[i]);
    return 0;
}
