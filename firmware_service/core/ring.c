#include "core/ring.h"

#include <assert.h>
#include <string.h>

static uint8_t *slot_at(const struct shef_ring *ring, uint32_t index)
{
    return ring->slots + (size_t)(index & ring->mask) * ring->slot_bytes;
}

void shef_ring_init(struct shef_ring *ring, void *slots, uint32_t slot_bytes, uint32_t capacity)
{
    assert(slots && slot_bytes > 0);
    assert(capacity > 0 && (capacity & (capacity - 1)) == 0);

    ring->slots = slots;
    ring->slot_bytes = slot_bytes;
    ring->mask = capacity - 1;
    atomic_init(&ring->head, 0);
    atomic_init(&ring->tail, 0);
}

enum shef_err shef_ring_push(struct shef_ring *ring, const void *item)
{
    /* Relaxed: only this thread writes head. */
    const uint32_t head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    /* Acquire: the consumer has finished reading the slots it gave back. */
    const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);

    if (head - tail > ring->mask)
        return SHEF_ERR_FULL;
    memcpy(slot_at(ring, head), item, ring->slot_bytes);
    /* Release: the slot's bytes become visible before the index does. */
    atomic_store_explicit(&ring->head, head + 1, memory_order_release);
    return SHEF_OK;
}

enum shef_err shef_ring_pop(struct shef_ring *ring, void *out_item)
{
    /* Relaxed: only this thread writes tail. */
    const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
    /* Acquire: the slot's bytes are visible once the index is. */
    const uint32_t head = atomic_load_explicit(&ring->head, memory_order_acquire);

    if (head == tail)
        return SHEF_ERR_EMPTY;
    memcpy(out_item, slot_at(ring, tail), ring->slot_bytes);
    /* Release: the copy is done before the producer may overwrite the slot. */
    atomic_store_explicit(&ring->tail, tail + 1, memory_order_release);
    return SHEF_OK;
}

uint32_t shef_ring_count(const struct shef_ring *ring)
{
    /* Tail first: head can only move away from it, so the difference never turns negative. */
    const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);
    const uint32_t head = atomic_load_explicit(&ring->head, memory_order_acquire);
    const uint32_t n_items = head - tail;

    /* Both may move between the two reads; more than full means full. */
    return n_items > ring->mask + 1 ? ring->mask + 1 : n_items;
}
