/* From the half grid to pixels: confidence of each cell, then disparity at the left view's edge
 * pixels and, if wanted, everywhere. */
#include "pipeline/robust_internal.h"

#include <math.h>

/* P(|error| <= 3 px after the declared bias) = logistic of
 *   BASE + MARGIN ln(margin / 1000) + TEXTURE sqrt(texture) + SPREAD ln(1 + spread)
 * with the winner's cost margin, the share of left edge pixels in the window and the spread of
 * disparity around the cell in px. Fitted by logistic regression on 48 real pairs; with each of
 * the three scenes left out in turn the coefficients move by less than a quarter, and the
 * calibration holds (docs/matcher.md, "Confidence"). */
#define LOGIT_BASE    (-0.298f)
#define LOGIT_MARGIN  0.801f
#define LOGIT_TEXTURE 4.568f
#define LOGIT_SPREAD  (-0.801f)

/* Cells from the centre at which the spread is sampled, in a 3x3 pattern. */
#define SPREAD_REACH 4

/* Neighbouring cells further than this from the best one lie on another surface. */
#define SAME_SURFACE_PX 4.0f

void robust_confidence_init(struct robust_confidence_tables *tables)
{
    for (int i = 0; i < 4096; i++)
        tables->margin[i] = LOGIT_BASE + LOGIT_MARGIN * logf(((float)i * 16.0f + 8.0f) / 1000.0f);
    for (int i = 0; i < 256; i++) {
        tables->texture[i] = LOGIT_TEXTURE * sqrtf((float)i / 255.0f);
        tables->spread[i] = LOGIT_SPREAD * log1pf((float)i / 4.0f);
    }
    for (int i = 0; i < 512; i++)
        tables->probability[i] = 1.0f / (1.0f + expf(8.0f - ((float)i + 0.5f) / 32.0f));
}

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* Largest minus smallest disparity of nine cells around (x, y), 1/32 px. */
static int32_t spread_at(const int16_t *const rows[3], int32_t x, int32_t last_x)
{
    const int32_t columns[3] = { clamp(x - SPREAD_REACH, 0, last_x), x,
                                 clamp(x + SPREAD_REACH, 0, last_x) };
    int32_t low = INT16_MAX;
    int32_t high = INT16_MIN;

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int32_t d = rows[i][columns[j]];

            low = d < low ? d : low;
            high = d > high ? d : high;
        }
    return high - low;
}

void robust_confidence_task(void *context, int32_t chunk, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct robust_confidence_tables *tables = matcher->tables;
    const struct robust_grid *grid = &matcher->grids[matcher->current];
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

        for (int32_t x = 0; x <= last_x; x++) {
            const int32_t spread = clamp(spread_at(rows, x, last_x) / 8, 0, 255);
            const float logit = tables->margin[margin[x] / 16] + tables->texture[texture[x]] +
                                tables->spread[spread];

            confidence[x] = tables->probability[clamp((int32_t)((logit + 8.0f) * 32.0f), 0, 511)];
        }
    }
}

/* The four cells whose centres surround a pixel, nearest first; their bilinear weights are
 * 9, 3, 3 and 1 sixteenths, because a pixel lies a quarter cell from its own cell's centre. */
struct pixel_cells {
    const int16_t *disparity[2]; /* near and far cell row */
    const uint16_t *margin[2];
    const float *confidence[2];
};

static struct pixel_cells cells_of_row(const struct shef_robust *matcher, int32_t y)
{
    const struct robust_grid *grid = &matcher->grids[matcher->current];
    const int32_t near_row = y / 2;
    const int32_t far_row =
        clamp(y % 2 ? near_row + 1 : near_row - 1, 0, matcher->shape.grid_height - 1);

    return (struct pixel_cells){
        .disparity = { shef_row_i16(grid->disparity, near_row),
                       shef_row_i16(grid->disparity, far_row) },
        .margin = { shef_row_u16(grid->margin, near_row), shef_row_u16(grid->margin, far_row) },
        .confidence = { shef_row_f32(matcher->cell_confidence, near_row),
                        shef_row_f32(matcher->cell_confidence, far_row) },
    };
}

/* Mean of the surrounding cells, weighted by nearness and margin; those that lie on another
 * surface than the heaviest one stay out. Returns px. */
static float pixel_disparity(const struct pixel_cells *cells, int32_t x, int32_t last_cell,
                             float *out_confidence)
{
    static const float nearness[4] = { 9.0f, 3.0f, 3.0f, 1.0f };
    const int32_t near_x = x / 2;
    const int32_t far_x = clamp(x % 2 ? near_x + 1 : near_x - 1, 0, last_cell);
    float disparity[4];
    float weight[4];
    int heaviest = 0;

    for (int i = 0; i < 4; i++) {
        const int32_t at = i & 1 ? far_x : near_x;

        disparity[i] = (float)cells->disparity[i >> 1][at];
        weight[i] = nearness[i] * ((float)cells->margin[i >> 1][at] + 1.0f);
        if (weight[i] > weight[heaviest])
            heaviest = i;
    }

    float sum = 0.0f;
    float total = 0.0f;

    for (int i = 0; i < 4; i++) {
        const float away = disparity[i] - disparity[heaviest];
        const float share =
            away < 32.0f * SAME_SURFACE_PX && away > -32.0f * SAME_SURFACE_PX ? weight[i] : 0.0f;

        sum += share * disparity[i];
        total += share;
    }
    *out_confidence = cells->confidence[heaviest >> 1][heaviest & 1 ? far_x : near_x];
    return sum / (total * 32.0f);
}

static void read_row(const struct shef_robust *matcher, int32_t y, float *bias)
{
    const struct shef_robust_output *output = matcher->output;
    const struct pixel_cells cells = cells_of_row(matcher, y);
    const int8_t *left = shef_row_i8(matcher->views[0].left, y);
    const int32_t last_cell = matcher->shape.grid_width - 1;
    const bool is_dense = output->dense_disparity.data != NULL;
    float *disparity = shef_row_f32(output->disparity, y);
    float *confidence = shef_row_f32(output->confidence, y);

    if (matcher->has_bias)
        shef_field_row(&matcher->bias, y, 0.0, 1.0, matcher->params.width_px, bias);
    for (int32_t x = 0; x < matcher->params.width_px; x++) {
        float d = 0.0f;
        float p = 0.0f;

        if (is_dense || left[x]) {
            d = pixel_disparity(&cells, x, last_cell, &p);
            if (matcher->has_bias)
                d -= bias[x];
            /* A bias may push a far point past infinity. */
            if (d <= 0.0f)
                d = p = 0.0f;
        }
        disparity[x] = left[x] ? d : 0.0f;
        confidence[x] = left[x] ? p : 0.0f;
        if (is_dense) {
            shef_row_f32(output->dense_disparity, y)[x] = d;
            if (output->dense_confidence.data)
                shef_row_f32(output->dense_confidence, y)[x] = p;
        }
    }
}

void robust_pixels_task(void *context, int32_t chunk_index, int32_t worker)
{
    struct shef_robust *matcher = context;
    const int32_t height = matcher->params.height_px;
    int32_t first;
    int32_t last;

    (void)worker;
    robust_chunk_rows(matcher, chunk_index, &first, &last);
    for (int32_t y = 2 * first; y < 2 * last && y < height; y++)
        read_row(matcher, y, matcher->chunks[chunk_index].bias);
}
