/* Parameters checked and turned into sizes, fixed-point scales and memory. */
#include "pipeline/robust_internal.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"

/* Vector loads may run this many lanes past a row's end. */
#define PAD_LANES 64

struct shef_robust_params shef_robust_defaults(int32_t width_px, int32_t height_px,
                                               enum shef_edge_kind kind)
{
    const bool is_signed = kind != SHEF_EDGE_UNSIGNED;

    return (struct shef_robust_params){
        .width_px = width_px,
        .height_px = height_px,
        .max_disparity_px = 80,
        .step_px = 2,
        .window_width_cells = is_signed ? 7 : 19,
        .window_height_cells = is_signed ? 7 : 9,
        .kind = kind,
        .regularisation = 0.01,
        .p1 = 240,
        .p2 = 3600,
        .use_past = true,
        .prior_cost_per_px = 25.0,
        .saturated_cost_per_px = 60.0,
        .prior_cap_px = 24.0,
        .confidence_scale = 1.0,
        .saturated_share = 0.40,
        .jump_reach_px = 0,
        .jump_least_px = 0.8,
        .jump_picture_weight = 2.1,
        .jump_growth_cost = 0.5,
    };
}

/* The largest shift that keeps value below 2^15. */
static int16_t spare_bits(double value)
{
    int16_t bits = 0;

    while (value * 2.0 < 32768.0 && bits < 14) {
        value *= 2.0;
        bits++;
    }
    return bits;
}

/* The correlation in kernels/match.h, with every product as large as int16 allows:
 * |covariance| <= window * amplitude^2, and after the left gain at most sigma_right * smallest. */
static struct shef_match_scale scale_of(const struct robust_shape *shape, bool is_signed)
{
    const double largest = (double)shape->window_px * shape->amplitude * shape->amplitude;
    const double variance = is_signed ? largest : largest / 4.0;
    const double floor2 = shape->smallest_sigma * shape->smallest_sigma;
    struct shef_match_scale scale = { .shift = spare_bits(largest), .is_signed = is_signed };

    scale.gain_shift = spare_bits(sqrt((variance + floor2) * floor2) * (1 << scale.shift));
    scale.unit = (int16_t)lrint(32768.0 * SHEF_MATCH_COST_ONE /
                                (floor2 * (1 << (scale.shift + scale.gain_shift))));
    return scale;
}

void robust_shape_set_levels(struct robust_shape *shape, int32_t n_levels)
{
    shape->n_levels = n_levels;
    /* At least one lane without a level ends each cell's levels. */
    shape->n_lanes = (n_levels / SHEF_MATCH_LANE_MULTIPLE + 1) * SHEF_MATCH_LANE_MULTIPLE;
}

void robust_shape_init(struct robust_shape *shape, const struct shef_robust_params *params)
{
    const bool is_signed = params->kind != SHEF_EDGE_UNSIGNED;
    const int32_t window_cells = params->window_width_cells * params->window_height_cells;

    *shape = (struct robust_shape){
        .grid_width = (params->width_px + 1) / 2,
        .grid_height = (params->height_px + 1) / 2,
        .half_width = params->window_width_cells / 2,
        .half_height = params->window_height_cells / 2,
        .pairs_per_cell = 2 / params->step_px,
        .window_px = 4 * window_cells,
        .amplitude = 1,
    };
    robust_shape_set_levels(shape, params->max_disparity_px / params->step_px);
    shape->left_length = shape->grid_width + shape->half_width;
    shape->right_front = shape->left_length * shape->pairs_per_cell;
    shape->right_length =
        shape->right_front + shape->n_lanes + shape->half_width * shape->pairs_per_cell + PAD_LANES;
    /* A window of products must fit int16; more than 15 grades bring nothing. */
    if (params->kind == SHEF_EDGE_GRADED) {
        const int32_t most = (int32_t)sqrt(32767.0 / shape->window_px);

        shape->amplitude = most < 1 ? 1 : most > 15 ? 15 : most;
    }
    shape->offset = is_signed ? shape->amplitude : 0;
    shape->smallest_sigma = sqrt(params->regularisation * shape->window_px) * shape->amplitude;
    shape->scale = scale_of(shape, is_signed);
}

