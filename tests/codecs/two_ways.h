/* What the fuzzers of the EVT decoders demand of any bytes. */
#ifndef SHEF_TESTS_CODECS_TWO_WAYS_H
#define SHEF_TESTS_CODECS_TWO_WAYS_H

#include <stddef.h>
#include <stdint.h>

#include "codecs/evt.h"

/* Decodes bytes whole, and again in small slices with small batches, the C kernels, and a decoder
 * replaced by its saved state half-way; then encodes what came out and decodes that. Ends the
 * program where events, triggers or counts differ or lie outside the sensor. The first bytes
 * choose sensor, slices and batches. */
void decode_two_ways(enum shef_evt_format format, const uint8_t *bytes, size_t n_bytes);

#endif
