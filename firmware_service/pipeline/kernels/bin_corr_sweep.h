/* The loops that the vector implementations share; bin_corr.h says how they work.
 *
 * Private to kernels/bin_corr_*.c. A file defines the types and functions below for its
 * instruction set, then includes this header, then calls sweep_band() with constants, from which
 * the compiler makes one straight loop each. A column's sums are 64 bytes in one plane and rest
 * bytes (0, 16 or 64) in another, so that every load of the 64 is aligned.
 *
 *   struct lanes                        which lanes the group uses; the others must stay 0
 *   struct box                          running box sums of one row
 *   lanes_set(n)                        the first n lanes
 *   column_add(main, rest, e, lanes, subtract, n_rest)   adds event bytes to one column
 *   box_enter(box, main, rest, n_rest)  adds one column to the box
 *   box_step(box, main_in, main_out, rest_in, rest_out, n_rest, is_signed)   one pixel further
 *   box_park(box, parked, n_rest)       stores the box, at most SHEF_BIN_CORR_BOX_BYTES
 *   box_best(parked, n_rest, out_sum)   its largest sum and, returned, the first lane with it */
#ifndef SHEF_PIPELINE_KERNELS_BIN_CORR_SWEEP_H
#define SHEF_PIPELINE_KERNELS_BIN_CORR_SWEEP_H

#define MAIN_LANES 64

struct sweep {
    const struct shef_bin_corr_job *job;
    const struct shef_bin_corr_group *group;
    struct lanes lanes;
    uint8_t *main;   /* of column 0: MAIN_LANES bytes a column, -radius_px - 1 and on */
    uint8_t *rest;   /* of column 0: n_rest bytes a column, likewise */
    uint8_t *parked; /* boxes of one block that are to be read out */
};

/* Adds (or subtracts) one row of event bytes to every column of a word of left edges. */
static ALWAYS_INLINE void add_word(const struct sweep *s, uint64_t bits, int32_t word,
                                   const int8_t *right, const bool subtract, const int32_t n_rest)
{
    for (; bits; bits &= bits - 1) {
        const int32_t x = word * 64 + __builtin_ctzll(bits);

        column_add(s->main + (ptrdiff_t)MAIN_LANES * x, s->rest + (ptrdiff_t)n_rest * x, right - x,
                   &s->lanes, subtract, n_rest);
    }
}

/* Row y enters the window, or leaves it. */
static ALWAYS_INLINE void add_row(const struct sweep *s, int32_t y, const bool leaves,
                                  const int32_t n_rest, const bool is_signed)
{
    const struct shef_bin_corr_job *job = s->job;

    if (y < 0 || y >= job->height_px)
        return;

    const int8_t *right =
        job->right + y * job->right_stride_bytes + job->right_origin + s->group->d_first;
    const size_t first_word = (size_t)y * (size_t)job->stride_words;
    const int32_t n_words = (job->width_px + 63) / 64;

    for (int32_t i = 0; i < n_words; i++) {
        const uint64_t plus = job->plus[first_word + (size_t)i];

        if (is_signed && job->minus) {
            const uint64_t minus = job->minus[first_word + (size_t)i];

            add_word(s, plus & ~minus, i, right, leaves, n_rest);
            add_word(s, minus & ~plus, i, right, !leaves, n_rest);
        } else {
            add_word(s, plus, i, right, leaves, n_rest);
        }
    }
}