static enum shef_err check(const struct shef_robust_params *params, struct shef_error *err)
{
    const struct {
        const char *name;
        double value;
        double low;
        double high;
    } ranges[] = {
        { "width (px)", params->width_px, 32, SHEF_ROBUST_MAX_SIDE_PX },
        { "height (px)", params->height_px, 32, SHEF_ROBUST_MAX_SIDE_PX },
        { "largest disparity (px)", params->max_disparity_px, 16, 256 },
        { "disparity step (px)", params->step_px, 1, 2 },
        { "window width (cells)", params->window_width_cells, 1, 31 },
        { "window height (cells)", params->window_height_cells, 1, 31 },
        { "regularisation", params->regularisation, 0.005, 0.5 },
        { "p1", params->p1, 1, SHEF_MATCH_MAX_PENALTY },
        { "p2", params->p2, params->p1, SHEF_MATCH_MAX_PENALTY },
        { "score weight", params->score_weight, 0, 64 },
        { "prior cost per px", params->prior_cost_per_px, 0, 64 },
        { "saturated cost per px", params->saturated_cost_per_px, 0, 64 },
        { "prior cap (px)", params->prior_cap_px, 0, 31 },
        { "confidence scale", params->confidence_scale, 0.1, 10 },
        { "confidence offset", params->confidence_offset, -10, 10 },
        { "saturated share", params->saturated_share, 0, 1 },
        { "jump reach (px)", params->jump_reach_px, 0, SHEF_ROBUST_MAX_REACH_PX },
        { "least jump (px)", params->jump_least_px, 0.25, 16 },
        { "jump picture weight", params->jump_picture_weight, 0, 64 },
        { "jump growth cost", params->jump_growth_cost, 0, 64 },
    };

    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++)
        if (!(ranges[i].value >= ranges[i].low && ranges[i].value <= ranges[i].high))
            return shef_fail(err, SHEF_ERR_INVALID, "matcher: %s is %g, must be %g to %g",
                             ranges[i].name, ranges[i].value, ranges[i].low, ranges[i].high);
    if (params->window_width_cells % 2 == 0 || params->window_height_cells % 2 == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "matcher: a window of %d x %d cells has no centre, both must be odd",
                         params->window_width_cells, params->window_height_cells);
    if (params->max_disparity_px >= params->width_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "matcher: disparities up to %d px are more than the image is wide (%d px)",
                         params->max_disparity_px, params->width_px);

    const int32_t beyond_px = params->max_disparity_px % params->step_px;

    if (beyond_px != 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "matcher: largest disparity %d px is no multiple of the step, %d px; "
                         "choose %d px",
                         params->max_disparity_px, params->step_px,
                         params->max_disparity_px - beyond_px);
    return SHEF_OK;
}

/* Hands out memory and remembers whether any request failed. */
struct allocator {
    size_t total_bytes;
    bool failed;
};

static void *take(struct allocator *from, size_t n_items, size_t item_bytes)
{
    void *memory = shef_memory_create(n_items, item_bytes);

    from->total_bytes += shef_memory_round_up(n_items * item_bytes);
    from->failed |= memory == NULL;
    return memory;
}

#define TAKE_IMAGE(from, image, width, height)                                                     \
    do {                                                                                           \
        (image)->width_px = (width);                                                               \
        (image)->height_px = (height);                                                             \
        (image)->stride_bytes =                                                                    \
            (ptrdiff_t)shef_memory_round_up((size_t)(width) * sizeof *(image)->data);              \
        (image)->data = take(from, (size_t)(height), (size_t)(image)->stride_bytes);               \
    } while (0)

static void take_sums(struct allocator *from, struct robust_sums *sums, size_t n, bool is_signed)
{
    sums->column_sum = take(from, n, sizeof(int16_t));
    sums->window_sum = take(from, n, sizeof(int32_t));
    sums->column_square = is_signed ? take(from, n, sizeof(int16_t)) : sums->column_sum;
    sums->window_square = is_signed ? take(from, n, sizeof(int32_t)) : sums->window_sum;
}

/* Nine rows of floats with a value to spare on both sides. */
static void take_cells(struct allocator *from, struct robust_chunk *chunk, int32_t grid_width)
{
    const size_t n = (size_t)grid_width + 2;
    float *next = take(from, 9 * n, sizeof *next);

    chunk->cell_memory = next;
    for (int i = 0; next && i < 3; i++) {
        chunk->cells[i] = (struct shef_cell_row){ next + 1, next + 1 + n, next + 1 + 2 * n };
        next += 3 * n;
    }
}

