/* The definition, a nibble at a time: 16 table entries are quick enough where a processor has no
 * instruction for it, and small enough to be checked by eye. */
#include "core/kernels/crc32c.h"

uint32_t shef_crc32c_c(uint32_t state, const uint8_t *bytes, size_t n_bytes)
{
    /* Entry i is i divided by the reflected polynomial 0x82f63b78, four bits at once. */
    static const uint32_t quotients[16] = {
        0x00000000, 0x105ec76f, 0x20bd8ede, 0x30e349b1, 0x417b1dbc, 0x5125dad3,
        0x61c69362, 0x7198540d, 0x82f63b78, 0x92a8fc17, 0xa24bb5a6, 0xb21572c9,
        0xc38d26c4, 0xd3d3e1ab, 0xe330a81a, 0xf36e6f75,
    };

    for (size_t i = 0; i < n_bytes; i++) {
        state ^= bytes[i];
        state = state >> 4 ^ quotients[state & 15];
        state = state >> 4 ^ quotients[state & 15];
    }
    return state;
}
