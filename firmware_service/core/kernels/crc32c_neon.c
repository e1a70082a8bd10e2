/* The instruction of arm64, an extension of version 8.0 and part of 8.1. */
#include "core/kernels/crc32c.h"

#include <arm_acle.h>
#include <asm/hwcap.h>
#include <string.h>
#include <sys/auxv.h>

bool shef_crc32c_neon_is_there(void)
{
    return (getauxval(AT_HWCAP) & HWCAP_CRC32) != 0;
}

__attribute__((target("+crc"))) uint32_t shef_crc32c_neon(uint32_t state, const uint8_t *bytes,
                                                          size_t n_bytes)
{
    for (; n_bytes >= 8; n_bytes -= 8, bytes += 8) {
        uint64_t word;

        memcpy(&word, bytes, sizeof word);
        state = __crc32cd(state, word);
    }
    for (; n_bytes > 0; n_bytes--, bytes++)
        state = __crc32cb(state, *bytes);
    return state;
}
