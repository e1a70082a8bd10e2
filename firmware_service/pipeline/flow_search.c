#include "pipeline/flow_search.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "pipeline/kernels/flow.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/kernels/rectify.h"

#define BLOCK_PX        SHEF_FLOW_BLOCK_PX
#define N_DIRECTIONS    SHEF_FLOW_DIRECTIONS
#define MARGIN          64 /* values before and after each row: the largest disparity there */
#define MAX_DISPARITY   (2.0 * MARGIN)
#define N_LOGS          (SHEF_RECTIFY_CELL_MAX + 1)
#define LOG_SCALE       2048.0
#define LOG_OFFSET      6.0
#define ROUND_UP(n, to) (((n) + (to)-1) / (to) * (to))
#define PI              3.14159265358979323846
/* A block with less contrast than a slope of 0.01 ln a pixel says nothing. */
#define MIN_SLOPE (0.01 * 8 * LOG_SCALE / 32)
/* A block with less than one event in a hundred pixels says nothing, either. */
#define MIN_EVENTS (127.0 * 127.0 * 0.01)
/* A direction along all of a block's edges is as weak as if a hundredth of them crossed it. */
#define LEAST_SHARE 0.01F
#define MIN_BLOCKS  4 /* a significance needs a spread */

struct block {
    struct shef_flow_slope_sums slopes;
    float scores[N_DIRECTIONS];               /* the best of all disparities */
    struct shef_flow_sums sums[N_DIRECTIONS]; /* at that disparity */
};

struct shef_flow_search {
    /* Set by create, then read-only. */
    struct shef_flow_search_params params;
    int32_t width_px, height_px; /* of the halved picture */
    int32_t full_width_px, full_height_px;
    int32_t first_disparity, n_disparities; /* of the halved picture */
    int32_t n_block_columns, n_blocks;
    const struct shef_flow_kernels *flow;
    const struct shef_gradient_kernels *gradient;
    const struct shef_rectify_kernels *cells;
    int16_t logs[N_LOGS];
    float cosines[N_DIRECTIONS], sines[N_DIRECTIONS];
    /* Of the current picture. */
    size_t stride;
    int16_t *levels; /* three rows, with margins */
    uint16_t *sums;  /* one row */
    int16_t *gx, *gy;
    int16_t *events; /* with margins */
    struct block *blocks;
};

struct shef_flow_search_params shef_flow_search_default_params(
    const struct shef_rectification *profile)
{
    return (struct shef_flow_search_params){
        .first_disparity_px = 4 * profile->f_px / 555,
        .last_disparity_px = fmin(48 * profile->f_px / 555, MAX_DISPARITY),
        .min_significance = 3.5,
        .sure_margin = 0.20,
    };
}

static enum shef_err check(const struct shef_rectification *profile,
                           const struct shef_flow_search_params *p, struct shef_error *err)
{
    if (profile->width_px < 2 * BLOCK_PX || profile->height_px < 2 * BLOCK_PX ||
        profile->width_px > SHEF_IMAGE_MAX_SIDE_PX || profile->height_px > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "search for the flow in pictures of %d x %d px: sides must be %d to %d",
                         profile->width_px, profile->height_px, 2 * BLOCK_PX,
                         SHEF_IMAGE_MAX_SIDE_PX);
    if (!(p->first_disparity_px >= 0 && p->last_disparity_px >= p->first_disparity_px &&
          p->last_disparity_px <= MAX_DISPARITY))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "search for the flow at disparities %g to %g px: they must be 0 to %g, in "
                         "order",
                         p->first_disparity_px, p->last_disparity_px, MAX_DISPARITY);
    if (!(p->min_significance >= 0 && p->sure_margin >= 0 && p->sure_margin <= 1))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "search for the flow from a significance of %g and a margin of %g on: "
                         "they must be 0 or more, the margin at most 1",
                         p->min_significance, p->sure_margin);
    return SHEF_OK;
}

static bool allocate(struct shef_flow_search *search)
{
    const size_t n = search->stride * (size_t)search->height_px;

    search->levels = shef_memory_create(3 * search->stride, sizeof *search->levels);
    search->sums = shef_memory_create(search->stride, sizeof *search->sums);
    search->gx = shef_memory_create(n, sizeof *search->gx);
    search->gy = shef_memory_create(n, sizeof *search->gy);
    search->events = shef_memory_create(n, sizeof *search->events);
    search->blocks = shef_memory_create((size_t)search->n_blocks, sizeof *search->blocks);
    return search->levels && search->sums && search->gx && search->gy && search->events &&
           search->blocks;
}

