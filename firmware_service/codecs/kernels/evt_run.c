#include "codecs/kernels/evt_run.h"

#include "core/cpu.h"

/* Best first; the last needs nothing. */
static const struct shef_evt_kernels kernels[] = {
#if defined(__x86_64__)
    { "avx512", SHEF_CPU_AVX512, shef_evt2_run_avx512, shef_evt21_run_avx512,
      shef_evt3_run_avx512 },
    { "avx2", SHEF_CPU_AVX2, shef_evt2_run_avx2, shef_evt21_run_c, shef_evt3_run_avx2 },
#elif defined(__aarch64__)
    { "neon", SHEF_CPU_NEON, shef_evt2_run_neon, shef_evt21_run_c, shef_evt3_run_c },
#endif
    { "c", SHEF_CPU_NONE, shef_evt2_run_c, shef_evt21_run_c, shef_evt3_run_c },
};

const struct shef_evt_kernels *shef_evt_kernels_for(uint32_t features)
{
    const struct shef_evt_kernels *best = kernels;

    while ((features & best->features) != best->features)
        best++;
    return best;
}
