#include "core/memory.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

void *shef_memory_create(size_t n_items, size_t item_bytes)
{
    size_t n_bytes;

    if (__builtin_mul_overflow(n_items, item_bytes, &n_bytes) ||
        n_bytes > SIZE_MAX - SHEF_MEMORY_ALIGN_BYTES)
        return NULL;
    n_bytes = shef_memory_round_up(n_bytes);
    if (n_bytes == 0)
        n_bytes = SHEF_MEMORY_ALIGN_BYTES;

    void *memory = aligned_alloc(SHEF_MEMORY_ALIGN_BYTES, n_bytes);

    if (memory)
        memset(memory, 0, n_bytes);
    return memory;
}

/* Returns the pixels, or NULL with the sentence in err. */
static void *create_pixels(int32_t width_px, int32_t height_px, size_t pixel_bytes,
                           ptrdiff_t *out_stride_bytes, struct shef_error *err)
{
    if (width_px < 1 || height_px < 1 || width_px > SHEF_IMAGE_MAX_SIDE_PX ||
        height_px > SHEF_IMAGE_MAX_SIDE_PX) {
        (void)shef_fail(err, SHEF_ERR_INVALID, "image of %d x %d px: sides must be 1 to %d",
                        width_px, height_px, SHEF_IMAGE_MAX_SIDE_PX);
        return NULL;
    }

    const size_t stride_bytes = shef_memory_round_up((size_t)width_px * pixel_bytes);
    void *pixels = shef_memory_create((size_t)height_px, stride_bytes);

    if (!pixels)
        (void)shef_fail(err, SHEF_ERR_NO_MEMORY, "image of %d x %d px: out of memory", width_px,
                        height_px);
    *out_stride_bytes = (ptrdiff_t)stride_bytes;
    return pixels;
}

#define DEFINE_IMAGE_MEMORY(name)                                                                  \
    enum shef_err shef_image_create_##name(struct shef_image_##name *out_image, int32_t width_px,  \
                                           int32_t height_px, struct shef_error *err)              \
    {                                                                                              \
        struct shef_image_##name image = { .width_px = width_px, .height_px = height_px };         \
        struct shef_error failure = { 0 };                                                         \
                                                                                                   \
        image.data =                                                                               \
            create_pixels(width_px, height_px, sizeof *image.data, &image.stride_bytes, &failure); \
        if (!image.data)                                                                           \
            return shef_fail(err, failure.code, "%s", failure.text);                               \
        *out_image = image;                                                                        \
        return SHEF_OK;                                                                            \
    }                                                                                              \
                                                                                                   \
    void shef_image_destroy_##name(struct shef_image_##name *image)                                \
    {                                                                                              \
        free(image->data);                                                                         \
        *image = (struct shef_image_##name){ 0 };                                                  \
    }

DEFINE_IMAGE_MEMORY(u8)
DEFINE_IMAGE_MEMORY(u16)
DEFINE_IMAGE_MEMORY(i8)
DEFINE_IMAGE_MEMORY(i16)
DEFINE_IMAGE_MEMORY(f32)
DEFINE_IMAGE_MEMORY(rgb8)

void shef_image_copy_f32(struct shef_image_f32 from, struct shef_image_f32 to)
{
    assert(from.width_px == to.width_px && from.height_px == to.height_px);
    for (int32_t y = 0; y < from.height_px; y++)
        memcpy(shef_row_f32(to, y), shef_row_f32(from, y), (size_t)from.width_px * sizeof(float));
}
