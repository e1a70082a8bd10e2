/* Which implementation of every kernel runs on this processor. Thread: any. */
#ifndef SHEF_SERVICE_KERNELS_H
#define SHEF_SERVICE_KERNELS_H

#include <stdint.h>

#include <jansson.h>

#ifdef __cplusplus
extern "C" {
#endif

/* {"cpu": name, "isa": best set, "kernels": [{"name": ..., "isa": ..., "does": ...}]}; to be
 * released by the caller. NULL: out of memory.
 *   cpu_features  shef_cpu_features(), or fewer bits */
json_t *shef_kernels_to_json(uint32_t cpu_features);

#ifdef __cplusplus
}
#endif

#endif
