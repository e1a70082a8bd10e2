/* Jumps of depth put back to where pixels say they are.
 *
 * A window that sees two surfaces finds the one with more edges in it, so winners jump a few pixels
 * beside the true outline: mostly the nearer surface is too wide. Around each jump of the pixels'
 * disparities, along rows and along columns, both surfaces are held against the maps pixel by
 * pixel, in stripes of BREADTH pixels across the line, and the outline goes to where
 *
 *   evidence of the pixels before it for the surface before it
 *   + evidence of those behind it for the surface behind it
 *   + step of brightness of the left view at the outline (objects mostly end at an edge)
 *   - a price for each pixel by which the nearer surface grows
 *
 * is largest. The pixels between the old and the new outline get the other surface's disparity.
 * Disparities before this stage are kept, and rows and columns both go by those; columns have the
 * last word. No line reads what another one writes, so workers do not show. */
#include "pipeline/robust_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LANES       8  /* pixels along a line that are weighed: twice the largest reach */
#define BREADTH     7  /* of the stripes, odd, below LANES */
#define COLUMN_STEP 64 /* columns of a task */

/* Steps of brightness count up to this many grey levels. */
#define FULL_STEP 96

/* How often moved pixels are right, by the confidence c that they had on the other surface: LEAST +
 * SLOPE c. In rendered recordings of four scenes, all modes: 25 to 50 % where c was least, 64 to
 * 73 % where it was above 0.9. */
#define MOVED_LEAST 0.25f
#define MOVED_SLOPE 0.5f

_Static_assert(2 * SHEF_ROBUST_MAX_REACH_PX <= LANES, "all places of an outline fit");

/* A jump between two neighbouring pixels of a row or a column. */
struct jump {
    int32_t x, y;   /* the last pixel before it */
    bool is_column; /* the line is a column: the jump is to the pixel below */
    float before;   /* disparities of both surfaces, px */
    float behind;
};

/* What the kernel reads from one view: columns from x and rows from y on. */
static struct shef_rows_patch patch_of(const struct robust_view *view, const struct jump *jump,
                                       int32_t x, int32_t y, int32_t n_rows)
{
    const float disparity[2] = { jump->before, jump->behind };
    struct shef_rows_patch patch = {
        .left = shef_row_i8(view->left, y) + x,
        .left_stride = view->left.stride_bytes,
        .right_stride = view->aligned.stride_bytes,
        .n_rows = n_rows,
    };

    for (int i = 0; i < 2; i++) {
        const int32_t steps = (int32_t)lrintf(disparity[i] * SHEF_ROWS_EVIDENCE_FINE);
        const int32_t fraction = steps % SHEF_ROWS_EVIDENCE_FINE;

        patch.at[i] = shef_row_i8(view->aligned, y) + x - steps / SHEF_ROWS_EVIDENCE_FINE;
        patch.weight[i][0] = (int16_t)(SHEF_ROWS_EVIDENCE_FINE - fraction);
        patch.weight[i][1] = (int16_t)fraction;
    }
    return patch;
}

/* Evidence of each pixel of the line for the surface before the jump.
 *   out  2 reach sums from reach - 1 pixels before the jump's last pixel on */
static void weigh_line(const struct shef_robust *matcher, const struct jump *jump,
                       int32_t out[LANES])
{
    const int32_t reach = matcher->params.jump_reach_px;

    memset(out, 0, LANES * sizeof *out);
    for (int32_t view = 0; view < matcher->n_pairs; view++) {
        if (jump->is_column) {
            const struct shef_rows_patch patch = patch_of(
                &matcher->views[view], jump, jump->x - BREADTH / 2, jump->y - reach + 1, 2 * reach);
            int32_t rows[LANES * LANES];

            memset(rows, 0, (size_t)(2 * reach * LANES) * sizeof *rows);
            matcher->rows->evidence(&patch, LANES, rows);
            for (int32_t i = 0; i < 2 * reach; i++)
                for (int32_t lane = 0; lane < BREADTH; lane++)
                    out[i] += rows[i * LANES + lane];
        } else {
            const struct shef_rows_patch patch = patch_of(
                &matcher->views[view], jump, jump->x - reach + 1, jump->y - BREADTH / 2, BREADTH);

            matcher->rows->evidence(&patch, 0, out);
        }
    }
}

/* The steps of brightness along the line, 0..1; 0 without a picture.
 *   out  2 reach + 1 steps, of which the middle one is at the jump */
static void measure_steps(const struct shef_robust *matcher, const struct jump *jump,
                          float out[LANES + 1])
{
    const struct shef_image_u8 picture = matcher->pairs[0].picture;
    const int32_t reach = matcher->params.jump_reach_px;
    const ptrdiff_t along = jump->is_column ? picture.stride_bytes : 1;
    const ptrdiff_t across = jump->is_column ? 1 : picture.stride_bytes;
    int32_t before = 0;

    memset(out, 0, (LANES + 1) * sizeof *out);
    if (!picture.data)
        return;

    const uint8_t *at = shef_row_u8(picture, jump->y) + jump->x - reach * along;

    for (int32_t i = -1; i <= 2 * reach; i++, at += along) {
        const int32_t brightness = at[-across] + 2 * at[0] + at[across];
        const int32_t step = abs(brightness - before);

        if (i >= 0)
            out[i] = step < 4 * FULL_STEP ? (float)step * (1.0f / (4.0f * FULL_STEP)) : 1.0f;
        before = brightness;
    }
}

