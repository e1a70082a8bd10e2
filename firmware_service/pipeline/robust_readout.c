/* From the half grid to pixels: confidence of each cell, then disparity at the left view's edge
 * pixels and, if wanted, everywhere. */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <string.h>

/* P(|error| <= 3 px after the declared bias) = logistic of
 *   BASE + MARGIN ln(margin / 1000) + TEXTURE sqrt(texture) + SPREAD ln(1 + spread)
 * with the winner's cost margin, the share of left edge pixels in the window and the spread of
 * disparity around the cell in px. Fitted by logistic regression on 48 real pairs of three scenes;
 * fitted on two scenes it stays calibrated on the third (docs/matcher.md, "Confidence"). */
#define LOGIT_BASE    0.147f
#define LOGIT_MARGIN  0.751f
#define LOGIT_TEXTURE 4.279f
#define LOGIT_SPREAD  (-0.974f)

/* Cells from the centre at which the spread is sampled, in a 3x3 pattern. */
#define SPREAD_REACH 4

/* Neighbouring cells further than this from the best one lie on another surface. */
#define SAME_SURFACE_PX 4.0f

void robust_confidence_init(struct robust_confidence_tables *tables,
                            const struct shef_robust_params *params)
{
    const float scale = (float)params->confidence_scale;
    const float offset = (float)params->confidence_offset;

    for (int i = 0; i < 4096; i++)
        tables->margin[i] =
            offset +
            scale * (LOGIT_BASE + LOGIT_MARGIN * logf(((float)i * 16.0f + 8.0f) / 1000.0f));
    for (int i = 0; i < 256; i++) {
        tables->texture[i] = scale * LOGIT_TEXTURE * sqrtf((float)i / 255.0f);
        tables->spread[i] = scale * LOGIT_SPREAD * log1pf((float)i / 4.0f);
    }
    for (int i = 0; i < 512; i++)
        tables->probability[i] = 1.0f / (1.0f + expf(8.0f - ((float)i + 0.5f) / 32.0f));
}

static int32_t min_of(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* Smallest and largest of three cell rows, per column. */
static void fill_extremes(const int16_t *const rows[3], int32_t n, int16_t *restrict low,
                          int16_t *restrict high)
{
    for (int32_t x = 0; x < n; x++) {
        const int16_t a = rows[0][x], b = rows[1][x], c = rows[2][x];
        const int16_t low_ab = a < b ? a : b;
        const int16_t high_ab = a > b ? a : b;

        low[x] = low_ab < c ? low_ab : c;
        high[x] = high_ab > c ? high_ab : c;
    }
}

void robust_confidence_task(void *context, int32_t chunk, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_confidence_tables *tables = matcher->tables;
    const struct robust_grid *grid = &matcher->grids[matcher->current];
    const struct robust_chunk *memory = &matcher->chunks[chunk];
    int16_t *low = memory->low;
    int16_t *high = memory->high;
    const int32_t last_x = matcher->shape.grid_width - 1;
    const int32_t last_y = matcher->shape.grid_height - 1;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk, &first, &last);
    for (int32_t y = first; y < last; y++) {
        const int16_t *const rows[3] = {
            shef_row_i16(grid->disparity, clamp(y - SPREAD_REACH, 0, last_y)),
            shef_row_i16(grid->disparity, y),
            shef_row_i16(grid->disparity, clamp(y + SPREAD_REACH, 0, last_y)),
        };
        const uint16_t *margin = shef_row_u16(grid->margin, y);
        const uint8_t *texture = shef_row_u8(grid->texture, y);
        float *confidence = shef_row_f32(matcher->cell_confidence, y);

        fill_extremes(rows, last_x + 1, low, high);
        for (int32_t x = 0; x <= last_x; x++) {
            const int32_t before = x < SPREAD_REACH ? 0 : x - SPREAD_REACH;
            const int32_t after = x > last_x - SPREAD_REACH ? last_x : x + SPREAD_REACH;
            const int32_t least = min_of(low[x], min_of(low[before], low[after]));
            const int32_t most = -min_of(-high[x], min_of(-high[before], -high[after]));
            const int32_t spread = min_of((most - least) / 8, 255);
            const float logit = tables->margin[margin[x] / 16] + tables->texture[texture[x]] +
                                tables->spread[spread];

            confidence[x] = tables->probability[clamp((int32_t)((logit + 8.0f) * 32.0f), 0, 511)];
        }
    }
}

