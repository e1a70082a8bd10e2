/* Which instruction sets this processor and operating system offer.
 *
 * The build is portable; every kernel is picked once, at start, from a table of implementations
 * by these bits. Tests and benchmarks pass a smaller set to force another implementation. */
#ifndef SHEF_CORE_CPU_H
#define SHEF_CORE_CPU_H

#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CPU_AVX2   (1u << 0)
#define SHEF_CPU_AVX512 (1u << 1) /* F, BW, VL and DQ together */
#define SHEF_CPU_NEON   (1u << 2) /* part of arm64 */
#define SHEF_CPU_NONE   0u

/* What users can ask for, as a list of words. */
#define SHEF_CPU_CHOICES "best|c|avx2|avx512|neon"

/* The features found, less what shef_cpu_restrict() has taken away. Thread: any. */
uint32_t shef_cpu_features(void);

/* Leaves only these features to the whole process, so that one processor shows how fast a lesser
 * one would be. Results do not change, speed does.
 *   features  of shef_cpu_features_among()
 * Thread: setup, before anything that picks kernels is made. */
void shef_cpu_restrict(uint32_t features);

/* The features to use when somebody asks for one of SHEF_CPU_CHOICES.
 *   isa  "best": all there are
 * SHEF_ERR_UNSUPPORTED: this processor lacks them. SHEF_ERR_INVALID: no such word. */
SHEF_MUST_CHECK enum shef_err shef_cpu_features_among(const char *isa, uint32_t *out_features,
                                                      struct shef_error *err);

/* One name per set a user can ask for: "c", "avx2", "avx512", "neon".
 * Returns the bits of that set including the lesser ones (avx512 implies avx2), or UINT32_MAX
 * for a name that does not exist. */
uint32_t shef_cpu_features_of(const char *isa);

/* The name of the best set in features, for reports. Never NULL. */
const char *shef_cpu_isa_name(uint32_t features);

/* The processor's own name, e.g. for benchmark reports; "unknown" if the system does not say.
 *   out_name  n_bytes bytes, always terminated */
void shef_cpu_model(char *out_name, int n_bytes);

#ifdef __cplusplus
}
#endif

#endif
