/* Buffers of one size that are lent, shared and given back without locks or allocation.
 *
 * One thread takes; whoever holds a buffer may share it; the last give() returns it to its pool,
 * from whatever thread. An empty pool refuses and counts: a slow consumer costs data, never
 * time. */
#ifndef SHEF_CORE_POOL_H
#define SHEF_CORE_POOL_H

#include <stdatomic.h>
#include <stdint.h>

#include "core/error.h"

struct shef_pool;

struct shef_buffer {
    /* Set by create, then read-only. */
    uint8_t *data; /* capacity_bytes, 64-byte aligned */
    uint32_t capacity_bytes;
    struct shef_pool *pool;
    /* The taker writes it before sharing, the others read. */
    uint32_t used_bytes;
    /* The pool's own. */
    uint32_t next_free;
    _Atomic uint32_t n_holders;
};

/* Allocates everything.                                           Thread: setup.
 *   n_buffers     1 to 65536
 *   buffer_bytes  of each, 1 or more
 * Returns NULL and a sentence in err on failure. */
struct shef_pool *shef_pool_create(uint32_t n_buffers, uint32_t buffer_bytes,
                                   struct shef_error *err);

/* Frees everything; every buffer must have been given back. NULL is allowed. Thread: setup. */
void shef_pool_destroy(struct shef_pool *pool);

/* Lends a buffer with one holder and used_bytes 0.                Thread: the one taker.
 * NULL: all are out; counted. The data is whatever the last holder left. */
struct shef_buffer *shef_pool_take(struct shef_pool *pool);

/* One holder more. Only for who holds it, before handing it on.   Thread: any holder. */
void shef_buffer_share(struct shef_buffer *buffer);

/* One holder less; the last returns it to the pool.               Thread: any holder.
 * The buffer must not be touched afterwards. */
void shef_buffer_give(struct shef_buffer *buffer);

/* How often take() found nothing.                                 Thread: any. */
uint64_t shef_pool_refused_count(const struct shef_pool *pool);

/* How many could be taken at the moment; more, if some come back. Thread: any. */
uint32_t shef_pool_free_count(const struct shef_pool *pool);

/* How many buffers are out at the moment, for status reports.     Thread: any. */
uint32_t shef_pool_lent_count(const struct shef_pool *pool);

#endif
