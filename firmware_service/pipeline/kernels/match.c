#include "pipeline/kernels/match.h"

const struct shef_match_kernels *shef_match_pick(uint32_t cpu_features)
{
    static const struct shef_match_kernels *const tables[] = {
    /* Best first, the last needs nothing. */
#if defined(__x86_64__)
        &shef_match_kernels_avx512,
        &shef_match_kernels_avx2,
#elif defined(__aarch64__)
        &shef_match_kernels_neon,
#endif
        &shef_match_kernels_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}
