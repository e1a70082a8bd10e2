/* 8 lanes: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/kernels/vec_neon.h"

static inline vec vec_load_pixels(const uint8_t *from)
{
    return vreinterpretq_s16_u16(vmovl_u8(vld1_u8(from)));
}

static inline vec vec_xor(vec a, vec b)
{
    return veorq_s16(a, b);
}

static inline int16x4_t length_of(int16x4_t gx, int16x4_t gy)
{
    const int32x4_t square = vmlal_s16(vmull_s16(gx, gx), gy, gy);
    const float32x4_t root = vsqrtq_f32(vcvtq_f32_s32(square));

    return vmovn_s32(vcvtnq_s32_f32(vmulq_n_f32(root, SHEF_GRADIENT_LENGTH_SCALE)));
}

static inline vec vec_length(vec gx, vec gy)
{
    return vcombine_s16(length_of(vget_low_s16(gx), vget_low_s16(gy)),
                        length_of(vget_high_s16(gx), vget_high_s16(gy)));
}

static inline float32x4_t ray_x(const struct shef_gradient_rays *rays, int32_t i)
{
    static const int32_t lanes[4] = { 0, 1, 2, 3 };
    const float32x4_t index = vcvtq_f32_s32(vaddq_s32(vdupq_n_s32(i), vld1q_s32(lanes)));

    return vaddq_f32(vdupq_n_f32(rays->first_x), vmulq_n_f32(index, rays->step_x));
}

static inline float32x4_t ray_scale(float32x4_t x, float32x4_t y)
{
    const float32x4_t length = vsqrtq_f32(vaddq_f32(vmulq_f32(x, x), vmulq_f32(y, y)));
    const float32x4_t scale = vdivq_f32(vdupq_n_f32(SHEF_GRADIENT_DIRECTION_ONE), length);
    const uint32x4_t is_any = vcgtq_f32(length, vdupq_n_f32(0));

    return vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(scale), is_any));
}

static inline int16x4_t scaled(float32x4_t a, float32x4_t scale)
{
    return vmovn_s32(vcvtnq_s32_f32(vmulq_f32(a, scale)));
}

static inline void vec_rays(vec *out_ux, vec *out_uy, const struct shef_gradient_rays *rays,
                            int32_t i)
{
    const float32x4_t y = vdupq_n_f32(rays->y);
    const float32x4_t low_x = ray_x(rays, i);
    const float32x4_t high_x = ray_x(rays, i + 4);
    const float32x4_t low_scale = ray_scale(low_x, y);
    const float32x4_t high_scale = ray_scale(high_x, y);

    *out_ux = vcombine_s16(scaled(low_x, low_scale), scaled(high_x, high_scale));
    *out_uy = vcombine_s16(scaled(y, low_scale), scaled(y, high_scale));
}

/* There is no vector form: 256 entries of 16 bits are too many to shuffle. */
static void look_up(int16_t *out, const uint8_t *pixels, int32_t n, const int16_t table[256])
{
    shef_gradient_kernels_c.look_up(out, pixels, n, table);
}

#include "pipeline/kernels/gradient_vec.h"

const struct shef_gradient_kernels shef_gradient_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .look_up = look_up,
    .widen = widen_vec,
    .sobel = sobel_vec,
    .length = length_vec,
    .along = along_vec,
    .along_rays = along_rays_vec,
    .difference = difference_vec,
    .thin = thin_vec,
};
