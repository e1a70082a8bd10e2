#include "shefsim/kernels/frame_expose.h"

#include <stddef.h>

#include "core/cpu.h"

static const struct sim_frame_expose_impl impls[] = {
#if defined(__x86_64__)
    { sim_expose_avx512, "avx512", SHEF_CPU_AVX512 },
    { sim_expose_avx2, "avx2", SHEF_CPU_AVX2 },
#endif
    { sim_expose_c, "c", SHEF_CPU_NONE },
};

const struct sim_frame_expose_impl *sim_frame_expose_pick(uint32_t cpu_features)
{
    size_t i = 0;

    while ((impls[i].cpu_features & cpu_features) != impls[i].cpu_features)
        i++;
    return &impls[i];
}
