/* Memory for pixels, volumes and buffers: aligned to a cache line and zeroed.
 *
 * For set-up only; streaming threads work in what set-up gave them. Thread: any. */
#ifndef SHEF_CORE_MEMORY_H
#define SHEF_CORE_MEMORY_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_MEMORY_ALIGN_BYTES 64
#define SHEF_IMAGE_MAX_SIDE_PX  16384

/* n_bytes rounded up to whole cache lines; n_bytes at most SIZE_MAX - 64. */
static inline size_t shef_memory_round_up(size_t n_bytes)
{
    return (n_bytes + SHEF_MEMORY_ALIGN_BYTES - 1) / SHEF_MEMORY_ALIGN_BYTES *
           SHEF_MEMORY_ALIGN_BYTES;
}

/* n_items * item_bytes bytes, 64-byte aligned and zero; the size is rounded up to whole cache
 * lines, so vector loads may run to the end of the last one. Free with free().
 * NULL: out of memory, or the product is more than size_t holds. */
void *shef_memory_create(size_t n_items, size_t item_bytes);

/* create: a black image of its own memory. Width and height 1..16384 px; rows start on cache
 *         lines. SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated.
 * destroy: frees it and zeroes the view; a zeroed view is allowed. */
#define SHEF_DECLARE_IMAGE_MEMORY(name)                                                            \
    SHEF_MUST_CHECK enum shef_err shef_image_create_##name(struct shef_image_##name *out_image,    \
                                                           int32_t width_px, int32_t height_px,    \
                                                           struct shef_error *err);                \
    void shef_image_destroy_##name(struct shef_image_##name *image);

SHEF_DECLARE_IMAGE_MEMORY(u8)
SHEF_DECLARE_IMAGE_MEMORY(u16)
SHEF_DECLARE_IMAGE_MEMORY(i8)
SHEF_DECLARE_IMAGE_MEMORY(i16)
SHEF_DECLARE_IMAGE_MEMORY(f32)
SHEF_DECLARE_IMAGE_MEMORY(rgb8)

#undef SHEF_DECLARE_IMAGE_MEMORY

/* Copies all pixels to another image of the same size; strides may differ. */
void shef_image_copy_f32(struct shef_image_f32 from, struct shef_image_f32 to);

#ifdef __cplusplus
}
#endif

#endif
