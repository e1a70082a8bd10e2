/* What the benches measure: our kernels and matchers per instruction set, and OpenCV's. */
#include <stdio.h>
#include <stdlib.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/kernels/bin_corr.h"
#include "pipeline/outlier_authors.h"
#include "pipeline/paper.h"
#include "pipeline/robust.h"
#include "sheftool/bench.h"
#include "sheftool/matcher_opencv.h"

static const char *const isas[] = { "c", "avx2", "avx512", "neon" };

#define N_ISAS ((int)(sizeof isas / sizeof isas[0]))

/* Whatever a case needs; unused parts stay zero. */
struct state {
    enum shef_edge_kind kind;
    struct shef_bin_corr *correlation;
    struct shef_paper *paper;
    struct shef_outlier_authors *outliers;
    struct shef_robust *robust;
    struct shef_opencv *opencv;
    struct shef_image_i16 best;
    struct shef_image_i16 sum;
    struct shef_image_f32 disparity;
    struct shef_image_f32 confidence;
};

static void destroy(void *opaque)
{
    struct state *state = opaque;

    shef_bin_corr_destroy(state->correlation);
    shef_paper_destroy(state->paper);
    shef_outlier_authors_destroy(state->outliers);
    shef_robust_destroy(state->robust);
    shef_opencv_destroy(state->opencv);
    shef_image_destroy_i16(&state->best);
    shef_image_destroy_i16(&state->sum);
    shef_image_destroy_f32(&state->disparity);
    shef_image_destroy_f32(&state->confidence);
    free(state);
}

static struct state *create(const struct shef_bench *bench, struct shef_error *err)
{
    struct state *state = calloc(1, sizeof *state);
    const int32_t w = bench->width_px;
    const int32_t h = bench->height_px;

    if (!state) {
        shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
        return NULL;
    }
    if (shef_image_create_i16(&state->best, w, h, err) != SHEF_OK ||
        shef_image_create_i16(&state->sum, w, h, err) != SHEF_OK ||
        shef_image_create_f32(&state->disparity, w, h, err) != SHEF_OK ||
        shef_image_create_f32(&state->confidence, w, h, err) != SHEF_OK) {
        destroy(state);
        return NULL;
    }
    return state;
}

static enum shef_err run_correlation(void *opaque, const struct shef_bench_pair *pair,
                                     int64_t number, struct shef_error *err)
{
    struct state *state = opaque;

    (void)number;
    (void)err;
    shef_bin_corr_run(state->correlation, &pair->frame[state->kind], &pair->event[state->kind],
                      NULL, state->best, state->sum);
    return SHEF_OK;
}

static enum shef_err run_paper(void *opaque, const struct shef_bench_pair *pair, int64_t number,
                               struct shef_error *err)
{
    struct state *state = opaque;
    const enum shef_err code = shef_paper_match(state->paper, &pair->frame[state->kind],
                                                &pair->event[state->kind], state->disparity, NULL);

    (void)number;
    if (code != SHEF_OK)
        return shef_fail(err, code, "the paper's matcher refused its maps");
    if (state->outliers)
        shef_outlier_authors_run(state->outliers, state->disparity,
                                 SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX, state->disparity);
    return SHEF_OK;
}

static enum shef_err run_robust(void *opaque, const struct shef_bench_pair *pair, int64_t number,
                                struct shef_error *err)
{
    struct state *state = opaque;
    const struct shef_edge_pair maps = { &pair->frame[state->kind], &pair->event[state->kind] };
    const struct shef_robust_output output = { .disparity = state->disparity,
                                               .confidence = state->confidence };

    (void)err;
    shef_robust_match(state->robust, &maps, 1, number, &output, NULL);
    return SHEF_OK;
}

/* OpenCV's own part alone is timed: from cameras it would get images, not edge planes. */
static enum shef_err prepare_opencv(void *opaque, const struct shef_bench_pair *pair,
                                    struct shef_error *err)
{
    struct state *state = opaque;

    return shef_opencv_prepare(state->opencv, &pair->frame[SHEF_EDGE_UNSIGNED],
                               &pair->event[SHEF_EDGE_UNSIGNED], err);
}

static enum shef_err run_opencv(void *opaque, const struct shef_bench_pair *pair, int64_t number,
                                struct shef_error *err)
{
    struct state *state = opaque;

    (void)pair;
    (void)number;
    return shef_opencv_match(state->opencv, err);
}

static void add(struct shef_bench *bench, struct state *state, const char *name, const char *isa,
                enum shef_err (*run)(void *, const struct shef_bench_pair *, int64_t,
                                     struct shef_error *),
                size_t memory_bytes)
{
    struct shef_bench_case one = {
        .state = state, .run = run, .destroy = destroy, .memory_bytes = memory_bytes
    };

    if (state->opencv)
        one.prepare = prepare_opencv;
    snprintf(one.name, sizeof one.name, "%s", name);
    snprintf(one.isa, sizeof one.isa, "%s", isa);
    shef_bench_add(bench, &one);
}

static bool can_use(const char *isa, uint32_t cpu_features)
{
    const uint32_t needed = shef_cpu_features_of(isa);

    return needed != UINT32_MAX && (needed & cpu_features) == needed;
}

