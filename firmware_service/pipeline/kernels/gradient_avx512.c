/* 32 lanes: AVX-512. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/kernels/vec_avx512.h"

static inline vec vec_load_pixels(const uint8_t *from)
{
    return _mm512_cvtepu8_epi16(_mm256_loadu_si256((const __m256i *)(const void *)from));
}

static inline vec vec_xor(vec a, vec b)
{
    return _mm512_xor_si512(a, b);
}

static inline __m512i length_of(__m512i pairs)
{
    const __m512 root = _mm512_sqrt_ps(_mm512_cvtepi32_ps(_mm512_madd_epi16(pairs, pairs)));

    return _mm512_cvtps_epi32(_mm512_mul_ps(_mm512_set1_ps(SHEF_GRADIENT_LENGTH_SCALE), root));
}

static inline vec vec_length(vec gx, vec gy)
{
    /* Unpacking and packing both work on 128-bit quarters. */
    return _mm512_packs_epi32(length_of(_mm512_unpacklo_epi16(gx, gy)),
                              length_of(_mm512_unpackhi_epi16(gx, gy)));
}

static inline __m512 ray_x(const struct shef_gradient_rays *rays, __m512i i)
{
    return _mm512_add_ps(_mm512_set1_ps(rays->first_x),
                         _mm512_mul_ps(_mm512_set1_ps(rays->step_x), _mm512_cvtepi32_ps(i)));
}

static inline __m512 ray_scale(__m512 x, __m512 y)
{
    const __m512 length = _mm512_sqrt_ps(_mm512_add_ps(_mm512_mul_ps(x, x), _mm512_mul_ps(y, y)));
    const __mmask16 is_any = _mm512_cmp_ps_mask(length, _mm512_setzero_ps(), _CMP_GT_OQ);

    return _mm512_maskz_div_ps(is_any, _mm512_set1_ps(SHEF_GRADIENT_DIRECTION_ONE), length);
}

static inline __m512i scaled(__m512 a, __m512 scale)
{
    return _mm512_cvtps_epi32(_mm512_mul_ps(a, scale));
}

static inline void vec_rays(vec *out_ux, vec *out_uy, const struct shef_gradient_rays *rays,
                            int32_t i)
{
    /* In the order that packing undoes. */
    const __m512i first =
        _mm512_setr_epi32(0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27);
    const __m512 y = _mm512_set1_ps(rays->y);
    const __m512 low_x = ray_x(rays, _mm512_add_epi32(_mm512_set1_epi32(i), first));
    const __m512 high_x = ray_x(rays, _mm512_add_epi32(_mm512_set1_epi32(i + 4), first));
    const __m512 low_scale = ray_scale(low_x, y);
    const __m512 high_scale = ray_scale(high_x, y);

    *out_ux = _mm512_packs_epi32(scaled(low_x, low_scale), scaled(high_x, high_scale));
    *out_uy = _mm512_packs_epi32(scaled(y, low_scale), scaled(y, high_scale));
}

/* Entries of a table of 256 that lies in 8 registers, for 32 indices. */
static inline vec entries_of(const vec table[8], vec index)
{
    const vec first = _mm512_permutex2var_epi16(table[0], index, table[1]);
    const vec second = _mm512_permutex2var_epi16(table[2], index, table[3]);
    const vec third = _mm512_permutex2var_epi16(table[4], index, table[5]);
    const vec fourth = _mm512_permutex2var_epi16(table[6], index, table[7]);
    const vec_select is_64 = _mm512_test_epi16_mask(index, _mm512_set1_epi16(64));
    const vec_select is_128 = _mm512_test_epi16_mask(index, _mm512_set1_epi16(128));

    return vec_choose(is_128, vec_choose(is_64, fourth, third), vec_choose(is_64, second, first));
}

static void look_up(int16_t *out, const uint8_t *pixels, int32_t n, const int16_t table[256])
{
    vec registers[8];
    int32_t i = 0;

    for (int k = 0; k < 8; k++)
        registers[k] = vec_load(table + k * VEC_LANES);
    for (; i + VEC_LANES <= n; i += VEC_LANES)
        vec_store(out + i, entries_of(registers, vec_load_pixels(pixels + i)));
    shef_gradient_kernels_c.look_up(out + i, pixels + i, n - i, table);
}

#include "pipeline/kernels/gradient_vec.h"

const struct shef_gradient_kernels shef_gradient_kernels_avx512 = {
    .isa = "avx512",
    .cpu_features = SHEF_CPU_AVX512 | SHEF_CPU_AVX2,
    .look_up = look_up,
    .widen = widen_vec,
    .sobel = sobel_vec,
    .length = length_vec,
    .along = along_vec,
    .along_rays = along_rays_vec,
    .difference = difference_vec,
    .thin = thin_vec,
};
