/* CRC-32C per instruction set; every implementation is bit-exact with the C version. */
#ifndef SHEF_CORE_KERNELS_CRC32C_H
#define SHEF_CORE_KERNELS_CRC32C_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The checksum's register after more bytes: neither inverted before nor after.
 *   bytes  n_bytes, any alignment */
typedef uint32_t shef_crc32c_fn(uint32_t state, const uint8_t *bytes, size_t n_bytes);

struct shef_crc32c_impl {
    shef_crc32c_fn *update;
    const char *isa;
    uint32_t cpu_features;
};

/* The best that these features and this processor allow. */
const struct shef_crc32c_impl *shef_crc32c_pick(uint32_t cpu_features);

shef_crc32c_fn shef_crc32c_c;
shef_crc32c_fn shef_crc32c_avx2;
shef_crc32c_fn shef_crc32c_neon;

/* Whether an arm64 processor has the checksum instructions, which its architecture leaves open
 * up to version 8.0. */
bool shef_crc32c_neon_is_there(void);

#ifdef __cplusplus
}
#endif

#endif
