/* Single-producer, single-consumer ring of fixed-size slots.
 *
 * Exactly one thread pushes and exactly one pops. Never blocks, never allocates. A full ring
 * refuses the newcomer; the producer counts the loss. The indices run free and wrap at 2^32, so
 * head - tail is the fill level. */
#ifndef SHEF_CORE_RING_H
#define SHEF_CORE_RING_H

#include <stdalign.h>
#include <stdatomic.h>
#include <stdint.h>

#include "core/error.h"

struct shef_ring {
    /* Set by init, then read-only. */
    uint8_t *slots; /* capacity * slot_bytes, owned by the caller */
    uint32_t slot_bytes;
    uint32_t mask; /* capacity - 1; capacity is a power of two */
    /* Producer writes, consumer reads. Own cache line. */
    alignas(64) _Atomic uint32_t head;
    /* Consumer writes, producer reads. Own cache line. */
    alignas(64) _Atomic uint32_t tail;
};

/* Makes an empty ring in the caller's memory.                     Thread: setup.
 *   slots       capacity * slot_bytes bytes, kept until the ring is no longer used
 *   slot_bytes  1 or more
 *   capacity    slots, a power of two from 1 to 2^31 */
void shef_ring_init(struct shef_ring *ring, void *slots, uint32_t slot_bytes, uint32_t capacity);

/* Copies one item in.                                             Thread: producer.
 *   item  slot_bytes bytes, not kept
 * SHEF_ERR_FULL: nothing was written. */
SHEF_MUST_CHECK enum shef_err shef_ring_push(struct shef_ring *ring, const void *item);

/* Copies the oldest item out and frees its slot.                  Thread: consumer.
 *   out_item  slot_bytes bytes
 * SHEF_ERR_EMPTY: nothing was read. */
SHEF_MUST_CHECK enum shef_err shef_ring_pop(struct shef_ring *ring, void *out_item);

/* How many items wait. The consumer finds at least this many, the producer has at most this
 * many in its way; for anyone else it is an estimate from 0 to capacity.   Thread: any. */
uint32_t shef_ring_count(const struct shef_ring *ring);

#endif
