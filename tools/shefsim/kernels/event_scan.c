#include "shefsim/kernels/event_scan.h"

#include <stddef.h>

#include "core/cpu.h"

static const struct sim_event_scan_impl impls[] = {
#if defined(__x86_64__)
    { sim_level_avx512, sim_scan_avx512, sim_grain_avx512, "avx512", SHEF_CPU_AVX512 },
    { sim_level_avx2, sim_scan_avx2, sim_grain_avx2, "avx2", SHEF_CPU_AVX2 },
#endif
    { sim_level_c, sim_scan_c, sim_grain_c, "c", SHEF_CPU_NONE },
};

const struct sim_event_scan_impl *sim_event_scan_pick(uint32_t cpu_features)
{
    size_t i = 0;

    while ((impls[i].cpu_features & cpu_features) != impls[i].cpu_features)
        i++;
    return &impls[i];
}
