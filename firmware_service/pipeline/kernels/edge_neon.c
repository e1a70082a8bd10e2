/* 8 lanes: NEON of arm64. */
#include <arm_neon.h>

#include "core/cpu.h"
#include "pipeline/kernels/vec_neon.h"

static inline void vec_store_bytes(int8_t *to, vec a, vec b)
{
    vst1q_s8(to, vcombine_s8(vmovn_s16(a), vmovn_s16(b)));
}

/* One more in the lanes selected. */
static inline vec vec_count(vec counts, vec_select which)
{
    return vsubq_s16(counts, vreinterpretq_s16_u16(which));
}

/* The sum of unsigned lanes. */
static inline uint32_t vec_total(vec counts)
{
    return vaddlvq_u16(vreinterpretq_u16_s16(counts));
}

#include "pipeline/kernels/edge_vec.h"

const struct shef_edge_kernels shef_edge_kernels_neon = {
    .isa = "neon",
    .cpu_features = SHEF_CPU_NEON,
    .count = count_vec,
    .bits = bits_vec,
    .graded = graded_vec,
    .ridges = ridges_vec,
};