static void take_chunk(struct allocator *from, struct robust_chunk *chunk,
                       const struct robust_shape *shape)
{
    const size_t n_pixels = 2 * (size_t)shape->grid_width;
    const size_t n_columns = (size_t)(shape->left_length + shape->half_width + 1);
    const size_t n_left = (size_t)shape->left_length;
    const size_t n_right = (size_t)shape->right_length;

    chunk->columns = take(from, n_columns * (size_t)shape->n_lanes + PAD_LANES, sizeof(int16_t));
    take_sums(from, &chunk->left, n_left, shape->offset > 0);
    take_sums(from, &chunk->right, n_right, shape->offset > 0);
    chunk->left_mean = take(from, n_left, sizeof(int16_t));
    chunk->left_gain = take(from, n_left, sizeof(int16_t));
    chunk->right_scaled = take(from, n_right, sizeof(int16_t));
    chunk->right_gain = take(from, n_right, sizeof(int16_t));
    chunk->weight = take(from, n_left, sizeof(int16_t));
    chunk->aligned_memory = take(from, (size_t)(2 * shape->grid_width) + 2 * PAD_LANES, 1);
    chunk->aligned = chunk->aligned_memory ? chunk->aligned_memory + PAD_LANES : NULL;
    take_cells(from, chunk, shape->grid_width);
    chunk->low = take(from, n_left, sizeof(int16_t));
    chunk->high = take(from, n_left, sizeof(int16_t));
    for (int i = 0; i < 2; i++) {
        chunk->side_disparity[i] = take(from, n_left, sizeof(float));
        chunk->side_confidence[i] = take(from, n_left, sizeof(float));
    }
    chunk->pixel_disparity = take(from, n_pixels, sizeof(float));
    chunk->pixel_confidence = take(from, n_pixels, sizeof(float));
    chunk->bias = take(from, n_pixels, sizeof(float));
    for (int i = 0; i < 2; i++)
        chunk->paths[i] =
            take(from, (size_t)(SHEF_MATCH_PATH_CELLS * shape->n_lanes), sizeof(uint16_t));
    chunk->strip_sums = take(from, (size_t)shape->grid_height * STRIP_CELLS,
                             (size_t)shape->n_lanes * sizeof(uint16_t));
}

static void take_view(struct allocator *from, struct robust_view *view,
                      const struct robust_shape *shape, bool settles_jumps)
{
    const size_t n_rows = 2 * (size_t)shape->grid_height;

    TAKE_IMAGE(from, &view->left, 2 * shape->grid_width, 2 * shape->grid_height);
    TAKE_IMAGE(from, &view->right, 2 * shape->grid_width, 2 * shape->grid_height);
    if (settles_jumps)
        TAKE_IMAGE(from, &view->aligned, 2 * shape->grid_width, 2 * shape->grid_height);
    view->left_pairs = take(from, n_rows * (size_t)shape->left_length, sizeof(uint16_t));
    view->right_pairs = take(from, n_rows * (size_t)shape->right_length, sizeof(uint16_t));
}

static void take_grid(struct allocator *from, struct robust_grid *grid,
                      const struct robust_shape *shape, const struct shef_robust_params *params)
{
    TAKE_IMAGE(from, &grid->disparity, shape->grid_width, shape->grid_height);
    TAKE_IMAGE(from, &grid->margin, shape->grid_width, shape->grid_height);
    TAKE_IMAGE(from, &grid->texture, shape->grid_width, shape->grid_height);
    TAKE_IMAGE(from, &grid->expected, shape->grid_width, shape->grid_height);
    TAKE_IMAGE(from, &grid->trust, shape->grid_width, shape->grid_height);
    TAKE_IMAGE(from, &grid->thumbnail, params->width_px / THUMBNAIL_PX,
               params->height_px / THUMBNAIL_PX);
}

/* The volumes are most of a matcher's memory, and nothing in them outlives a pair. */
static void take_volumes(struct allocator *from, struct shef_robust *matcher,
                         const struct shef_robust *lender)
{
    const struct robust_shape *shape = &matcher->shape;

    matcher->volume_lanes =
        (size_t)shape->grid_height * (size_t)shape->grid_width * (size_t)shape->n_lanes + PAD_LANES;
    if (lender) {
        assert(lender->volume_lanes >= matcher->volume_lanes);
        matcher->has_lent_volumes = true;
        matcher->costs = lender->costs;
        matcher->sums = lender->sums;
    } else {
        matcher->costs = take(from, matcher->volume_lanes, sizeof(uint16_t));
        matcher->sums = take(from, matcher->volume_lanes, sizeof(uint16_t));
    }
}

