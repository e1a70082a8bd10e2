#include "pipeline/kernels/bin_corr.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/kernels/bin_corr_band.h"

#define PREPARE_ROWS 32 /* rows of the right map a task spreads to bytes */

struct impl {
    shef_bin_corr_band_fn *band;
    const char *name;
    uint32_t needs;
};

static const struct impl impls[] = {
/* best first, the last needs nothing */
#if defined(__x86_64__)
    { shef_bin_corr_band_avx512, "avx512", SHEF_CPU_AVX512 },
    { shef_bin_corr_band_avx2, "avx2", SHEF_CPU_AVX2 },
#elif defined(__aarch64__)
    { shef_bin_corr_band_neon, "neon", SHEF_CPU_NEON },
#endif
    { shef_bin_corr_band_c, "c", SHEF_CPU_NONE },
};

struct shef_bin_corr {
    /* Set by create, then read-only. */
    struct shef_bin_corr_params params;
    const struct impl *impl;
    int32_t max_threads;
    int8_t *right; /* height_px rows; what follows the pixels stays zero: E outside the image */
    ptrdiff_t right_stride_bytes;
    int32_t right_words; /* words of a right row that hold pixels */
    uint8_t *scratch;    /* max_threads times scratch_bytes */
    size_t scratch_bytes;
    size_t bytes;
    /* Of the current run. */
    struct shef_bin_corr_job job;
    const struct shef_edge_map *right_map;
    int32_t n_bands;
};

static enum shef_err check_params(const struct shef_bin_corr_params *p, struct shef_error *err)
{
    if (p->width_px < 1 || p->height_px < 1 || p->width_px > SHEF_IMAGE_MAX_SIDE_PX ||
        p->height_px > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID, "correlation of %d x %d px: sides must be 1 to %d",
                         p->width_px, p->height_px, SHEF_IMAGE_MAX_SIDE_PX);
    if (p->window_px < 1 || p->window_px > SHEF_BIN_CORR_MAX_WINDOW_PX || p->window_px % 2 == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "correlation window of %d px: it must be odd and 1 to %d", p->window_px,
                         SHEF_BIN_CORR_MAX_WINDOW_PX);
    if (p->d_min < 0 || p->d_max < p->d_min || p->d_max > SHEF_BIN_CORR_MAX_DISPARITY)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "disparity range %d..%d px: it must lie in 0..%d and not be empty",
                         p->d_min, p->d_max, SHEF_BIN_CORR_MAX_DISPARITY);
    return SHEF_OK;
}

enum shef_err shef_bin_corr_create(struct shef_bin_corr **out_corr,
                                   const struct shef_bin_corr_params *params, uint32_t cpu_features,
                                   int32_t max_threads, struct shef_error *err)
{
    const enum shef_err code = check_params(params, err);

    if (code != SHEF_OK)
        return code;
    assert(max_threads >= 1);

    struct shef_bin_corr *corr = calloc(1, sizeof *corr);

    if (!corr)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "correlation workspace: out of memory");
    corr->params = *params;
    corr->max_threads = max_threads;
    corr->impl = impls;
    while ((corr->impl->needs & cpu_features) != corr->impl->needs)
        corr->impl++;

    corr->right_words = (params->width_px + 63) / 64;
    corr->right_stride_bytes = (ptrdiff_t)shef_memory_round_up(
        (size_t)corr->right_words * 64 + (size_t)params->d_max + SHEF_BIN_CORR_MAX_LANES);
    corr->scratch_bytes =
        shef_memory_round_up(shef_bin_corr_scratch_bytes(params->width_px, params->window_px / 2));

    const size_t right_bytes = (size_t)params->height_px * (size_t)corr->right_stride_bytes;
    const size_t all_scratch_bytes = (size_t)max_threads * corr->scratch_bytes;

    corr->right = shef_memory_create(right_bytes, 1);
    corr->scratch = shef_memory_create(all_scratch_bytes, 1);
    corr->bytes = sizeof *corr + right_bytes + all_scratch_bytes;
    if (!corr->right || !corr->scratch) {
        shef_bin_corr_destroy(corr);
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "correlation workspace of %zu bytes for %d x %d px: out of memory",
                         right_bytes + all_scratch_bytes, params->width_px, params->height_px);
    }
    *out_corr = corr;
    return SHEF_OK;
}

void shef_bin_corr_destroy(struct shef_bin_corr *corr)
{
    if (!corr)
        return;
    free(corr->right);
    free(corr->scratch);
    free(corr);
}

const char *shef_bin_corr_isa(const struct shef_bin_corr *corr)
{
    return corr->impl->name;
}

size_t shef_bin_corr_bytes(const struct shef_bin_corr *corr)
{
    return corr->bytes;
}

