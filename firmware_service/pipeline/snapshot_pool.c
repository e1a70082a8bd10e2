#include "pipeline/snapshot_pool.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "core/memory.h"
#include "pipeline/kernels/warp.h"

/* A slot's state: the snapshot's number above, the count of its holders in the low bits. */
#define HOLDER_BITS    16
#define HOLDERS(state) ((state) & ((UINT64_C(1) << HOLDER_BITS) - 1))
#define NUMBER(state)  ((state) >> HOLDER_BITS)
#define EMPTY          (UINT64_MAX << HOLDER_BITS) /* no number, no holders */
#define FILLING        (UINT64_MAX - 1)            /* the writer's */

struct slot {
    /* The writer's while it fills, then read-only. */
    struct shef_snapshot snapshot;
    struct shef_image_i16 scratch;
    int16_t *pixels; /* of all three images */
    /* Written by all. */
    _Atomic uint64_t state;
};

struct shef_snapshot_pool {
    struct slot *slots;
    int32_t n_slots;
    /* The writer writes, others read. */
    _Atomic uint64_t end;
    _Atomic uint64_t n_lost;
};

/* Three images in one piece; what follows each is readable for the warp. */
static bool create_images(struct slot *slot, int32_t width_px, int32_t height_px)
{
    const size_t pad = SHEF_WARP_PAD_BYTES / sizeof *slot->pixels;
    const size_t stride = ((size_t)width_px + pad - 1) / pad * pad;
    const size_t n_image = stride * (size_t)height_px;
    struct shef_image_i16 *const images[] = { &slot->snapshot.values, &slot->snapshot.sums,
                                              &slot->scratch };

    slot->pixels = shef_memory_create(3 * n_image + pad, sizeof *slot->pixels);
    if (!slot->pixels)
        return false;
    for (size_t i = 0; i < 3; i++)
        *images[i] = (struct shef_image_i16){
            .data = slot->pixels + i * n_image,
            .width_px = width_px,
            .height_px = height_px,
            .stride_bytes = (ptrdiff_t)(stride * sizeof *slot->pixels),
        };
    return true;
}

enum shef_err shef_snapshot_pool_create(struct shef_snapshot_pool **out_pool, int32_t n_snapshots,
                                        int32_t width_px, int32_t height_px, struct shef_error *err)
{
    if (n_snapshots < 4 || n_snapshots > 64)
        return shef_fail(err, SHEF_ERR_INVALID, "pool of %d snapshots: it must be 4 to 64",
                         n_snapshots);
    assert(width_px >= 1 && height_px >= 1);

    struct shef_snapshot_pool *pool = calloc(1, sizeof *pool);

    if (pool)
        pool->slots = shef_memory_create((size_t)n_snapshots, sizeof *pool->slots);

    bool is_complete = pool && pool->slots;

    for (; is_complete && pool->n_slots < n_snapshots; pool->n_slots++) {
        atomic_init(&pool->slots[pool->n_slots].state, EMPTY);
        is_complete = create_images(&pool->slots[pool->n_slots], width_px, height_px);
    }
    if (!is_complete) {
        shef_snapshot_pool_destroy(pool);
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "pool of %d snapshots of %d x %d px: out of memory", n_snapshots, width_px,
                         height_px);
    }
    *out_pool = pool;
    return SHEF_OK;
}

void shef_snapshot_pool_destroy(struct shef_snapshot_pool *pool)
{
    if (!pool)
        return;
    for (int32_t i = 0; i < pool->n_slots; i++) {
        const uint64_t state = atomic_load(&pool->slots[i].state);

        assert(state == FILLING || HOLDERS(state) == 0);
        free(pool->slots[i].pixels);
    }
    free(pool->slots);
    free(pool);
}

/* The slot to reuse next: an empty one, else the lowest number that nobody holds; or NULL. */
static struct slot *best_slot(struct shef_snapshot_pool *pool, uint64_t *out_state)
{
    struct slot *best = NULL;

