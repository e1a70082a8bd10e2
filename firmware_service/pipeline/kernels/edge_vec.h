/* The edge kernels on vectors of 16-bit lanes, written once for every instruction set.
 *
 * The including file first includes its vec_*.h and defines the further vec_ functions used here.
 * The meaning of every line is in edge_c.c. */

#include <stddef.h>

#include "pipeline/kernels/edge.h"

#define VECS_PER_WORD (64 / VEC_LANES)
/* A lane counts up to 2^16 - 1 before it has to be added up. */
#define COUNT_STRETCH (VEC_LANES * 32768)

static uint32_t count_vec(const int16_t *values, int32_t n, int32_t threshold)
{
    const vec below = vec_set1((int16_t)(threshold - 1));
    const int32_t n_whole = n / VEC_LANES * VEC_LANES;
    uint32_t n_far = 0;

    for (int32_t start = 0; start < n_whole; start += COUNT_STRETCH) {
        const int32_t end = n_whole - start < COUNT_STRETCH ? n_whole : start + COUNT_STRETCH;
        vec counts = vec_set1(0);

        for (int32_t i = start; i < end; i += VEC_LANES)
            counts = vec_count(counts, vec_above(vec_abs(vec_load(values + i)), below));
        n_far += vec_total(counts);
    }
    return n_far + shef_edge_kernels_c.count(values + n_whole, n - n_whole, threshold);
}

static void bits_vec(uint64_t *plus, uint64_t *minus, const int16_t *values, int32_t n,
                     int32_t threshold)
{
    const vec below = vec_set1((int16_t)(threshold - 1));
    const vec above = vec_set1((int16_t)(1 - threshold));
    const int32_t n_words = n / 64;

    for (int32_t word = 0; word < n_words; word++) {
        uint64_t plus_bits = 0;
        uint64_t minus_bits = 0;

        for (int32_t k = 0; k < VECS_PER_WORD; k++) {
            const vec value = vec_load(values + word * 64 + k * VEC_LANES);

            plus_bits |= (uint64_t)vec_bits(vec_above(minus ? value : vec_abs(value), below))
                         << (k * VEC_LANES);
            minus_bits |= (uint64_t)vec_bits(vec_above(above, value)) << (k * VEC_LANES);
        }
        plus[word] = plus_bits;
        if (minus)
            minus[word] = minus_bits;
    }
    shef_edge_kernels_c.bits(plus + n_words, minus ? minus + n_words : NULL, values + n_words * 64,
                             n - n_words * 64, threshold);
}

static inline vec graded_lanes(vec value, const struct shef_edge_scale *scale)
{
    const vec clamped =
        vec_min(vec_max(value, vec_set1((int16_t)-scale->limit)), vec_set1(scale->limit));
    const vec scaled = vec_mulhrs(vec_shift_left(clamped, scale->shift), vec_set1(scale->gain));

    return vec_shift_right(vec_add(scaled, vec_set1(64)), 7);
}

static void graded_vec(int8_t *out, const int16_t *values, int32_t n,
                       const struct shef_edge_scale *scale)
{
    int32_t i = 0;

    for (; i + 2 * VEC_LANES <= n; i += 2 * VEC_LANES)
        vec_store_bytes(out + i, graded_lanes(vec_load(values + i), scale),
                        graded_lanes(vec_load(values + i + VEC_LANES), scale));
    shef_edge_kernels_c.graded(out + i, values + i, n - i, scale);
}

static inline vec_select ridge_lanes(const int16_t *const rows[3], int32_t i, vec below)
{
    const vec value = vec_load(rows[1] + i);
    const vec left = vec_load(rows[1] + i - 1);
    const vec right = vec_load(rows[1] + i + 1);
    const vec upper = vec_load(rows[0] + i);
    const vec lower = vec_load(rows[2] + i);
    const vec_select is_level = vec_above(vec_average(left, right), vec_average(upper, lower));
    const vec first = vec_choose(is_level, upper, left);
    const vec second = vec_choose(is_level, lower, right);

    return vec_both_not(vec_both(vec_above(value, below), vec_above(value, first)),
                        vec_above(second, value));
}

static void ridges_vec(uint64_t *out_words, const int16_t *const rows[3], int32_t n,
                       int32_t threshold)
{
    const vec below = vec_set1((int16_t)(threshold - 1));
    const int32_t n_words = n / 64;

    for (int32_t word = 0; word < n_words; word++) {
        uint64_t bits = 0;

        for (int32_t k = 0; k < VECS_PER_WORD; k++)
            bits |= (uint64_t)vec_bits(ridge_lanes(rows, word * 64 + k * VEC_LANES, below))
                    << (k * VEC_LANES);
        out_words[word] = bits;
    }

    const int16_t *const rest[3] = { rows[0] + n_words * 64, rows[1] + n_words * 64,
                                     rows[2] + n_words * 64 };

    shef_edge_kernels_c.ridges(out_words + n_words, rest, n - n_words * 64, threshold);
}