enum shef_err shef_flow_search_create(struct shef_flow_search **out_search,
                                      const struct shef_rectification *profile,
                                      const struct shef_flow_search_params *params,
                                      uint32_t cpu_features, struct shef_error *err)
{
    const enum shef_err code = check(profile, params, err);

    if (code != SHEF_OK)
        return code;

    struct shef_flow_search *search = calloc(1, sizeof *search);

    if (search) {
        search->params = *params;
        search->full_width_px = profile->width_px;
        search->full_height_px = profile->height_px;
        search->width_px = profile->width_px / 2;
        search->height_px = profile->height_px / 2;
        search->n_block_columns = search->width_px / BLOCK_PX;
        search->n_blocks = search->n_block_columns * (search->height_px / BLOCK_PX);
        search->stride = ROUND_UP((size_t)search->width_px, 32) + 2 * MARGIN;
        search->first_disparity = (int32_t)floor(params->first_disparity_px / 2);
        search->n_disparities =
            (int32_t)ceil(params->last_disparity_px / 2) - search->first_disparity + 1;
    }
    if (!search || !allocate(search)) {
        shef_flow_search_destroy(search);
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "search for the flow in pictures of %d x %d px: out of memory",
                         profile->width_px, profile->height_px);
    }
    search->flow = shef_flow_pick(cpu_features);
    search->gradient = shef_gradient_pick(cpu_features);
    search->cells = shef_rectify_pick(cpu_features);
    for (int i = 0; i < N_LOGS; i++)
        search->logs[i] = (int16_t)lrint(LOG_SCALE * log((i / 4.0 + LOG_OFFSET) / LOG_OFFSET));
    for (int k = 0; k < N_DIRECTIONS; k++) {
        search->cosines[k] = (float)cos(2 * PI * k / N_DIRECTIONS);
        search->sines[k] = (float)sin(2 * PI * k / N_DIRECTIONS);
    }
    *out_search = search;
    return SHEF_OK;
}

void shef_flow_search_destroy(struct shef_flow_search *search)
{
    if (!search)
        return;
    free(search->levels);
    free(search->sums);
    free(search->gx);
    free(search->gy);
    free(search->events);
    free(search->blocks);
    free(search);
}

static int32_t clamped(int32_t value, int32_t last)
{
    return value < 0 ? 0 : value > last ? last : value;
}

/* Where row y's levels are kept. Rows outside the picture repeat the border. */
static int16_t *levels_of(const struct shef_flow_search *search, int32_t y)
{
    return search->levels + (size_t)(clamped(y, search->height_px - 1) % 3) * search->stride +
           MARGIN;
}

static void fill_levels(const struct shef_flow_search *search, struct shef_image_u8 image,
                        int32_t y)
{
    int16_t *levels = levels_of(search, y);

    search->cells->sum_cells(search->sums, shef_row_u8(image, 2 * y), shef_row_u8(image, 2 * y + 1),
                             search->width_px);
    for (int32_t x = 0; x < search->width_px; x++)
        levels[x] = search->logs[search->sums[x]];
    levels[-1] = levels[0];
    levels[search->width_px] = levels[search->width_px - 1];
}

/* The slopes of the halved frame and the halved events. */
static void prepare(const struct shef_flow_search *search, struct shef_image_u8 image,
                    const struct shef_edge_map *events)
{
    fill_levels(search, image, 0);
    for (int32_t y = 0; y < search->height_px; y++) {
        const size_t at = (size_t)y * search->stride + MARGIN;
        const int8_t *values = events->graded + (ptrdiff_t)2 * y * events->graded_stride_bytes;

        if (y + 1 < search->height_px)
            fill_levels(search, image, y + 1);

        const int16_t *const rows[3] = { levels_of(search, y - 1), levels_of(search, y),
                                         levels_of(search, y + 1) };

        search->gradient->sobel(search->gx + at, search->gy + at, rows, search->width_px);
        search->flow->shrink(search->gx + at, search->gx + at, search->width_px);
        search->flow->shrink(search->gy + at, search->gy + at, search->width_px);
        search->flow->halve(search->events + at, values, values + events->graded_stride_bytes,
                            search->width_px);
    }
}

/* The best correlation of a block in each direction over all disparities. */
static void match_block(const struct shef_flow_search *search, size_t at, struct block *block)
{
    const ptrdiff_t stride = (ptrdiff_t)search->stride;
    const struct shef_flow_slope_sums g =
        search->flow->measure(search->gx + at, search->gy + at, stride);
    const float n = BLOCK_PX * BLOCK_PX;
    const float slopes = (float)g.xx + (float)g.yy;
    float per_direction[N_DIRECTIONS];

    memset(block, 0, sizeof *block);
    block->slopes = g;
    if (slopes < (float)(MIN_SLOPE * MIN_SLOPE) * n)
        return;
    for (int k = 0; k < N_DIRECTIONS; k++) {
        const float c = search->cosines[k];
        const float s = search->sines[k];
        const float along = c * c * (float)g.xx + 2 * c * s * (float)g.xy + s * s * (float)g.yy;

        per_direction[k] = 1 / sqrtf(along + LEAST_SHARE * slopes);
    }
    for (int32_t d = 0; d < search->n_disparities; d++) {
        const struct shef_flow_sums sums =
            search->flow->correlate(search->events + at - search->first_disparity - d,
                                    search->gx + at, search->gy + at, stride);

        if ((float)sums.ee < (float)MIN_EVENTS * n)
            continue;

        const float scale = 1 / sqrtf((float)sums.ee);
        const float x = -(float)sums.ex * scale;
        const float y = -(float)sums.ey * scale;

        for (int k = 0; k < N_DIRECTIONS; k++) {
            const float score = (x * search->cosines[k] + y * search->sines[k]) * per_direction[k];

            if (score > block->scores[k]) {
                block->scores[k] = score;
                block->sums[k] = sums;
            }
        }
    }
}

