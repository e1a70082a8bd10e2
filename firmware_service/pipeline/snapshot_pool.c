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
    int16_t *pixels; /* of both images */
    /* Written by all. */
    _Atomic uint64_t state;
};

struct scratch {
    struct shef_image_i16 image;
    const struct slot *user; /* NULL: free */
};

struct shef_snapshot_pool {
    struct slot *slots;
    int32_t n_slots;
    /* The writer's. */
    struct scratch scratches[SHEF_SNAPSHOT_MAX_FILLING];
    /* The writer writes, others read. */
    _Atomic uint64_t end;
    _Atomic uint64_t n_lost;
};

/* Images in one piece; what follows each is readable for the warp. */
static int16_t *create_images(struct shef_image_i16 *const images[], size_t n_images,
                              int32_t width_px, int32_t height_px)
{
    const size_t pad = SHEF_WARP_PAD_BYTES / sizeof(int16_t);
    const size_t stride = ((size_t)width_px + pad - 1) / pad * pad;
    const size_t n_image = stride * (size_t)height_px;
    int16_t *pixels = shef_memory_create(n_images * n_image + pad, sizeof *pixels);

    if (!pixels)
        return NULL;
    for (size_t i = 0; i < n_images; i++)
        *images[i] = (struct shef_image_i16){
            .data = pixels + i * n_image,
            .width_px = width_px,
            .height_px = height_px,
            .stride_bytes = (ptrdiff_t)(stride * sizeof *pixels),
        };
    return pixels;
}

static bool create_slot(struct slot *slot, int32_t width_px, int32_t height_px)
{
    struct shef_image_i16 *const images[] = { &slot->snapshot.values, &slot->snapshot.sums };

    atomic_init(&slot->state, EMPTY);
    slot->pixels = create_images(images, 2, width_px, height_px);
    return slot->pixels != NULL;
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

    for (; is_complete && pool->n_slots < n_snapshots; pool->n_slots++)
        is_complete = create_slot(&pool->slots[pool->n_slots], width_px, height_px);
    for (int32_t i = 0; is_complete && i < SHEF_SNAPSHOT_MAX_FILLING; i++) {
        struct shef_image_i16 *const image = &pool->scratches[i].image;

        is_complete = create_images(&image, 1, width_px, height_px) != NULL;
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
    for (int32_t i = 0; i < SHEF_SNAPSHOT_MAX_FILLING; i++)
        free(pool->scratches[i].image.data);
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

/* The scratch image that a slot uses, or with NULL one that none does; NULL: there is none. */
static struct scratch *scratch_of(struct shef_snapshot_pool *pool, const struct slot *user)
{
    for (int32_t i = 0; i < SHEF_SNAPSHOT_MAX_FILLING; i++)
        if (pool->scratches[i].user == user)
            return &pool->scratches[i];
    return NULL;
}

struct shef_snapshot *shef_snapshot_pool_begin(struct shef_snapshot_pool *pool,
                                               struct shef_image_i16 *out_scratch)
{
    struct scratch *scratch = scratch_of(pool, NULL);
    uint64_t state = EMPTY;

    for (struct slot *slot; scratch && (slot = best_slot(pool, &state));) {
        /* Acquire: the last holder's reads come before our writes. A failure means that somebody
         * has just taken the slot: look for another. */
        if (atomic_compare_exchange_strong_explicit(&slot->state, &state, FILLING,
                                                    memory_order_acquire, memory_order_relaxed)) {
            scratch->user = slot;
            *out_scratch = scratch->image;
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

/* The slot of a snapshot that was begun; its scratch image is free again. */
static struct slot *end_filling(struct shef_snapshot_pool *pool,
                                const struct shef_snapshot *snapshot)
{
    struct slot *slot = slot_of(pool, snapshot);
    struct scratch *scratch = scratch_of(pool, slot);

    assert(scratch);
    scratch->user = NULL;
    return slot;
}

void shef_snapshot_pool_publish(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot)
{
    struct slot *slot = end_filling(pool, snapshot);

    assert(snapshot->number < NUMBER(EMPTY));
    assert(snapshot->number >= atomic_load_explicit(&pool->end, memory_order_relaxed));
    /* Release: the snapshot's content becomes visible before its number does. */
    atomic_store_explicit(&slot->state, snapshot->number << HOLDER_BITS, memory_order_release);
    /* Release: whoever sees the number finds the slot. */
    atomic_store_explicit(&pool->end, snapshot->number + 1, memory_order_release);
}

void shef_snapshot_pool_cancel(struct shef_snapshot_pool *pool, struct shef_snapshot *snapshot)
{
    atomic_store_explicit(&end_filling(pool, snapshot)->state, EMPTY, memory_order_relaxed);
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