/* Moves the box along row y, parks it where a sum is wanted, and reads out the parked ones. */
static ALWAYS_INLINE void sweep_row(const struct sweep *s, int32_t y, const int32_t n_rest,
                                    const bool is_signed)
{
    const struct shef_bin_corr_job *job = s->job;
    const ptrdiff_t r = job->radius_px;
    const int32_t bias = is_signed ? SHEF_BIN_CORR_BIAS * (2 * job->radius_px + 1) : 0;
    int16_t *disparity = shef_row_i16(job->disparity, y);
    int16_t *sum = shef_row_i16(job->sum, y);
    struct box box = { 0 };

    /* The box around x = -1. Of unsigned maps the columns outside add nothing. */
    for (ptrdiff_t x = is_signed ? -r - 1 : 0; x < r; x++)
        box_enter(&box, s->main + MAIN_LANES * x, s->rest + n_rest * x, n_rest);

    for (int32_t x_begin = 0; x_begin < job->width_px; x_begin += 64) {
        const uint64_t wanted = shef_bin_corr_read_out_word(job, y, x_begin / 64);
        const int32_t n_left = job->width_px - x_begin;
        const int32_t n = n_left < 64 ? n_left : 64;
        const uint8_t *main_in = s->main + MAIN_LANES * (x_begin + r);
        const uint8_t *main_out = s->main + MAIN_LANES * (x_begin - r - 1);
        const uint8_t *rest_in = s->rest + n_rest * (x_begin + r);
        const uint8_t *rest_out = s->rest + n_rest * (x_begin - r - 1);
        uint8_t *parked = s->parked;

#pragma GCC unroll 4
        for (int32_t i = 0; i < n; i++) {
            box_step(&box, main_in + MAIN_LANES * i, main_out + MAIN_LANES * i,
                     rest_in + n_rest * i, rest_out + n_rest * i, n_rest, is_signed);
            /* Always stored, kept only if wanted: no branch to mispredict. */
            box_park(&box, parked, n_rest);
            parked += (wanted >> i & 1) * SHEF_BIN_CORR_BOX_BYTES;
        }
        parked = s->parked;
        for (uint64_t bits = wanted; bits; bits &= bits - 1) {
            const int32_t x = x_begin + __builtin_ctzll(bits);
            int32_t best;
            const int32_t lane = box_best(parked, n_rest, &best);

            shef_bin_corr_put(s->group, &disparity[x], &sum[x], lane, best - bias);
            parked += SHEF_BIN_CORR_BOX_BYTES;
        }
    }
}

static ALWAYS_INLINE void sweep_band(const struct shef_bin_corr_job *job,
                                     const struct shef_bin_corr_group *group, int32_t y_begin,
                                     int32_t y_end, uint8_t *scratch, const int32_t n_rest,
                                     const bool is_signed)
{
    const size_t n_columns = shef_bin_corr_columns(job->width_px, job->radius_px);
    const size_t n_left = (size_t)job->radius_px + 1;
    uint8_t *main = scratch + SHEF_BIN_CORR_BLOCK_PX * SHEF_BIN_CORR_BOX_BYTES;
    uint8_t *rest = main + n_columns * MAIN_LANES;
    const struct sweep s = {
        .job = job,
        .group = group,
        .lanes = lanes_set(group->n_disparities),
        .main = main + n_left * MAIN_LANES,
        .rest = rest + n_left * (size_t)n_rest,
        .parked = scratch,
    };

    memset(main, 0, n_columns * (MAIN_LANES + (size_t)n_rest));
    if (is_signed) {
        const int32_t n = group->n_disparities;
        const int32_t n_main = n < MAIN_LANES ? n : MAIN_LANES;

        for (size_t i = 0; i < n_columns; i++) {
            memset(main + i * MAIN_LANES, SHEF_BIN_CORR_BIAS, (size_t)n_main);
            memset(rest + i * (size_t)n_rest, SHEF_BIN_CORR_BIAS, (size_t)(n - n_main));
        }
    }

    for (int32_t y = y_begin - job->radius_px; y < y_begin + job->radius_px; y++)
        add_row(&s, y, false, n_rest, is_signed);
    for (int32_t y = y_begin; y < y_end; y++) {
        add_row(&s, y + job->radius_px, false, n_rest, is_signed);
        if (y > y_begin)
            add_row(&s, y - job->radius_px - 1, true, n_rest, is_signed);
        sweep_row(&s, y, n_rest, is_signed);
    }
}

/* Picks the loop that is made for this group. */
static inline void sweep_band_any(const struct shef_bin_corr_job *job,
                                  const struct shef_bin_corr_group *group, int32_t y_begin,
                                  int32_t y_end, uint8_t *scratch)
{
    const int32_t n = group->n_disparities;

    if (job->is_signed) {
        if (n <= MAIN_LANES)
            sweep_band(job, group, y_begin, y_end, scratch, 0, true);
        else
            sweep_band(job, group, y_begin, y_end, scratch, MAIN_LANES, true);
    } else if (n <= MAIN_LANES) {
        sweep_band(job, group, y_begin, y_end, scratch, 0, false);
    } else if (n <= MAIN_LANES + 16) {
        sweep_band(job, group, y_begin, y_end, scratch, 16, false);
    } else {
        sweep_band(job, group, y_begin, y_end, scratch, MAIN_LANES, false);
    }
}

#endif