/* By how many pixels the outline moves along the line, -reach .. reach. */
static int32_t best_move(const struct shef_robust *matcher, const struct jump *jump)
{
    const struct shef_robust_params *params = &matcher->params;
    const int32_t reach = params->jump_reach_px;
    const int32_t amplitude = matcher->shape.amplitude;
    const float unit = 1.0f / (float)(2 * SHEF_ROWS_EVIDENCE_FINE * SHEF_ROWS_EVIDENCE_FINE *
                                      amplitude * amplitude * matcher->n_pairs);
    const float growth_cost = (float)params->jump_growth_cost;
    const float picture_weight = (float)params->jump_picture_weight;
    const bool is_near_before = jump->before > jump->behind;
    float value[LANES + 1];
    float steps[LANES + 1];
    int32_t evidence[LANES];
    int32_t sum = 0;
    int32_t best = 0;

    weigh_line(matcher, jump, evidence);
    measure_steps(matcher, jump, steps);
    for (int32_t move = -reach; move <= reach; move++) {
        const int32_t growth = is_near_before ? move : -move;

        value[move + reach] = (float)sum * unit + picture_weight * steps[move + reach] -
                              (growth > 0 ? growth_cost * (float)growth : 0.0f);
        if (move < reach)
            sum += evidence[move + reach];
    }
    for (int32_t distance = 1; distance <= reach; distance++)
        for (int32_t move = -distance; move <= distance; move += 2 * distance)
            if (value[move + reach] > value[best + reach])
                best = move;
    return best;
}

/* Whether all that is looked at around a jump lies in both maps. */
static bool is_inside(const struct shef_robust *matcher, const struct jump *jump)
{
    const int32_t widest = (int32_t)fmaxf(jump->before, jump->behind) + 1;

    return jump->x - LANES / 2 - widest >= 0 && jump->x + LANES + 1 < matcher->params.width_px &&
           jump->y - LANES / 2 >= 0 && jump->y + LANES / 2 + 1 < matcher->params.height_px;
}

/* Puts the outline of one jump right, and the two pixels beside it, which may be a mixture of both
 * surfaces, on one of them. */
static void settle(struct shef_robust *matcher, const struct jump *jump)
{
    if (!is_inside(matcher, jump))
        return;

    const struct shef_image_f32 disparity = matcher->pixel_disparity;
    const struct shef_image_f32 confidence = matcher->pixel_confidence;
    const int32_t move = best_move(matcher, jump);
    const int32_t first = move < 0 ? move : 0; /* in pixels from the jump's last one, less one */
    const int32_t last = move > 0 ? move : 0;

    for (int32_t i = first; i <= last + 1; i++) {
        const int32_t x = jump->x + (jump->is_column ? 0 : i);
        const int32_t y = jump->y + (jump->is_column ? i : 0);
        const bool was_before = i <= 0;
        const bool is_before = i <= move;

        if (was_before == is_before && i != 0 && i != 1)
            continue;
        shef_row_f32(disparity, y)[x] = is_before ? jump->before : jump->behind;
        if (was_before != is_before)
            shef_row_f32(confidence, y)[x] =
                MOVED_LEAST + MOVED_SLOPE * shef_row_f32(confidence, y)[x];
    }
}

/* Looks for jumps at n pixels of a row and settles them.
 *   lines  disparities of the pixel before the last one, the last one, the first one behind and
 *          the next one, at column x */
static void settle_run(struct shef_robust *matcher, const float *const lines[4], int32_t x,
                       int32_t y, int32_t n, bool is_column)
{
    uint8_t marks[SHEF_ROBUST_MAX_SIDE_PX + sizeof(uint64_t)];

    matcher->rows->find_jumps(lines, n, (float)matcher->params.jump_least_px, marks);
    memset(marks + n, 0, sizeof(uint64_t));
    for (int32_t first = 0; first < n; first += (int32_t)sizeof(uint64_t)) {
        uint64_t left;

        memcpy(&left, marks + first, sizeof left);
        for (; left; left &= left - 1) {
            const int32_t i = first + __builtin_ctzll(left) / 8;
            const struct jump jump = { x + i, y, is_column, lines[0][i], lines[3][i] };

            settle(matcher, &jump);
        }
    }
}

void robust_settle_row(struct shef_robust *matcher, int32_t y)
{
    const int32_t width = matcher->params.width_px;
    float *row = shef_row_f32(matcher->raw_disparity, y);
    const float *const lines[4] = { row, row + 1, row + 2, row + 3 };

    memcpy(row, shef_row_f32(matcher->pixel_disparity, y), (size_t)width * sizeof *row);
    settle_run(matcher, lines, 1, y, width - 3, false);
}

int32_t robust_n_column_tasks(const struct shef_robust *matcher)
{
    return (matcher->params.width_px + COLUMN_STEP - 1) / COLUMN_STEP;
}

void robust_settle_columns_task(void *context, int32_t task, int32_t worker)
{
    struct shef_robust *matcher = context;
    const struct shef_image_f32 disparity = matcher->raw_disparity;
    const int32_t first = task * COLUMN_STEP;
    const int32_t width = matcher->params.width_px;
    const int32_t last = width - first < COLUMN_STEP ? width : first + COLUMN_STEP;

    (void)worker;
    for (int32_t y = 1; y + 2 < matcher->params.height_px; y++) {
        const float *const lines[4] = {
            shef_row_f32(disparity, y - 1) + first,
            shef_row_f32(disparity, y) + first,
            shef_row_f32(disparity, y + 1) + first,
            shef_row_f32(disparity, y + 2) + first,
        };

        settle_run(matcher, lines, first, y, last - first, true);
    }
}
