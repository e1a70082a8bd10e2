/* On what a figure was measured: for every report that holds a time. */
#ifndef SHEFTOOL_MACHINE_H
#define SHEFTOOL_MACHINE_H

#include <jansson.h>
#include <stdint.h>

/* {"cpu", "cpus", "isa", "compiler", "kernel"}; NULL: out of memory.
 *   cpu_features  what the kernels may use, see core/cpu.h */
json_t *shef_machine_json(uint32_t cpu_features);

/* "AMD ..., 2 CPUs, avx512, gcc 12.2.0" in out_text (n_bytes, terminated). */
void shef_machine_text(uint32_t cpu_features, char *out_text, size_t n_bytes);

#endif
