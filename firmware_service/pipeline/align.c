#include "pipeline/align.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Sums fade to 37 % over 50 pairs, about a second live: long against noise, short against the
 * minutes in which a mount warms up. */
#define KEEP_PER_PAIR 0.98

void shef_align_init(struct shef_align *align, int32_t width_px, int32_t height_px)
{
    memset(align, 0, sizeof *align);
    align->width_px = width_px;
    align->height_px = height_px;
}

struct block_sums {
    int64_t n;
    int64_t column; /* matched one of the right map */
    int64_t left;
    int64_t right[SHEF_ALIGN_N_SHIFTS];
    int64_t product[SHEF_ALIGN_N_SHIFTS];
};

/* One pixel per cell of row y, from column x0 to x1, alternating between the cell's columns. */
static void add_row(struct block_sums *sums, struct shef_image_i8 left, struct shef_image_i8 right,
                    struct shef_image_i16 disparity, int32_t y, int32_t x0, int32_t x1)
{
    const int8_t *left_row = shef_row_i8(left, y);
    const int16_t *cells = shef_row_i16(disparity, y / 2);

    for (int32_t x = x0 + (y / 2 + x0) % 2; x < x1; x += 2) {
        const int32_t matched = x - ((cells[x / 2] + 16) >> 5);

        if (matched < 0)
            continue;
        const int32_t value = left_row[x];
        const int8_t *column = shef_row_i8(right, y + SHEF_ALIGN_MAX_SHIFT) + matched;

        sums->n++;
        sums->column += matched;
        sums->left += value;
        for (int32_t s = 0; s < SHEF_ALIGN_N_SHIFTS; s++) {
            const int32_t e = column[-s * right.stride_bytes];

            sums->right[s] += e;
            sums->product[s] += value * e;
        }
    }
}

void shef_align_observe(struct shef_align *align, struct shef_image_i8 left,
                        struct shef_image_i8 right, struct shef_image_i16 disparity,
                        int32_t row_step)
{
    assert(row_step >= 1);

    /* The largest disparities have no partner at the left border; a twelfth is left out. */
    const int32_t first_x = align->width_px / 12;
    const int32_t first_row = (int32_t)(align->n_observed % row_step);

    for (int32_t by = 0; by < SHEF_ALIGN_ROWS; by++) {
        const int32_t y0 = by * align->height_px / SHEF_ALIGN_ROWS;
        const int32_t y1 = (by + 1) * align->height_px / SHEF_ALIGN_ROWS;

        for (int32_t bx = 0; bx < SHEF_ALIGN_COLUMNS; bx++) {
            const int32_t x0 = bx * align->width_px / SHEF_ALIGN_COLUMNS;
            const int32_t x1 = (bx + 1) * align->width_px / SHEF_ALIGN_COLUMNS;
            struct block_sums sums = { 0 };

            for (int32_t y = y0 + first_row; y < y1; y += row_step)
                if (y >= SHEF_ALIGN_MAX_SHIFT && y + SHEF_ALIGN_MAX_SHIFT < align->height_px)
                    add_row(&sums, left, right, disparity, y, x0 > first_x ? x0 : first_x, x1);

            double *score = align->score[by][bx];
            double *weight = &align->weight[by][bx];
            const double n = (double)sums.n;

            /* The mean column of all pairs so far, and how much it rests on. */
            *weight = KEEP_PER_PAIR * *weight + n;
            if (sums.n)
                align->column[by][bx] +=
                    ((double)sums.column - n * align->column[by][bx]) / *weight;

            for (int32_t s = 0; s < SHEF_ALIGN_N_SHIFTS; s++) {
                const double chance = sums.n ? (double)sums.left * (double)sums.right[s] / n : 0.0;

                score[s] = KEEP_PER_PAIR * score[s] + (double)sums.product[s] - chance;
            }
        }
    }
    align->n_observed++;
}

struct block_peak {
    double x, y;
    double shift_px;
    double weight;
};

/* The shift of highest covariance, with a parabola; false if it lies at the end of the range. */
static bool find_peak(const double score[SHEF_ALIGN_N_SHIFTS], struct block_peak *peak)
{
    int32_t best = 0;
    double mean = 0.0;

    for (int32_t s = 0; s < SHEF_ALIGN_N_SHIFTS; s++) {
        mean += score[s] / SHEF_ALIGN_N_SHIFTS;
        if (score[s] > score[best])
            best = s;
    }
    if (best == 0 || best == SHEF_ALIGN_N_SHIFTS - 1 || score[best] <= mean)
        return false;

    const double curve = score[best - 1] - 2.0 * score[best] + score[best + 1];
    const double offset = curve < 0.0 ? 0.5 * (score[best - 1] - score[best + 1]) / curve : 0.0;

    peak->shift_px = best - SHEF_ALIGN_MAX_SHIFT + offset;
    peak->weight = score[best] - mean;
    return true;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

enum shef_err shef_align_solve(const struct shef_align *align, struct shef_smooth_field *out_field,
                               double *out_spread_px)
{
    struct block_peak peaks[SHEF_ALIGN_ROWS * SHEF_ALIGN_COLUMNS];
    double distance[SHEF_ALIGN_ROWS * SHEF_ALIGN_COLUMNS];
    int32_t n_peaks = 0;

    for (int32_t by = 0; by < SHEF_ALIGN_ROWS; by++)
        for (int32_t bx = 0; bx < SHEF_ALIGN_COLUMNS; bx++)
            if (find_peak(align->score[by][bx], &peaks[n_peaks])) {
                peaks[n_peaks].x = align->column[by][bx];
                peaks[n_peaks].y = (by + 0.5) * align->height_px / SHEF_ALIGN_ROWS - 0.5;
                n_peaks++;
            }
    /* Six numbers from fewer than twelve blocks would follow their noise. */
    if (n_peaks < 2 * SHEF_FIELD_TERMS)
        return SHEF_ERR_EMPTY;

    struct shef_smooth_field field;

    /* Iteratively re-weighted least squares; half a pixel is far for a block's residual. */
    for (int round = 0; round < 6; round++) {
        struct shef_field_fit fit = shef_field_fit_begin(align->width_px, align->height_px);

        for (int32_t i = 0; i < n_peaks; i++) {
            const double away = round ? distance[i] / 0.5 : 0.0;

            shef_field_fit_add(&fit, peaks[i].x, peaks[i].y, peaks[i].shift_px,
                               peaks[i].weight / (1.0 + away * away));
        }
        if (shef_field_fit_solve(&fit, &field) != SHEF_OK)
            return SHEF_ERR_EMPTY;
        for (int32_t i = 0; i < n_peaks; i++)
            distance[i] = fabs(peaks[i].shift_px - shef_field_at(&field, peaks[i].x, peaks[i].y));
    }
    if (out_spread_px) {
        qsort(distance, (size_t)n_peaks, sizeof *distance, compare_doubles);
        *out_spread_px = distance[n_peaks / 2];
    }
    *out_field = field;
    return SHEF_OK;
}