/* Eight bits to eight bytes 0 or 1, the highest bit to the lowest byte. */
static uint64_t spread_reversed(uint64_t bits)
{
    const uint64_t one_bit_a_byte =
        bits * UINT64_C(0x0101010101010101) & UINT64_C(0x0102040810204080);

    return (one_bit_a_byte + UINT64_C(0x7f7f7f7f7f7f7f7f)) >> 7 & UINT64_C(0x0101010101010101);
}

/* Row y of the right map as bytes -1, 0, 1, last pixel first. */
static void prepare_row(const struct shef_bin_corr *corr, int32_t y)
{
    const struct shef_edge_map *map = corr->right_map;
    const size_t first_word = (size_t)y * (size_t)map->stride_words;
    int8_t *row = corr->right + y * corr->right_stride_bytes;

    for (int32_t i = 0; i < corr->right_words; i++) {
        const size_t at = first_word + (size_t)(corr->right_words - 1 - i);
        const uint64_t both = map->minus ? map->plus[at] & map->minus[at] : 0;
        const uint64_t plus = map->plus[at] ^ both;
        const uint64_t minus = map->minus ? map->minus[at] ^ both : 0;

        for (int32_t k = 0; k < 8; k++) {
            const int32_t shift = 56 - 8 * k;
            const uint64_t bytes = spread_reversed(plus >> shift & 0xff) |
                                   spread_reversed(minus >> shift & 0xff) * 0xff;

            memcpy(row + 64 * i + 8 * k, &bytes, sizeof bytes);
        }
    }
}

static void prepare_task(void *context, int32_t task, int32_t worker)
{
    const struct shef_bin_corr *corr = context;
    const int32_t begin = task * PREPARE_ROWS;

    (void)worker;
    for (int32_t y = begin; y < begin + PREPARE_ROWS && y < corr->params.height_px; y++)
        prepare_row(corr, y);
}

static void band_task(void *context, int32_t task, int32_t worker)
{
    const struct shef_bin_corr *corr = context;
    const struct shef_bin_corr_params *p = &corr->params;
    const size_t row_bytes = (size_t)p->width_px * sizeof(int16_t);
    const int32_t y_begin = (int32_t)((int64_t)p->height_px * task / corr->n_bands);
    const int32_t y_end = (int32_t)((int64_t)p->height_px * (task + 1) / corr->n_bands);

    for (int32_t y = y_begin; y < y_end; y++) {
        memset(shef_row_i16(corr->job.disparity, y), 0xff, row_bytes); /* SHEF_BIN_CORR_NONE */
        memset(shef_row_i16(corr->job.sum, y), 0, row_bytes);
    }
    for (int32_t d = p->d_min; d <= p->d_max; d += SHEF_BIN_CORR_MAX_LANES) {
        const int32_t n_left = p->d_max - d + 1;
        const struct shef_bin_corr_group group = {
            .d_first = d,
            .n_disparities = n_left < SHEF_BIN_CORR_MAX_LANES ? n_left : SHEF_BIN_CORR_MAX_LANES,
            .is_first = d == p->d_min,
        };

        corr->impl->band(&corr->job, &group, y_begin, y_end,
                         corr->scratch + (size_t)worker * corr->scratch_bytes);
    }
}

void shef_bin_corr_run(struct shef_bin_corr *corr, const struct shef_edge_map *left,
                       const struct shef_edge_map *right, struct shef_workers *workers,
                       struct shef_image_i16 out_disparity, struct shef_image_i16 out_sum)
{
    const struct shef_bin_corr_params *p = &corr->params;
    const int32_t n_threads = shef_workers_count(workers);

    assert(n_threads <= corr->max_threads);
    assert(left->kind != SHEF_EDGE_GRADED && right->kind != SHEF_EDGE_GRADED);
    assert(left->width_px == p->width_px && left->height_px == p->height_px);
    assert(right->width_px == p->width_px && right->height_px == p->height_px);
    assert(out_disparity.width_px == p->width_px && out_disparity.height_px == p->height_px);
    assert(out_sum.width_px == p->width_px && out_sum.height_px == p->height_px);

    corr->right_map = right;
    corr->job = (struct shef_bin_corr_job){
        .width_px = p->width_px,
        .height_px = p->height_px,
        .radius_px = p->window_px / 2,
        .is_signed = left->minus || right->minus,
        .everywhere = p->everywhere,
        .plus = left->plus,
        .minus = left->minus,
        .stride_words = left->stride_words,
        .right = corr->right,
        .right_stride_bytes = corr->right_stride_bytes,
        .right_origin = corr->right_words * 64 - 1,
        .disparity = out_disparity,
        .sum = out_sum,
    };
    corr->n_bands = n_threads < p->height_px ? n_threads : p->height_px;
    shef_workers_run(workers, prepare_task, corr, (p->height_px + PREPARE_ROWS - 1) / PREPARE_ROWS);
    shef_workers_run(workers, band_task, corr, corr->n_bands);
}