static enum shef_err add_correlation(struct shef_bench *bench, const char *name,
                                     enum shef_edge_kind kind, int32_t window_px, const char *isa,
                                     struct shef_error *err)
{
    const struct shef_bin_corr_params params = {
        .width_px = bench->width_px,
        .height_px = bench->height_px,
        .window_px = window_px,
        .d_min = 1,
        .d_max = bench->max_disparity_px,
    };
    struct state *state = create(bench, err);

    if (!state)
        return err->code;
    state->kind = kind;
    const enum shef_err code =
        shef_bin_corr_create(&state->correlation, &params, shef_cpu_features_of(isa), 1, err);

    if (code != SHEF_OK) {
        destroy(state);
        return code;
    }
    add(bench, state, name, shef_bin_corr_isa(state->correlation), run_correlation,
        shef_bin_corr_bytes(state->correlation));
    return SHEF_OK;
}

enum shef_err shef_bench_add_correlate(struct shef_bench *bench, int32_t window_px,
                                       uint32_t cpu_features, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    for (int i = 0; code == SHEF_OK && i < N_ISAS; i++) {
        if (!can_use(isas[i], cpu_features))
            continue;
        code = add_correlation(bench, "correlate", SHEF_EDGE_UNSIGNED, window_px, isas[i], err);
        if (code == SHEF_OK)
            code = add_correlation(bench, "correlate-signed", SHEF_EDGE_TERNARY, window_px, isas[i],
                                   err);
    }
    return code;
}

static enum shef_err add_paper(struct shef_bench *bench, const char *preset, bool filter,
                               const char *isa, struct shef_error *err)
{
    const uint32_t features = shef_cpu_features_of(isa);
    struct shef_paper_params params;
    struct state *state = create(bench, err);
    enum shef_err code = state ? shef_paper_preset(preset, &params, err) : err->code;

    if (code == SHEF_OK) {
        params.d_max = bench->max_disparity_px;
        code = shef_paper_create(&state->paper, bench->width_px, bench->height_px, &params,
                                 features, NULL, err);
    }
    if (code == SHEF_OK && filter)
        code = shef_outlier_authors_create(&state->outliers, bench->width_px, bench->height_px,
                                           SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX, features, err);
    if (code != SHEF_OK) {
        if (state)
            destroy(state);
        return code;
    }
    add(bench, state, preset, shef_paper_isa(state->paper), run_paper,
        shef_paper_bytes(state->paper) +
            (filter ? shef_outlier_authors_bytes(state->outliers) : 0));
    return SHEF_OK;
}

static enum shef_err add_robust(struct shef_bench *bench, const char *name,
                                enum shef_edge_kind kind, const char *isa, struct shef_error *err)
{
    struct shef_robust_params params =
        shef_robust_defaults(bench->width_px, bench->height_px, kind);
    struct state *state = create(bench, err);

    if (!state)
        return err->code;
    state->kind = kind;
    params.max_disparity_px = bench->max_disparity_px;
    state->robust = shef_robust_create(&params, shef_cpu_features_of(isa), NULL, err);
    if (!state->robust) {
        destroy(state);
        return err->code;
    }
    shef_robust_align_auto(state->robust);
    add(bench, state, name, shef_robust_isa(state->robust), run_robust,
        shef_robust_memory_bytes(state->robust));
    return SHEF_OK;
}

enum shef_err shef_bench_add_frame(struct shef_bench *bench, uint32_t cpu_features,
                                   struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    for (int i = 0; code == SHEF_OK && i < N_ISAS; i++) {
        if (!can_use(isas[i], cpu_features))
            continue;
        code = add_robust(bench, "robust", SHEF_EDGE_UNSIGNED, isas[i], err);
        if (code == SHEF_OK)
            code = add_robust(bench, "robust-signed", SHEF_EDGE_TERNARY, isas[i], err);
        if (code == SHEF_OK)
            code = add_robust(bench, "robust-graded", SHEF_EDGE_GRADED, isas[i], err);
        if (code == SHEF_OK)
            code = add_paper(bench, "paper-ds", false, isas[i], err);
        if (code == SHEF_OK)
            code = add_paper(bench, "paper-dp", true, isas[i], err);
    }
    return code;
}

static enum shef_err add_opencv(struct shef_bench *bench, const char *name,
                                const struct shef_opencv_params *params, struct shef_error *err)
{
    struct state *state = create(bench, err);

    if (!state)
        return err->code;
    state->opencv = shef_opencv_create(params, err);
    if (!state->opencv) {
        destroy(state);
        return err->code;
    }
    add(bench, state, name, "opencv", run_opencv, 0);
    return SHEF_OK;
}

enum shef_err shef_bench_add_opencv(struct shef_bench *bench, int32_t block_px,
                                    struct shef_error *err)
{
    struct shef_opencv_params params = {
        .width_px = bench->width_px,
        .height_px = bench->height_px,
        .max_disparity_px = bench->max_disparity_px,
        .block_px = block_px,
    };
    const enum shef_err code = add_opencv(bench, "opencv-stereobm", &params, err);

    if (code != SHEF_OK)
        return code;
    params.block_px = 5;
    params.semi_global = true;
    params.p1 = 8;
    params.p2 = 32;
    return add_opencv(bench, "opencv-stereosgbm", &params, err);
}
