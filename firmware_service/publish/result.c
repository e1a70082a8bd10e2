#include "publish/result.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define MAX_RESULTS 64u

struct shef_result_pool {
    struct shef_pool *pool;
    struct shef_pool *dense; /* NULL: there are no dense images */
    int32_t width_px;
    int32_t height_px;
};

/* Lays an image out at *offset of a buffer; with data NULL it only counts. */
static struct shef_image_f32 place_f32(uint8_t *data, size_t *offset, int32_t width_px,
                                       int32_t height_px)
{
    const size_t stride_bytes = shef_memory_round_up((size_t)width_px * sizeof(float));
    struct shef_image_f32 image = { .width_px = width_px,
                                    .height_px = height_px,
                                    .stride_bytes = (ptrdiff_t)stride_bytes };

    if (data)
        image.data = (float *)(void *)(data + *offset);
    *offset += stride_bytes * (size_t)height_px;
    return image;
}

static struct shef_image_u8 place_u8(uint8_t *data, size_t *offset, int32_t width_px,
                                     int32_t height_px)
{
    const size_t stride_bytes = shef_memory_round_up((size_t)width_px);
    struct shef_image_u8 image = { .width_px = width_px,
                                   .height_px = height_px,
                                   .stride_bytes = (ptrdiff_t)stride_bytes };

    if (data)
        image.data = data + *offset;
    *offset += stride_bytes * (size_t)height_px;
    return image;
}

/* The result at the beginning of a buffer, its images behind it. Returns the bytes all take. */
static size_t place(uint8_t *data, struct shef_result *out_result, int32_t width_px,
                    int32_t height_px)
{
    size_t offset = shef_memory_round_up(sizeof *out_result);

    out_result->disparity = place_f32(data, &offset, width_px, height_px);
    out_result->confidence = place_f32(data, &offset, width_px, height_px);
    out_result->depth_m = place_f32(data, &offset, width_px, height_px);
    out_result->sigma_m = place_f32(data, &offset, width_px, height_px);
    out_result->picture = place_u8(data, &offset, width_px, height_px);
    return offset;
}

/* The dense images of a buffer. Returns the bytes both take. */
static size_t place_dense(uint8_t *data, struct shef_result *out_result, int32_t width_px,
                          int32_t height_px)
{
    size_t offset = 0;

    out_result->dense_disparity = place_f32(data, &offset, width_px, height_px);
    out_result->dense_confidence = place_f32(data, &offset, width_px, height_px);
    return offset;
}

static bool create_pools(struct shef_result_pool *results, uint32_t n_results, size_t result_bytes,
                         uint32_t n_dense, struct shef_error *err)
{
    struct shef_result measured;

    results->pool = shef_pool_create(n_results, (uint32_t)result_bytes, err);
    if (results->pool && n_dense > 0)
        results->dense = shef_pool_create(
            n_dense, (uint32_t)place_dense(NULL, &measured, results->width_px, results->height_px),
            err);
    return results->pool && (results->dense || n_dense == 0);
}

struct shef_result_pool *shef_result_pool_create(uint32_t n_results, int32_t width_px,
                                                 int32_t height_px, uint32_t n_dense,
                                                 struct shef_error *err)
{
    if (n_results < 1 || n_results > MAX_RESULTS || width_px < 1 ||
        width_px > SHEF_IMAGE_MAX_SIDE_PX || height_px < 1 || height_px > SHEF_IMAGE_MAX_SIDE_PX) {
        (void)shef_fail(
            err, SHEF_ERR_INVALID,
            "pool of %u results of %dx%d px: 1 to %u are possible, of 1 to %d px a side", n_results,
            width_px, height_px, MAX_RESULTS, SHEF_IMAGE_MAX_SIDE_PX);
        return NULL;
    }

    assert(n_dense <= n_results);

    struct shef_result measured = { 0 };
    const size_t result_bytes = place(NULL, &measured, width_px, height_px);

    if (result_bytes > UINT32_MAX) {
        (void)shef_fail(err, SHEF_ERR_INVALID,
                        "pool of results of %dx%d px: one would take %zu bytes, more than 4 GiB",
                        width_px, height_px, result_bytes);
        return NULL;
    }

    struct shef_result_pool *results = calloc(1, sizeof *results);

    if (!results) {
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "pool of results: out of memory");
        return NULL;
    }
    results->width_px = width_px;
    results->height_px = height_px;
    if (!create_pools(results, n_results, result_bytes, n_dense, err)) {
        shef_result_pool_destroy(results);
        return NULL;
    }

    struct shef_buffer *buffers[MAX_RESULTS];

    for (uint32_t i = 0; i < n_results; i++) {
        buffers[i] = shef_pool_take(results->pool);
        struct shef_result *result = (struct shef_result *)(void *)buffers[i]->data;

        (void)place(buffers[i]->data, result, width_px, height_px);
        result->buffer = buffers[i];
    }
    for (uint32_t i = 0; i < n_results; i++)
        shef_buffer_give(buffers[i]);
    return results;
}

void shef_result_pool_destroy(struct shef_result_pool *pool)
{
    if (!pool)
        return;
    shef_pool_destroy(pool->dense);
    shef_pool_destroy(pool->pool);
    free(pool);
}

struct shef_result *shef_result_take(struct shef_result_pool *pool)
{
    struct shef_buffer *buffer = shef_pool_take(pool->pool);

    if (!buffer)
        return NULL;

    struct shef_result *result = (struct shef_result *)(void *)buffer->data;
    const size_t fixed_bytes = offsetof(struct shef_result, seq);

    assert(result->buffer == buffer);
    memset((uint8_t *)result + fixed_bytes, 0, sizeof *result - fixed_bytes);
    result->dense_buffer = pool->dense ? shef_pool_take(pool->dense) : NULL;
    (void)place_dense(result->dense_buffer ? result->dense_buffer->data : NULL, result,
                      pool->width_px, pool->height_px);
    return result;
}

void shef_result_share(struct shef_result *result)
{
    shef_buffer_share(result->buffer);
    if (result->dense_buffer)
        shef_buffer_share(result->dense_buffer);
}

void shef_result_give(struct shef_result *result)
{
    /* First: without its own buffer the result is no longer the caller's. */
    if (result->dense_buffer)
        shef_buffer_give(result->dense_buffer);
    shef_buffer_give(result->buffer);
}

uint64_t shef_result_pool_refused_count(const struct shef_result_pool *pool)
{
    return shef_pool_refused_count(pool->pool);
}

uint32_t shef_result_pool_lent_count(const struct shef_result_pool *pool)
{
    return shef_pool_lent_count(pool->pool);
}
