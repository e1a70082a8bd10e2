#include "pipeline/kernels/warp.h"

const struct shef_warp_kernel *shef_warp_pick(uint32_t cpu_features)
{
    static const struct shef_warp_kernel *const tables[] = {
    /* Best first, the last needs nothing. */
#if defined(__x86_64__)
        &shef_warp_kernel_avx512,
        &shef_warp_kernel_avx2,
#elif defined(__aarch64__)
        &shef_warp_kernel_neon,
#endif
        &shef_warp_kernel_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}
