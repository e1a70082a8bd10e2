/* The gradient kernels on vectors of 16-bit lanes, written once for every instruction set.
 *
 * The including file first includes its vec_*.h and defines the further vec_ functions used here.
 * The meaning of every line is in gradient_c.c. */

#include "pipeline/kernels/gradient.h"

#define VECS_PER_WORD (64 / VEC_LANES)
#define TAN_22_5_Q15  13573

static void widen_vec(int16_t *out, const uint8_t *pixels, int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, vec_load_pixels(pixels + i));
    shef_gradient_kernels_c.widen(out + i, pixels + i, n - i);
}

static void sobel_vec(int16_t *out_gx, int16_t *out_gy, const int16_t *const rows[3], int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES) {
        const vec a0 = vec_load(rows[0] + i - 1);
        const vec a1 = vec_load(rows[0] + i);
        const vec a2 = vec_load(rows[0] + i + 1);
        const vec b = vec_sub(vec_load(rows[1] + i + 1), vec_load(rows[1] + i - 1));
        const vec c0 = vec_load(rows[2] + i - 1);
        const vec c1 = vec_load(rows[2] + i);
        const vec c2 = vec_load(rows[2] + i + 1);
        const vec left = vec_sub(c0, a0);
        const vec middle = vec_sub(c1, a1);
        const vec right = vec_sub(c2, a2);

        vec_store(out_gx + i, vec_add(vec_add(vec_sub(a2, a0), vec_sub(c2, c0)), vec_add(b, b)));
        vec_store(out_gy + i, vec_add(vec_add(left, right), vec_add(middle, middle)));
    }

    const int16_t *const rest[3] = { rows[0] + i, rows[1] + i, rows[2] + i };

    shef_gradient_kernels_c.sobel(out_gx + i, out_gy + i, rest, n - i);
}

static void length_vec(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, vec_length(vec_load(gx + i), vec_load(gy + i)));
    shef_gradient_kernels_c.length(out + i, gx + i, gy + i, n - i);
}

static void along_vec(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n, int16_t ux,
                      int16_t uy)
{
    const vec x = vec_set1(ux);
    const vec y = vec_set1(uy);
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i,
                  vec_add(vec_mulhrs(vec_load(gx + i), x), vec_mulhrs(vec_load(gy + i), y)));
    shef_gradient_kernels_c.along(out + i, gx + i, gy + i, n - i, ux, uy);
}

/* Whole vectors only: the reference cannot start in the middle of a row. The caller's last vector
 * overlaps the one before. */
static void along_rays_at(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t i,
                          const struct shef_gradient_rays *rays)
{
    vec ux;
    vec uy;

    vec_rays(&ux, &uy, rays, i);
    vec_store(out + i, vec_add(vec_mulhrs(vec_load(gx + i), ux), vec_mulhrs(vec_load(gy + i), uy)));
}

static void along_rays_vec(int16_t *out, const int16_t *gx, const int16_t *gy, int32_t n,
                           const struct shef_gradient_rays *rays)
{
    int32_t i = 0;

    if (n < VEC_LANES) {
        shef_gradient_kernels_c.along_rays(out, gx, gy, n, rays);
        return;
    }
    for (; i + VEC_LANES <= n; i += VEC_LANES)
        along_rays_at(out, gx, gy, i, rays);
    if (i < n)
        along_rays_at(out, gx, gy, n - VEC_LANES, rays);
}

static void difference_vec(int16_t *out, const int16_t *a, const int16_t *b, int32_t n)
{
    int32_t i = 0;

    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, vec_sub(vec_load(a + i), vec_load(b + i)));
    shef_gradient_kernels_c.difference(out + i, a + i, b + i, n - i);
}

static inline vec_select thin_lanes(const int16_t *const rows[3], const int16_t *gx,
                                    const int16_t *gy, int32_t i, vec below)
{
    const vec tangent = vec_set1(TAN_22_5_Q15);
    const vec gx_here = vec_load(gx + i);
    const vec gy_here = vec_load(gy + i);
    const vec x = vec_abs(gx_here);
    const vec y = vec_abs(gy_here);
    const vec value = vec_load(rows[1] + i);
    const vec_select is_not_level = vec_above(y, vec_mulhrs(x, tangent));
    const vec_select is_not_upright = vec_above(x, vec_mulhrs(y, tangent));
    const vec_select is_rising = vec_above(vec_set1(0), vec_xor(gx_here, gy_here));
    const vec diagonal_before =
        vec_choose(is_rising, vec_load(rows[0] + i + 1), vec_load(rows[0] + i - 1));
    const vec diagonal_after =
        vec_choose(is_rising, vec_load(rows[2] + i - 1), vec_load(rows[2] + i + 1));
    const vec slanted_before = vec_choose(is_not_upright, diagonal_before, vec_load(rows[0] + i));
    const vec slanted_after = vec_choose(is_not_upright, diagonal_after, vec_load(rows[2] + i));
    const vec before = vec_choose(is_not_level, slanted_before, vec_load(rows[1] + i - 1));
    const vec after = vec_choose(is_not_level, slanted_after, vec_load(rows[1] + i + 1));

    return vec_both_not(vec_both(vec_above(value, below), vec_above(value, before)),
                        vec_above(after, value));
}

static void thin_vec(uint64_t *out_words, const int16_t *const rows[3], const int16_t *gx,
                     const int16_t *gy, int32_t n, int32_t threshold)
{
    const vec below = vec_set1((int16_t)(threshold - 1));
    const int32_t n_words = n / 64;

    for (int32_t word = 0; word < n_words; word++) {
        uint64_t bits = 0;

        for (int32_t k = 0; k < VECS_PER_WORD; k++)
            bits |= (uint64_t)vec_bits(thin_lanes(rows, gx, gy, word * 64 + k * VEC_LANES, below))
                    << (k * VEC_LANES);
        out_words[word] = bits;
    }

    const int32_t done = n_words * 64;
    const int16_t *const rest[3] = { rows[0] + done, rows[1] + done, rows[2] + done };

    shef_gradient_kernels_c.thin(out_words + n_words, rest, gx + done, gy + done, n - done,
                                 threshold);
}
