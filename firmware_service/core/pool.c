#include "core/pool.h"

#include <assert.h>
#include <stdalign.h>
#include <stdlib.h>

#include "core/memory.h"

#define MAX_BUFFERS 65536u
#define NONE        UINT32_MAX

struct shef_pool {
    /* Set by create, then read-only. */
    struct shef_buffer *buffers;
    uint8_t *data;
    uint32_t n_buffers;
    /* The taker's own list of free buffers, through next_free. */
    uint32_t free_list;
    /* The taker writes, anyone reads. */
    _Atomic uint64_t n_refused;
    _Atomic uint64_t n_taken;
    /* Givers add one at a time, the taker removes all at once: no buffer can leave and come
     * back between the two steps of an addition unnoticed. Own cache line. */
    alignas(64) _Atomic uint32_t returned_list;
    /* Givers write, anyone reads. */
    _Atomic uint64_t n_given;
};

struct shef_pool *shef_pool_create(uint32_t n_buffers, uint32_t buffer_bytes,
                                   struct shef_error *err)
{
    if (n_buffers < 1 || n_buffers > MAX_BUFFERS || buffer_bytes < 1) {
        (void)shef_fail(err, SHEF_ERR_INVALID,
                        "pool of %u buffers of %u bytes: 1 to %u are "
                        "possible, of 1 byte or more",
                        n_buffers, buffer_bytes, MAX_BUFFERS);
        return NULL;
    }

    const size_t step_bytes = shef_memory_round_up(buffer_bytes);
    struct shef_pool *pool = shef_memory_create(1, sizeof *pool);
    struct shef_buffer *buffers = shef_memory_create(n_buffers, sizeof *buffers);
    uint8_t *data = shef_memory_create(n_buffers, step_bytes);

    if (!pool || !buffers || !data) {
        free(pool);
        free(buffers);
        free(data);
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "pool of %u buffers of %u bytes: out of memory",
                        n_buffers, buffer_bytes);
        return NULL;
    }
    for (uint32_t i = 0; i < n_buffers; i++) {
        buffers[i].data = data + i * step_bytes;
        buffers[i].capacity_bytes = buffer_bytes;
        buffers[i].pool = pool;
        buffers[i].next_free = i + 1 < n_buffers ? i + 1 : NONE;
    }
    pool->buffers = buffers;
    pool->data = data;
    pool->n_buffers = n_buffers;
    pool->free_list = 0;
    atomic_init(&pool->returned_list, NONE);
    return pool;
}

void shef_pool_destroy(struct shef_pool *pool)
{
    if (!pool)
        return;
    assert(shef_pool_lent_count(pool) == 0);
    free(pool->data);
    free(pool->buffers);
    free(pool);
}

struct shef_buffer *shef_pool_take(struct shef_pool *pool)
{
    /* Acquire: the last holders are done with the buffers before they can be lent again. */
    if (pool->free_list == NONE)
        pool->free_list =
            atomic_exchange_explicit(&pool->returned_list, NONE, memory_order_acquire);
    if (pool->free_list == NONE) {
        /* Relaxed: a counter for reports orders nothing. */
        atomic_fetch_add_explicit(&pool->n_refused, 1, memory_order_relaxed);
        return NULL;
    }

    struct shef_buffer *buffer = &pool->buffers[pool->free_list];

    pool->free_list = buffer->next_free;
    buffer->used_bytes = 0;
    /* Relaxed: nobody else knows the buffer yet; whatever hands it on also orders this. */
    atomic_store_explicit(&buffer->n_holders, 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&pool->n_taken, 1, memory_order_relaxed);
    return buffer;
}

void shef_buffer_share(struct shef_buffer *buffer)
{
    /* Relaxed: the caller is a holder, so the count cannot reach 0 meanwhile. */
    const uint32_t n_before =
        atomic_fetch_add_explicit(&buffer->n_holders, 1, memory_order_relaxed);

    assert(n_before > 0);
    (void)n_before;
}

void shef_buffer_give(struct shef_buffer *buffer)
{
    struct shef_pool *pool = buffer->pool;
    const uint32_t index = (uint32_t)(buffer - pool->buffers);
    /* Release: this holder's reads and writes come before its give. Acquire: the last one
     * returns the buffer after everybody else's. */
    const uint32_t n_before =
        atomic_fetch_sub_explicit(&buffer->n_holders, 1, memory_order_acq_rel);

    assert(n_before > 0);
    if (n_before > 1)
        return;

    /* Counted before it can be taken again, or the number lent could seem to exceed the pool.
     * Release: who sees this give counted sees its take counted too. */
    atomic_fetch_add_explicit(&pool->n_given, 1, memory_order_release);

    uint32_t first = atomic_load_explicit(&pool->returned_list, memory_order_relaxed);

    do {
        buffer->next_free = first;
        /* Release: next_free and the buffer's content come before the list that shows them. */
    } while (!atomic_compare_exchange_weak_explicit(&pool->returned_list, &first, index,
                                                    memory_order_release, memory_order_relaxed));
}

uint64_t shef_pool_refused_count(const struct shef_pool *pool)
{
    return atomic_load_explicit(&pool->n_refused, memory_order_relaxed);
}

uint32_t shef_pool_lent_count(const struct shef_pool *pool)
{
    /* Given first and with acquire: no give counts without its take, so nothing underflows. */
    const uint64_t n_given = atomic_load_explicit(&pool->n_given, memory_order_acquire);
    const uint64_t n_taken = atomic_load_explicit(&pool->n_taken, memory_order_relaxed);
    const uint64_t n_lent = n_taken - n_given;

    /* Both may move between the two reads; more than all means all. */
    return n_lent > pool->n_buffers ? pool->n_buffers : (uint32_t)n_lent;
}

uint32_t shef_pool_free_count(const struct shef_pool *pool)
{
    return pool->n_buffers - shef_pool_lent_count(pool);
}