    for (int32_t i = 0; i < pool->n_slots; i++) {
        const uint64_t state = atomic_load_explicit(&pool->slots[i].state, memory_order_relaxed);

        if (state == FILLING || HOLDERS(state) > 0)
            continue;
        if (state == EMPTY || !best || (*out_state != EMPTY && state < *out_state)) {
            best = &pool->slots[i];
            *out_state = state;
        }
    }
    return best;
}

struct shef_snapshot *shef_snapshot_pool_begin(struct shef_snapshot_pool *pool,
                                               struct shef_image_i16 *out_scratch)
{
    uint64_t state = EMPTY;

    for (struct slot *slot; (slot = best_slot(pool, &state));) {
        /* Acquire: the last holder's reads come before our writes. A failure means that somebody
         * has just taken the slot: look for another. */
        if (atomic_compare_exchange_strong_explicit(&slot->state, &state, FILLING,
                                                    memory_order_acquire, memory_order_relaxed)) {
            *out_scratch = slot->scratch;
            return &slot->snapshot;
        }
    }
    atomic_fetch_add_explicit(&pool->n_lost, 1, memory_order_relaxed);
    return NULL;
}

static struct slot *slot_of(struct shef_snapshot_pool *pool, const struct shef_snapshot *snapshot)
{
    for (int32_t i = 0; i < pool->n_slots; i++)
        if (&pool->slots[i].snapshot == snapshot)
            return &pool->slots[i];
    assert(!"a snapshot of this pool");
    return NULL;
}

void shef_snapshot_pool_publish(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot)
{
    assert(snapshot->number < NUMBER(EMPTY));
    assert(snapshot->number >= atomic_load_explicit(&pool->end, memory_order_relaxed));
    /* Release: the snapshot's content becomes visible before its number does. */
    atomic_store_explicit(&slot_of(pool, snapshot)->state, snapshot->number << HOLDER_BITS,
                          memory_order_release);
    /* Release: whoever sees the number finds the slot. */
    atomic_store_explicit(&pool->end, snapshot->number + 1, memory_order_release);
}

void shef_snapshot_pool_cancel(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot)
{
    atomic_store_explicit(&slot_of(pool, snapshot)->state, EMPTY, memory_order_relaxed);
}

enum shef_err shef_snapshot_pool_take(struct shef_snapshot_pool *pool, uint64_t number,
                                      const struct shef_snapshot **out_snapshot)
{
    /* Acquire: a slot published before this end is seen as published. */
    const uint64_t end = atomic_load_explicit(&pool->end, memory_order_acquire);

    if (number >= end)
        return SHEF_ERR_EMPTY;
    for (int32_t i = 0; i < pool->n_slots; i++) {
        struct slot *slot = &pool->slots[i];
        uint64_t state = atomic_load_explicit(&slot->state, memory_order_relaxed);

        while (state != FILLING && NUMBER(state) == number) {
            assert(HOLDERS(state) + 1 < UINT64_C(1) << HOLDER_BITS);
            /* Acquire: the writer's content comes before our reads. */
            if (atomic_compare_exchange_weak_explicit(&slot->state, &state, state + 1,
                                                      memory_order_acquire, memory_order_relaxed)) {
                *out_snapshot = &slot->snapshot;
                return SHEF_OK;
            }
        }
    }
    return SHEF_ERR_GONE;
}

void shef_snapshot_pool_give(struct shef_snapshot_pool *pool, const struct shef_snapshot *snapshot)
{
    struct slot *slot = slot_of(pool, snapshot);

    /* Release: our reads come before the writer's next use. */
    const uint64_t state = atomic_fetch_sub_explicit(&slot->state, 1, memory_order_release);

    assert(state != FILLING && HOLDERS(state) > 0);
}

uint64_t shef_snapshot_pool_end(const struct shef_snapshot_pool *pool)
{
    /* Acquire: what is below the end can be taken. */
    return atomic_load_explicit(&pool->end, memory_order_acquire);
}

uint64_t shef_snapshot_pool_lost_count(const struct shef_snapshot_pool *pool)
{
    return atomic_load_explicit(&pool->n_lost, memory_order_relaxed);
}