static void match_blocks(struct shef_flow_search *search)
{
    for (int32_t b = 0; b < search->n_blocks; b++) {
        const size_t x = (size_t)(b % search->n_block_columns) * BLOCK_PX;
        const size_t y = (size_t)(b / search->n_block_columns) * BLOCK_PX;

        match_block(search, y * search->stride + MARGIN + x, &search->blocks[b]);
    }
}

static bool is_used(const struct block *block)
{
    return (double)block->slopes.xx + block->slopes.yy >=
           MIN_SLOPE * MIN_SLOPE * BLOCK_PX * BLOCK_PX;
}

/* The mean score of each direction over the blocks that have edges. Returns the best one. */
static int32_t add_scores(const struct shef_flow_search *search, double *out_scores)
{
    int32_t n_used = 0;
    int32_t best = 0;

    for (int32_t b = 0; b < search->n_blocks; b++) {
        const struct block *block = &search->blocks[b];

        n_used += is_used(block);
        for (int k = 0; k < N_DIRECTIONS; k++)
            out_scores[k] += block->scores[k];
    }
    for (int k = 0; k < N_DIRECTIONS; k++) {
        out_scores[k] /= n_used > 0 ? n_used : 1;
        if (out_scores[k] > out_scores[best])
            best = k;
    }
    return best;
}

/* How many standard deviations the mean lead of direction k over its opposite is above zero, over
 * the blocks that have edges. Where nothing moves, both are chance. */
static double significance_of(const struct shef_flow_search *search, int32_t k)
{
    const int32_t opposite = (k + N_DIRECTIONS / 2) % N_DIRECTIONS;
    double sum = 0;
    double squares = 0;
    int32_t n = 0;

    for (int32_t b = 0; b < search->n_blocks; b++) {
        const struct block *block = &search->blocks[b];
        const double lead = (double)block->scores[k] - (double)block->scores[opposite];

        if (!is_used(block))
            continue;
        sum += lead;
        squares += lead * lead;
        n++;
    }
    if (n < MIN_BLOCKS)
        return 0;

    const double variance = (squares - sum * sum / n) / (n - 1);

    return variance > 0 ? sum / sqrt(variance * n) : 0;
}

/* The flow u that explains events e best, e = -(gx, gy) . u, over all blocks, each at the disparity
 * that suits direction k and scaled to the same strength. Returns its angle. */
static double best_fit(const struct shef_flow_search *search, int32_t k)
{
    double xx = 0;
    double xy = 0;
    double yy = 0;
    double ex = 0;
    double ey = 0;

    for (int32_t b = 0; b < search->n_blocks; b++) {
        const struct shef_flow_slope_sums *g = &search->blocks[b].slopes;
        const struct shef_flow_sums *sums = &search->blocks[b].sums[k];
        const double slopes = (double)g->xx + g->yy;

        if (sums->ee == 0)
            continue;
        xx += g->xx / slopes;
        xy += g->xy / slopes;
        yy += g->yy / slopes;
        ex += sums->ex / sqrt(slopes * sums->ee);
        ey += sums->ey / sqrt(slopes * sums->ee);
    }

    /* All edges along one line: they only tell the motion across it. */
    if (xx * yy - xy * xy < 1e-3 * (xx + yy) * (xx + yy))
        return atan2(search->sines[k], search->cosines[k]);
    return atan2(xy * ex - xx * ey, xy * ey - yy * ex);
}

void shef_flow_search_run(struct shef_flow_search *search, struct shef_image_u8 image,
                          const struct shef_edge_map *events, struct shef_flow *out_flow)
{
    struct shef_flow flow = { .state = SHEF_FLOW_NONE };
    double away = 0;

    assert(image.width_px == search->full_width_px && image.height_px == search->full_height_px);
    assert(events->kind == SHEF_EDGE_GRADED && events->width_px == search->full_width_px &&
           events->height_px == search->full_height_px);
    prepare(search, image, events);
    match_blocks(search);

    const int32_t best = add_scores(search, flow.direction_scores);

    flow.score = flow.direction_scores[best];
    if (flow.score > 0) {
        for (int k = N_DIRECTIONS / 4; k <= N_DIRECTIONS * 3 / 4; k++)
            away = fmax(away, flow.direction_scores[(best + k) % N_DIRECTIONS]);
        flow.margin = 1 - away / flow.score;
        flow.significance = significance_of(search, best);
        flow.direction_rad = best_fit(search, best);
        flow.camera_velocity[0] = -cos(flow.direction_rad);
        flow.camera_velocity[1] = -sin(flow.direction_rad);
    }
    if (flow.significance >= search->params.min_significance)
        flow.state = flow.margin >= search->params.sure_margin ? SHEF_FLOW_FOUND : SHEF_FLOW_UNSURE;
    *out_flow = flow;
}

const char *shef_flow_search_isa(const struct shef_flow_search *search)
{
    return search->flow->isa;
}
