#include "pipeline/kernels/edge.h"

#include <assert.h>
#include <stddef.h>

const struct shef_edge_kernels *shef_edge_pick(uint32_t cpu_features)
{
    static const struct shef_edge_kernels *const tables[] = {
    /* Best first, the last needs nothing. */
#if defined(__x86_64__)
        &shef_edge_kernels_avx512,
        &shef_edge_kernels_avx2,
#elif defined(__aarch64__)
        &shef_edge_kernels_neon,
#endif
        &shef_edge_kernels_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}

struct shef_edge_scale shef_edge_scale_of(int32_t limit)
{
    struct shef_edge_scale scale = { .limit = (int16_t)limit };

    assert(limit >= 1 && limit <= INT16_MAX);
    while (limit << scale.shift < 1 << 14)
        scale.shift++;

    /* 127 * 2^7 at the limit: the last 7 bits round. */
    const int32_t shifted = limit << scale.shift;

    scale.gain = (int16_t)(((127 << 7) * (1 << 15) + shifted / 2) / shifted);
    return scale;
}
