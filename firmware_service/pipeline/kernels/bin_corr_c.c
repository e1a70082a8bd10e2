#include <string.h>

#include "pipeline/kernels/bin_corr_band.h"

/* Column sums: int8 columns[x][lane]; those outside the image stay zero. */
typedef int8_t column[SHEF_BIN_CORR_MAX_LANES];

static int left_sign(const struct shef_bin_corr_job *job, int32_t x, int32_t y)
{
    const size_t at = (size_t)y * (size_t)job->stride_words + (size_t)(x / 64);
    const int plus = (int)(job->plus[at] >> (x % 64) & 1);
    const int minus = job->minus ? (int)(job->minus[at] >> (x % 64) & 1) : 0;

    return plus - minus;
}

/* Adds row y times factor (1: the row enters the window, -1: it leaves) to the column sums. */
static void add_row(const struct shef_bin_corr_job *job, const struct shef_bin_corr_group *group,
                    column *columns, int32_t y, int factor)
{
    if (y < 0 || y >= job->height_px)
        return;
    for (int32_t x = 0; x < job->width_px; x++) {
        const int sign = factor * left_sign(job, x, y);
        const int8_t *right =
            job->right + y * job->right_stride_bytes + job->right_origin - x + group->d_first;

        if (sign == 0)
            continue;
        for (int32_t k = 0; k < group->n_disparities; k++)
            columns[x][k] = (int8_t)(columns[x][k] + sign * right[k]);
    }
}

static void read_out(const struct shef_bin_corr_group *group, const int16_t *box,
                     int16_t *disparity, int16_t *sum)
{
    int32_t best = 0;

    for (int32_t k = 1; k < group->n_disparities; k++)
        if (box[k] > box[best])
            best = k;
    shef_bin_corr_put(group, disparity, sum, best, box[best]);
}

static void sweep_row(const struct shef_bin_corr_job *job, const struct shef_bin_corr_group *group,
                      column *columns, int32_t y)
{
    const int32_t r = job->radius_px;
    int16_t *disparity = shef_row_i16(job->disparity, y);
    int16_t *sum = shef_row_i16(job->sum, y);
    int16_t box[SHEF_BIN_CORR_MAX_LANES] = { 0 };

    for (int32_t x = 0; x < r; x++) /* the box around x = -1 */
        for (int32_t k = 0; k < group->n_disparities; k++)
            box[k] = (int16_t)(box[k] + columns[x][k]);
    for (int32_t x = 0; x < job->width_px; x++) {
        const int8_t *enters = columns[x + r];
        const int8_t *leaves = columns[x - r - 1];

        for (int32_t k = 0; k < group->n_disparities; k++)
            box[k] = (int16_t)(box[k] + enters[k] - leaves[k]);
        if (shef_bin_corr_read_out_word(job, y, x / 64) >> (x % 64) & 1)
            read_out(group, box, &disparity[x], &sum[x]);
    }
}

void shef_bin_corr_band_c(const struct shef_bin_corr_job *job,
                          const struct shef_bin_corr_group *group, int32_t y_begin, int32_t y_end,
                          uint8_t *scratch)
{
    const int32_t r = job->radius_px;
    column *columns = (column *)scratch + r + 1;

    memset(scratch, 0, shef_bin_corr_columns(job->width_px, r) * sizeof *columns);
    for (int32_t y = y_begin - r; y < y_begin + r; y++)
        add_row(job, group, columns, y, 1);
    for (int32_t y = y_begin; y < y_end; y++) {
        add_row(job, group, columns, y + r, 1);
        if (y > y_begin)
            add_row(job, group, columns, y - r - 1, -1);
        sweep_row(job, group, columns, y);
    }
}
