#include <stdlib.h>

#include "core/memory.h"
#include "sheftool/bench.h"
#include "sheftool/dataset.h"
#include "sheftool/synth.h"

#define N_KINDS  3
#define PATCH_PX 8

static enum shef_err create_maps(struct shef_edge_map maps[N_KINDS], int32_t width_px,
                                 int32_t height_px, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    for (int kind = 0; code == SHEF_OK && kind < N_KINDS; kind++)
        code =
            shef_edge_map_create(&maps[kind], (enum shef_edge_kind)kind, width_px, height_px, err);
    return code;
}

/* Fills the ternary and the graded map from the binary one. */
static void derive(struct shef_edge_map maps[N_KINDS])
{
    const struct shef_edge_map *binary = &maps[SHEF_EDGE_UNSIGNED];
    struct shef_edge_map *ternary = &maps[SHEF_EDGE_TERNARY];
    struct shef_edge_map *graded = &maps[SHEF_EDGE_GRADED];
    int8_t row[SHEF_IMAGE_MAX_SIDE_PX];

    for (int32_t y = 0; y < binary->height_px; y++) {
        const size_t first = (size_t)y * (size_t)ternary->stride_words;
        int8_t *grades = graded->graded + y * graded->graded_stride_bytes;

        shef_edge_map_row(binary, y, row);
        for (int32_t x = 0; x < binary->width_px; x++) {
            const bool rising = shef_synth_hash(1, x / PATCH_PX, y / PATCH_PX) < 0.5;
            const int8_t grade = (int8_t)(64 + 63 * shef_synth_hash(2, x, y));
            uint64_t *plane = rising ? ternary->plus : ternary->minus;

            if (!row[x])
                continue;
            plane[first + (size_t)(x / 64)] |= UINT64_C(1) << (x % 64);
            grades[x] = rising ? grade : (int8_t)-grade;
        }
    }
}

static enum shef_err allocate(struct shef_bench_pairs *pairs, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    pairs->at = calloc((size_t)pairs->n, sizeof *pairs->at);
    if (!pairs->at)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "pairs to measure on: out of memory");
    for (int32_t i = 0; code == SHEF_OK && i < pairs->n; i++) {
        code = create_maps(pairs->at[i].frame, pairs->width_px, pairs->height_px, err);
        if (code == SHEF_OK)
            code = create_maps(pairs->at[i].event, pairs->width_px, pairs->height_px, err);
    }
    return code;
}

enum shef_err shef_bench_pairs_load(struct shef_bench_pairs *out_pairs, const char *folder,
                                    int32_t n_pairs, struct shef_error *err)
{
    struct shef_dataset dataset;
    struct shef_bench_pairs pairs = { .n = n_pairs };
    enum shef_err code = shef_dataset_open_folder(&dataset, folder, NULL, err);

    if (code != SHEF_OK)
        return code;
    if ((size_t)pairs.n > dataset.pairs.n)
        pairs.n = (int32_t)dataset.pairs.n;
    pairs.width_px = dataset.width_px;
    pairs.height_px = dataset.height_px;
    code = allocate(&pairs, err);
    for (int32_t i = 0; code == SHEF_OK && i < pairs.n; i++) {
        code = shef_dataset_load_edges(&dataset, (size_t)i, &pairs.at[i].frame[SHEF_EDGE_UNSIGNED],
                                       &pairs.at[i].event[SHEF_EDGE_UNSIGNED], err);
        derive(pairs.at[i].frame);
        derive(pairs.at[i].event);
    }
    shef_dataset_close(&dataset);
    if (code != SHEF_OK) {
        shef_bench_pairs_free(&pairs);
        return code;
    }
    *out_pairs = pairs;
    return SHEF_OK;
}

enum shef_err shef_bench_pairs_make(struct shef_bench_pairs *out_pairs, int32_t width_px,
                                    int32_t height_px, int32_t n_pairs, struct shef_error *err)
{
    /* Of the third kind of world, clutter: the one with edges all over. */
    const struct shef_synth_settings settings = {
        .width_px = width_px,
        .height_px = height_px,
        .n_pairs = 3 * n_pairs,
        .seed = 1,
        .vertical_residual_px = 1.5,
    };
    struct shef_bench_pairs pairs = { .n = n_pairs, .width_px = width_px, .height_px = height_px };
    struct shef_synth *synth = shef_synth_create(&settings, err);
    enum shef_err code = synth ? allocate(&pairs, err) : err->code;

    for (int32_t i = 0; code == SHEF_OK && i < n_pairs; i++) {
        const struct shef_synth_pair made = shef_synth_make(synth, 2 * n_pairs + i);

        code =
            shef_edge_map_set_binary(&pairs.at[i].frame[SHEF_EDGE_UNSIGNED], made.frame_edge, err);
        if (code == SHEF_OK)
            code = shef_edge_map_set_binary(&pairs.at[i].event[SHEF_EDGE_UNSIGNED], made.event_edge,
                                            err);
        derive(pairs.at[i].frame);
        derive(pairs.at[i].event);
    }
    shef_synth_destroy(synth);
    if (code != SHEF_OK) {
        shef_bench_pairs_free(&pairs);
        return code;
    }
    *out_pairs = pairs;
    return SHEF_OK;
}

void shef_bench_pairs_free(struct shef_bench_pairs *pairs)
{
    for (int32_t i = 0; pairs->at && i < pairs->n; i++)
        for (int kind = 0; kind < N_KINDS; kind++) {
            shef_edge_map_destroy(&pairs->at[i].frame[kind]);
            shef_edge_map_destroy(&pairs->at[i].event[kind]);
        }
    free(pairs->at);
    *pairs = (struct shef_bench_pairs){ 0 };
}
