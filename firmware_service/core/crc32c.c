#include "core/crc32c.h"

#include "core/cpu.h"
#include "core/kernels/crc32c.h"

const struct shef_crc32c_impl *shef_crc32c_pick(uint32_t cpu_features)
{
    static const struct shef_crc32c_impl plain = { shef_crc32c_c, "c", SHEF_CPU_NONE };

#if defined(__x86_64__)
    static const struct shef_crc32c_impl avx2 = { shef_crc32c_avx2, "avx2", SHEF_CPU_AVX2 };

    if (cpu_features & SHEF_CPU_AVX2)
        return &avx2;
#elif defined(__aarch64__)
    static const struct shef_crc32c_impl neon = { shef_crc32c_neon, "neon", SHEF_CPU_NEON };

    if ((cpu_features & SHEF_CPU_NEON) && shef_crc32c_neon_is_there())
        return &neon;
#endif
    (void)cpu_features;
    return &plain;
}

uint32_t shef_crc32c(uint32_t crc, const void *bytes, size_t n_bytes)
{
    return ~shef_crc32c_pick(shef_cpu_features())->update(~crc, bytes, n_bytes);
}