static void take_all(struct allocator *from, struct shef_robust *matcher,
                     const struct shef_robust *lender)
{
    const struct robust_shape *shape = &matcher->shape;

    take_volumes(from, matcher, lender);
    matcher->zero_left = take(from, (size_t)shape->left_length, sizeof(uint16_t));
    matcher->zero_right = take(from, (size_t)shape->right_length, sizeof(uint16_t));
    matcher->tables = take(from, 1, sizeof *matcher->tables);
    TAKE_IMAGE(from, &matcher->cell_confidence, shape->grid_width, shape->grid_height);
    for (int i = 0; i < 2; i++) {
        take_view(from, &matcher->views[i], shape, matcher->params.jump_reach_px > 0);
        take_grid(from, &matcher->grids[i], shape, &matcher->params);
    }
    matcher->chunks = take(from, (size_t)matcher->n_chunks, sizeof *matcher->chunks);
    for (int32_t i = 0; matcher->chunks && i < matcher->n_chunks; i++)
        take_chunk(from, &matcher->chunks[i], shape);
}

struct shef_robust *shef_robust_create(const struct shef_robust_params *params,
                                       uint32_t cpu_features, struct shef_workers *workers,
                                       struct shef_error *err)
{
    return shef_robust_create_beside(params, cpu_features, workers, NULL, err);
}

struct shef_robust *shef_robust_create_beside(const struct shef_robust_params *params,
                                              uint32_t cpu_features, struct shef_workers *workers,
                                              const struct shef_robust *lender,
                                              struct shef_error *err)
{
    struct allocator from = { 0 };

    if (check(params, err) != SHEF_OK)
        return NULL;

    struct shef_robust *matcher = take(&from, 1, sizeof *matcher);

    if (matcher) {
        matcher->params = *params;
        matcher->kernels = shef_match_pick(cpu_features);
        matcher->rows = shef_rows_pick(cpu_features);
        matcher->workers = workers;
        matcher->n_chunks = workers ? shef_workers_count(workers) : 1;
        robust_shape_init(&matcher->shape, params);
        take_all(&from, matcher, lender);
    }
    if (from.failed) {
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY,
                        "matcher for %d x %d px and %d px of disparity: no memory for %zu MB; "
                        "choose a smaller range",
                        params->width_px, params->height_px, params->max_disparity_px,
                        from.total_bytes >> 20);
        shef_robust_destroy(matcher);
        return NULL;
    }
    matcher->memory_bytes = from.total_bytes;
    memset(matcher->zero_left, matcher->shape.offset,
           (size_t)matcher->shape.left_length * sizeof *matcher->zero_left);
    robust_confidence_init(matcher->tables, params);
    return matcher;
}

size_t shef_robust_memory_bytes(const struct shef_robust *matcher)
{
    return matcher->memory_bytes;
}

const char *shef_robust_isa(const struct shef_robust *matcher)
{
    return matcher->kernels->isa;
}

static void free_sums(struct robust_sums *sums)
{
    if (sums->column_square != sums->column_sum)
        free(sums->column_square);
    if (sums->window_square != sums->window_sum)
        free(sums->window_square);
    free(sums->column_sum);
    free(sums->window_sum);
}

static void free_chunk(struct robust_chunk *chunk)
{
    free(chunk->columns);
    free_sums(&chunk->left);
    free_sums(&chunk->right);
    free(chunk->left_mean);
    free(chunk->left_gain);
    free(chunk->right_scaled);
    free(chunk->right_gain);
    free(chunk->weight);
    free(chunk->aligned_memory);
    free(chunk->cell_memory);
    free(chunk->low);
    free(chunk->high);
    for (int i = 0; i < 2; i++) {
        free(chunk->side_disparity[i]);
        free(chunk->side_confidence[i]);
    }
    free(chunk->pixel_disparity);
    free(chunk->pixel_confidence);
    free(chunk->bias);
    free(chunk->paths[0]);
    free(chunk->paths[1]);
    free(chunk->strip_sums);
}

void shef_robust_destroy(struct shef_robust *matcher)
{
    if (!matcher)
        return;
    for (int32_t i = 0; matcher->chunks && i < matcher->n_chunks; i++)
        free_chunk(&matcher->chunks[i]);
    free(matcher->chunks);
    for (int i = 0; i < 2; i++) {
        struct robust_view *view = &matcher->views[i];
        struct robust_grid *grid = &matcher->grids[i];

        free(view->left.data);
        free(view->right.data);
        free(view->aligned.data);
        free(view->left_pairs);
        free(view->right_pairs);
        free(grid->disparity.data);
        free(grid->margin.data);
        free(grid->texture.data);
        free(grid->expected.data);
        free(grid->trust.data);
        free(grid->thumbnail.data);
    }
    free(matcher->cell_confidence.data);
    free(matcher->tables);
    free(matcher->zero_left);
    free(matcher->zero_right);
    if (!matcher->has_lent_volumes) {
        free(matcher->costs);
        free(matcher->sums);
    }
    free(matcher);
}
