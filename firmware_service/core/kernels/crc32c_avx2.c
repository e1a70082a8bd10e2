/* SSE4.2's instruction, which every processor with AVX2 has.
 *
 * It takes three cycles, but a new one can begin in each: three pieces of a long message are
 * summed at the same time. A sum's register is a polynomial modulo CRC-32C's, to which n bytes
 * more multiply by x^(8n), so that the pieces' registers can be put together. */
#include "core/kernels/crc32c.h"

#include <nmmintrin.h>
#include <string.h>

/* Long enough for putting together to cost little, short enough for frames and messages. */
#define PIECE_BYTES 4096

/* The polynomials' coefficients are mirrored: x^0 is the highest bit. */
#define POLYNOMIAL      0x82f63b78u
#define PAST_ONE_PIECE  0x35d73a62u /* x^(8 * 4096) */
#define PAST_TWO_PIECES 0x28461564u /* x^(8 * 8192) */

static uint64_t load(const uint8_t *bytes)
{
    uint64_t word;

    memcpy(&word, bytes, sizeof word);
    return word;
}

/* a * b modulo the polynomial. */
static uint32_t multiply(uint32_t a, uint32_t b)
{
    uint32_t product = 0;

    for (int power = 31; power >= 0; power--) {
        product ^= b & -(a >> power & 1);
        b = b >> 1 ^ (POLYNOMIAL & -(b & 1));
    }
    return product;
}

static uint32_t update_three(uint32_t state, const uint8_t *bytes)
{
    uint64_t first = state, second = 0, third = 0;

    for (int i = 0; i < PIECE_BYTES; i += 8) {
        first = _mm_crc32_u64(first, load(bytes + i));
        second = _mm_crc32_u64(second, load(bytes + PIECE_BYTES + i));
        third = _mm_crc32_u64(third, load(bytes + 2 * PIECE_BYTES + i));
    }
    return multiply((uint32_t)first, PAST_TWO_PIECES) ^ multiply((uint32_t)second, PAST_ONE_PIECE) ^
           (uint32_t)third;
}

uint32_t shef_crc32c_avx2(uint32_t state, const uint8_t *bytes, size_t n_bytes)
{
    for (; n_bytes >= 3 * PIECE_BYTES; n_bytes -= 3 * PIECE_BYTES, bytes += 3 * PIECE_BYTES)
        state = update_three(state, bytes);

    uint64_t wide = state;

    for (; n_bytes >= 8; n_bytes -= 8, bytes += 8)
        wide = _mm_crc32_u64(wide, load(bytes));
    state = (uint32_t)wide;
    for (; n_bytes > 0; n_bytes--, bytes++)
        state = _mm_crc32_u8(state, *bytes);
    return state;
}
