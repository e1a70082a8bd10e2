/* 16 lanes: AVX2. */
#include <immintrin.h>

#include "core/cpu.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/kernels/vec_avx2.h"

static inline vec vec_load_pixels(const uint8_t *from)
{
    return _mm256_cvtepu8_epi16(_mm_loadu_si128((const __m128i *)(const void *)from));
}

static inline vec vec_xor(vec a, vec b)
{
    return _mm256_xor_si256(a, b);
}

static inline __m256i length_of(__m256i pairs)
{
    const __m256 root = _mm256_sqrt_ps(_mm256_cvtepi32_ps(_mm256_madd_epi16(pairs, pairs)));

    return _mm256_cvtps_epi32(_mm256_mul_ps(_mm256_set1_ps(SHEF_GRADIENT_LENGTH_SCALE), root));
}

static inline vec vec_length(vec gx, vec gy)
{
    /* Unpacking and packing both work on 128-bit halves. */
    return _mm256_packs_epi32(length_of(_mm256_unpacklo_epi16(gx, gy)),
                              length_of(_mm256_unpackhi_epi16(gx, gy)));
}

static inline __m256 ray_x(const struct shef_gradient_rays *rays, __m256i i)
{
    return _mm256_add_ps(_mm256_set1_ps(rays->first_x),
                         _mm256_mul_ps(_mm256_set1_ps(rays->step_x), _mm256_cvtepi32_ps(i)));
}

static inline __m256 ray_scale(__m256 x, __m256 y)
{
    const __m256 length = _mm256_sqrt_ps(_mm256_add_ps(_mm256_mul_ps(x, x), _mm256_mul_ps(y, y)));
    const __m256 scale = _mm256_div_ps(_mm256_set1_ps(SHEF_GRADIENT_DIRECTION_ONE), length);

    return _mm256_and_ps(scale, _mm256_cmp_ps(length, _mm256_setzero_ps(), _CMP_GT_OQ));
}

static inline __m256i scaled(__m256 a, __m256 scale)
{
    return _mm256_cvtps_epi32(_mm256_mul_ps(a, scale));
}

static inline void vec_rays(vec *out_ux, vec *out_uy, const struct shef_gradient_rays *rays,
                            int32_t i)
{
    /* In the order that packing undoes. */
    const __m256i first = _mm256_setr_epi32(0, 1, 2, 3, 8, 9, 10, 11);
    const __m256 y = _mm256_set1_ps(rays->y);
    const __m256 low_x = ray_x(rays, _mm256_add_epi32(_mm256_set1_epi32(i), first));
    const __m256 high_x = ray_x(rays, _mm256_add_epi32(_mm256_set1_epi32(i + 4), first));
    const __m256 low_scale = ray_scale(low_x, y);
    const __m256 high_scale = ray_scale(high_x, y);

    *out_ux = _mm256_packs_epi32(scaled(low_x, low_scale), scaled(high_x, high_scale));
    *out_uy = _mm256_packs_epi32(scaled(y, low_scale), scaled(y, high_scale));
}

/* There is no vector form: 256 entries of 16 bits are too many to shuffle. */
static void look_up(int16_t *out, const uint8_t *pixels, int32_t n, const int16_t table[256])
{
    shef_gradient_kernels_c.look_up(out, pixels, n, table);
}

#include "pipeline/kernels/gradient_vec.h"

const struct shef_gradient_kernels shef_gradient_kernels_avx2 = {
    .isa = "avx2",
    .cpu_features = SHEF_CPU_AVX2,
    .look_up = look_up,
    .widen = widen_vec,
    .sobel = sobel_vec,
    .length = length_vec,
    .along = along_vec,
    .along_rays = along_rays_vec,
    .difference = difference_vec,
    .thin = thin_vec,
};
