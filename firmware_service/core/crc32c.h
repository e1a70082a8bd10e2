/* CRC-32C, the checksum of recorded blocks and of messages.
 *
 * Castagnoli's polynomial 0x1EDC6F41, reflected, initial value and final exclusive-or all ones,
 * as in RFC 3720 (iSCSI), ext4 and SSE4.2: the bytes "123456789" give 0xE3069283. Finds every
 * burst of errors up to 32 bits; no protection against intent. Thread: any. */
#ifndef SHEF_CORE_CRC32C_H
#define SHEF_CORE_CRC32C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Continues a checksum over more bytes.
 *   crc  of the bytes before these, 0 at the start */
uint32_t shef_crc32c(uint32_t crc, const void *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif

#endif
