#include "core/cpu.h"

#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    uint32_t features;
} sets[] = {
    /* Best first. */
    { "avx512", SHEF_CPU_AVX512 | SHEF_CPU_AVX2 },
    { "avx2", SHEF_CPU_AVX2 },
    { "neon", SHEF_CPU_NEON },
    { "c", SHEF_CPU_NONE },
};

#define N_SETS (sizeof sets / sizeof sets[0])

static _Atomic uint32_t allowed = UINT32_MAX;

static uint32_t features_found(void)
{
    uint32_t features = SHEF_CPU_NONE;

#if defined(__x86_64__)
    /* GCC's own check caches cpuid and asks the operating system for the register state too. */
    if (__builtin_cpu_supports("avx2"))
        features |= SHEF_CPU_AVX2;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
        features |= SHEF_CPU_AVX512;
#elif defined(__aarch64__)
    features |= SHEF_CPU_NEON;
#endif
    return features;
}

uint32_t shef_cpu_features(void)
{
    return features_found() & atomic_load_explicit(&allowed, memory_order_relaxed);
}

void shef_cpu_restrict(uint32_t features)
{
    atomic_store_explicit(&allowed, features, memory_order_relaxed);
}

enum shef_err shef_cpu_features_among(const char *isa, uint32_t *out_features,
                                      struct shef_error *err)
{
    const uint32_t found = shef_cpu_features();
    const uint32_t wanted = strcmp(isa, "best") == 0 ? found : shef_cpu_features_of(isa);

    if (wanted == UINT32_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "there is no instruction set '%s'; known are %s",
                         isa, SHEF_CPU_CHOICES);
    if ((wanted & found) != wanted)
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "this processor has no %s; the best it has is %s", isa,
                         shef_cpu_isa_name(found));
    *out_features = wanted;
    return SHEF_OK;
}

uint32_t shef_cpu_features_of(const char *isa)
{
    for (size_t i = 0; i < N_SETS; i++)
        if (strcmp(isa, sets[i].name) == 0)
            return sets[i].features;
    return UINT32_MAX;
}

const char *shef_cpu_isa_name(uint32_t features)
{
    for (size_t i = 0; i < N_SETS; i++)
        if ((features & sets[i].features) == sets[i].features)
            return sets[i].name;
    return "c";
}

void shef_cpu_model(char *out_name, int n_bytes)
{
    FILE *file = fopen("/proc/cpuinfo", "r");
    char line[256];

    snprintf(out_name, (size_t)n_bytes, "unknown");
    if (!file)
        return;
    while (fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');

        if (colon && strncmp(line, "model name", 10) == 0) {
            snprintf(out_name, (size_t)n_bytes, "%s", colon + 1 + strspn(colon + 1, " \t"));
            out_name[strcspn(out_name, "\n")] = '\0';
            break;
        }
    }
    fclose(file);
}
