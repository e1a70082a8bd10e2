/* Views of two-dimensional data: borrowed memory, explicit strides, no ownership.
 *
 * Origin top-left, x right, y down, pixel centres at integer coordinates. Strides are in bytes
 * and may exceed the row. `const` views are for reading. */
#ifndef SHEF_CORE_IMAGE_H
#define SHEF_CORE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One pixel of a colour picture, in the order of PNG files. */
struct shef_rgb8 {
    uint8_t red;
    uint8_t green;
    uint8_t blue;
};

#define SHEF_DECLARE_IMAGE(name, type)                                                             \
    struct shef_image_##name {                                                                     \
        type *data;                                                                                \
        int32_t width_px;                                                                          \
        int32_t height_px;                                                                         \
        ptrdiff_t stride_bytes;                                                                    \
    };                                                                                             \
    static inline type *shef_row_##name(struct shef_image_##name image, int32_t y)                 \
    {                                                                                              \
        return (type *)((uint8_t *)image.data + y * image.stride_bytes);                           \
    }

SHEF_DECLARE_IMAGE(u8, uint8_t)
SHEF_DECLARE_IMAGE(u16, uint16_t)
SHEF_DECLARE_IMAGE(i8, int8_t)
SHEF_DECLARE_IMAGE(i16, int16_t)
SHEF_DECLARE_IMAGE(f32, float)
SHEF_DECLARE_IMAGE(rgb8, struct shef_rgb8)

#undef SHEF_DECLARE_IMAGE

#ifdef __cplusplus
}
#endif

#endif
