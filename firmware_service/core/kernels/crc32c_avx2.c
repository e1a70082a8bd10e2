/* SSE4.2's instruction, which every processor with AVX2 has. */
#include "core/kernels/crc32c.h"

#include <nmmintrin.h>
#include <string.h>

uint32_t shef_crc32c_avx2(uint32_t state, const uint8_t *bytes, size_t n_bytes)
{
    uint64_t wide = state;

    for (; n_bytes >= 8; n_bytes -= 8, bytes += 8) {
        uint64_t word;

        memcpy(&word, bytes, sizeof word);
        wide = _mm_crc32_u64(wide, word);
    }
    state = (uint32_t)wide;
    for (; n_bytes > 0; n_bytes--, bytes++)
        state = _mm_crc32_u8(state, *bytes);
    return state;
}
