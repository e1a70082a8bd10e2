#include "pipeline/kernels/decay.h"

#include <stddef.h>

const struct shef_decay_kernels *shef_decay_pick(uint32_t cpu_features)
{
    static const struct shef_decay_kernels *const tables[] = {
    /* Best first, the last needs nothing. */
#if defined(__x86_64__)
        &shef_decay_kernels_avx512,
        &shef_decay_kernels_avx2,
#elif defined(__aarch64__)
        &shef_decay_kernels_neon,
#endif
        &shef_decay_kernels_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}
