/* The read-out on vectors, written once for every instruction set.
 *
 * The including file first includes its vec_*.h and defines vec_f and vec_i, VEC_CELLS lanes of
 * float and of int32, and the further vec_ functions used here. vec_load_cells() and
 * vec_store_values() may keep the lanes in an order of their own, as long as the second undoes the
 * first. The meaning of every line is in decay_c.c. */

#include "pipeline/kernels/decay.h"

#define VEC_CELLS (VEC_LANES / 2)

static const float poly[] = SHEF_DECAY_POLY;

static inline vec_i vec_values(const struct shef_decay_cell *cells, const struct shef_decay *decay)
{
    vec_i level;
    vec_i t_us;

    vec_load_cells(cells, &level, &t_us);

    const vec_i age = vec_max_i(vec_sub_i(vec_set_i((int32_t)decay->at_us), t_us), vec_set_i(0));
    const vec_f halvings = vec_mul_f(vec_to_f(vec_min_i(age, vec_set_i(decay->horizon_us))),
                                     vec_set_f(decay->halvings_per_us));
    const vec_i whole = vec_truncate(halvings);
    const vec_f rest = vec_sub_f(halvings, vec_to_f(whole));
    const vec_i exponent = vec_sub_i(vec_set_i(127 - SHEF_DECAY_LEVEL_SHIFT), whole);
    const vec_f scale = vec_as_f(vec_shift_left_i(exponent, 23));
    vec_f factor = vec_set_f(poly[4]);

    for (int k = 3; k >= 0; k--)
        factor = vec_add_f(vec_mul_f(factor, rest), vec_set_f(poly[k]));
    return vec_round(vec_mul_f(vec_to_f(level), vec_mul_f(factor, scale)));
}

static void row_vec(int16_t *out_values, const struct shef_decay_cell *cells, int32_t n,
                    const struct shef_decay *decay)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store_values(out_values + i, vec_values(cells + i, decay),
                         vec_values(cells + i + VEC_CELLS, decay));
    shef_decay_kernels_c.row(out_values + i, cells + i, n - i, decay);
}

static void accrue_vec(int16_t *values, int16_t *before, const int16_t *sums, int32_t n,
                       int16_t weight_q15)
{
    const vec weight = vec_set1(weight_q15);
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES) {
        const vec now = vec_load(sums + i);
        const vec gained = vec_sub(now, vec_load(before + i));

        vec_store(values + i, vec_add_saturated(vec_load(values + i), vec_mulhrs(gained, weight)));
        vec_store(before + i, now);
    }
    shef_decay_kernels_c.accrue(values + i, before + i, sums + i, n - i, weight_q15);
}
