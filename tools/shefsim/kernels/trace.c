#include "shefsim/kernels/trace.h"

const struct sim_trace_kernels *sim_trace_pick(uint32_t cpu_features)
{
    static const struct sim_trace_kernels *const tables[] = {
    /* Best first, the last needs nothing. */
#if defined(__x86_64__)
        &sim_trace_kernels_avx512,
        &sim_trace_kernels_avx2,
#elif defined(__aarch64__)
        &sim_trace_kernels_neon,
#endif
        &sim_trace_kernels_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}
