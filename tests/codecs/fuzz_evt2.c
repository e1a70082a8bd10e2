#include "two_ways.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    decode_two_ways(SHEF_EVT2, bytes, n_bytes);
    return 0;
}
