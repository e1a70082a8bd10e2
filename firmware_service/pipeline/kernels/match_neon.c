/* 8 lanes: NEON of arm64. */
#include <arm_neon.h>
#include "core/cpu.h"
#include "pipeline/kernels/vec_neon.h"

static inline vec vec_load_first(const void *from, int32_t n)
{
    (void)n;
    return vreinterpretq_s16_u8(vld1q_u8(from));
}

static inline vec vec_load_filled(const void *from, int32_t n, vec fill)
{
    (void)fill;
    return vec_load_first(from, n);
}

static inline void vec_store_first(void *to, vec a, int32_t n)
{
    (void)n;
    vst1q_u8(to, vreinterpretq_u8_s16(a));
}

static inline vec vec_iota(void)
{
    static const int16_t lanes[VEC_LANES] = { 0, 1, 2, 3, 4, 5, 6, 7 };

    return vld1q_s16(lanes);
}

/* Lane k is lane k - 1; the first is the last of what lies before. */
static inline vec vec_moved_up(vec before, vec a)
{
    return vextq_s16(before, a, VEC_LANES - 1);
}

/* Lane k is lane k + 1; the last is the first of what comes next. */
static inline vec vec_moved_down(vec a, vec next)
{
    return vextq_s16(a, next, 1);
}

static inline vec vec_mul(vec a, vec b)
{
    return vmulq_s16(a, b);
}

static inline vec vec_dot_pairs(vec unsigned_pairs, vec signed_pairs)
{
    const uint8x16_t u = vreinterpretq_u8_s16(unsigned_pairs);
    const int8x16_t s = vreinterpretq_s8_s16(signed_pairs);
    const int16x8_t low =
        vmulq_s16(vreinterpretq_s16_u16(vmovl_u8(vget_low_u8(u))), vmovl_s8(vget_low_s8(s)));
    const int16x8_t high =
        vmulq_s16(vreinterpretq_s16_u16(vmovl_u8(vget_high_u8(u))), vmovl_s8(vget_high_s8(s)));

    return vpaddq_s16(low, high);
}

static inline vec vec_min_unsigned(vec a, vec b)
{
    return vreinterpretq_s16_u16(vminq_u16(vreinterpretq_u16_s16(a), vreinterpretq_u16_s16(b)));
}

static inline vec vec_min_of_first(vec so_far, vec a, int32_t n)
{
    (void)n;
    return vec_min_unsigned(so_far, a);
}

static inline uint16_t vec_smallest(vec a)
{
    return vminvq_u16(vreinterpretq_u16_s16(a));
}

static inline int32_t vec_first_equal(vec a, vec b)
{
    /* One byte a lane, moved into a general register. */
    const uint64_t mask = vget_lane_u64(vreinterpret_u64_u8(vmovn_u16(vceqq_s16(a, b))), 0);

    return mask ? __builtin_ctzll(mask) / 8 : -1;
}

#include "pipeline/kernels/match_vec.h"

const struct shef_match_kernels shef_match_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .columns = columns_vec,
    .costs = costs_vec,
    .path = path_vec,
    .winner = winner_vec,
};