/* One cell row as floats, the first and last cell repeated outside: [-1 .. grid_width]. */
static void fill_cells(const struct shef_robust *matcher, int32_t y, struct shef_cell_row *out)
{
    const struct robust_grid *grid = &matcher->grids[matcher->current];
    const int16_t *disparity = shef_row_i16(grid->disparity, y);
    const uint16_t *margin = shef_row_u16(grid->margin, y);
    const float *confidence = shef_row_f32(matcher->cell_confidence, y);
    const int32_t n = matcher->shape.grid_width;

    for (int32_t x = 0; x < n; x++) {
        out->disparity[x] = (float)disparity[x];
        out->weight[x] = (float)margin[x] + 1.0f;
        out->confidence[x] = confidence[x];
    }
    for (int32_t side = 0; side < 2; side++) {
        const int32_t from = side ? n - 1 : 0;
        const int32_t to = side ? n : -1;

        out->disparity[to] = out->disparity[from];
        out->weight[to] = out->weight[from];
        out->confidence[to] = out->confidence[from];
    }
}

/* An image of every pixel in a volume's memory. */
static struct shef_image_f32 image_in(const struct shef_robust *matcher, uint16_t *volume,
                                      int32_t place)
{
    const ptrdiff_t stride_bytes =
        (ptrdiff_t)(2 * matcher->shape.grid_width) * (ptrdiff_t)sizeof(float);

    return (struct shef_image_f32){
        .data =
            (float *)((uint8_t *)volume + place * 2 * matcher->shape.grid_height * stride_bytes),
        .width_px = matcher->params.width_px,
        .height_px = matcher->params.height_px,
        .stride_bytes = stride_bytes,
    };
}

void robust_begin_read_out(struct shef_robust *matcher)
{
    const struct shef_robust_output *output = matcher->output;
    const bool is_dense = output->dense_disparity.data && output->dense_confidence.data;

    /* The volumes have done their work: 2 bytes for each lane of each fourth pixel. */
    _Static_assert(SHEF_MATCH_LANE_MULTIPLE * sizeof(uint16_t) / 4 >= 2 * sizeof(float),
                   "a volume has room for two images");
    matcher->raw_disparity = image_in(matcher, matcher->sums, 0);
    matcher->pixel_disparity = (struct shef_image_f32){ 0 };
    matcher->pixel_confidence = (struct shef_image_f32){ 0 };
    /* Rows come in whole cells: an image of odd width has no room for the last one's second. */
    if (is_dense && matcher->params.width_px == 2 * matcher->shape.grid_width) {
        matcher->pixel_disparity = output->dense_disparity;
        matcher->pixel_confidence = output->dense_confidence;
    } else if (matcher->params.jump_reach_px > 0) {
        matcher->pixel_disparity = image_in(matcher, matcher->sums, 1);
        matcher->pixel_confidence = image_in(matcher, matcher->costs, 0);
    }
}

/* Where every pixel of a row goes first. */
struct pixel_row {
    float *disparity;
    float *confidence;
};

static struct pixel_row pixel_row_of(const struct shef_robust *matcher,
                                     const struct robust_chunk *chunk, int32_t y)
{
    if (!matcher->pixel_disparity.data)
        return (struct pixel_row){ chunk->pixel_disparity, chunk->pixel_confidence };
    return (struct pixel_row){ shef_row_f32(matcher->pixel_disparity, y),
                               shef_row_f32(matcher->pixel_confidence, y) };
}

/* One pixel row from its own cell row and the nearer neighbouring one. */
static void read_row(const struct shef_robust *matcher, const struct robust_chunk *chunk,
                     const struct shef_cell_row *near_row, const struct shef_cell_row *far_row,
                     int32_t y)
{
    const struct shef_row_kernels *rows = matcher->rows;
    const struct pixel_row out = pixel_row_of(matcher, chunk, y);
    const int32_t n_cells = matcher->shape.grid_width;

    for (int side = 0; side < 2; side++)
        rows->side(near_row, far_row, side ? 1 : -1, n_cells, 32.0f * SAME_SURFACE_PX,
                   chunk->side_disparity[side], chunk->side_confidence[side]);
    rows->interleave(chunk->side_disparity[0], chunk->side_disparity[1], n_cells, out.disparity);
    rows->interleave(chunk->side_confidence[0], chunk->side_confidence[1], n_cells, out.confidence);
}

/* A row of the output from its pixels. */
static void finish_row(const struct shef_robust *matcher, const struct robust_chunk *chunk,
                       int32_t y)
{
    const struct shef_row_kernels *rows = matcher->rows;
    const struct shef_robust_output *output = matcher->output;
    const struct pixel_row pixels = pixel_row_of(matcher, chunk, y);
    const int32_t width = matcher->params.width_px;
    const size_t n_bytes = (size_t)width * sizeof(float);
    const int8_t *left = shef_row_i8(matcher->views[0].left, y);

    if (matcher->has_bias) {
        shef_field_row(&matcher->bias, y, 0.0, 1.0, width, chunk->bias);
        rows->take_off_bias(chunk->bias, width, pixels.disparity, pixels.confidence);
    }
    if (output->disparity.data)
        rows->keep_edges(left, pixels.disparity, width, shef_row_f32(output->disparity, y));
    if (output->confidence.data)
        rows->keep_edges(left, pixels.confidence, width, shef_row_f32(output->confidence, y));
    if (matcher->pixel_disparity.data &&
        matcher->pixel_disparity.data == output->dense_disparity.data)
        return;
    if (output->dense_disparity.data)
        memcpy(shef_row_f32(output->dense_disparity, y), pixels.disparity, n_bytes);
    if (output->dense_confidence.data)
        memcpy(shef_row_f32(output->dense_confidence, y), pixels.confidence, n_bytes);
}

void robust_pixels_task(void *context, int32_t chunk_index, int32_t worker)
{
    struct shef_robust *matcher = context;
    struct robust_chunk *chunk = &matcher->chunks[chunk_index];
    const int32_t last_cell_row = matcher->shape.grid_height - 1;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk_index, &first, &last);
    /* Three cell rows in turn: above, own, below. */
    fill_cells(matcher, clamp(first - 1, 0, last_cell_row), &chunk->cells[0]);
    fill_cells(matcher, first, &chunk->cells[1]);
    for (int32_t y = first; y < last; y++) {
        const struct shef_cell_row *above = &chunk->cells[(y - first) % 3];
        const struct shef_cell_row *own = &chunk->cells[(y - first + 1) % 3];
        struct shef_cell_row *below = &chunk->cells[(y - first + 2) % 3];

        fill_cells(matcher, clamp(y + 1, 0, last_cell_row), below);
        for (int32_t half = 0; half < 2 && 2 * y + half < matcher->params.height_px; half++) {
            read_row(matcher, chunk, own, half ? below : above, 2 * y + half);
            if (matcher->params.jump_reach_px > 0)
                robust_settle_row(matcher, 2 * y + half);
            else
                finish_row(matcher, chunk, 2 * y + half);
        }
    }
}

void robust_finish_task(void *context, int32_t chunk, int32_t worker)
{
    const struct shef_robust *matcher = context;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk, &first, &last);
    for (int32_t y = 2 * first; y < 2 * last && y < matcher->params.height_px; y++)
        finish_row(matcher, &matcher->chunks[chunk], y);
}
