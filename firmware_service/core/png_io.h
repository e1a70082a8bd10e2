/* PNG files: edge maps and 16-bit disparity in, maps and colour pictures out.
 *
 * Reading is strict about what a file is, because a map that was silently converted gives wrong
 * figures: grey only, no alpha, no palette, no colour. Grey of 1, 2 or 4 bits is widened to 8
 * (a 1-bit map becomes 0 and 255); 16 bits stay 16. Gamma and colour-space chunks are ignored:
 * the numbers are data. libpng's errors end as a code and a sentence. Thread: any. */
#ifndef SHEF_CORE_PNG_IO_H
#define SHEF_CORE_PNG_IO_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a grey file of 1 to 8 bits (u8) or exactly 16 bits (u16) into an image of its own
 * memory; shef_image_destroy_u8() or _u16() frees it. Sides 1..16384 px.
 * SHEF_ERR_FORMAT: not a PNG, damaged, truncated, or of another pixel type; the sentence says
 * which. Also SHEF_ERR_NOT_FOUND, PERMISSION, IO, NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_png_read_u8(const char *path, struct shef_image_u8 *out_image,
                                               struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_png_read_u16(const char *path, struct shef_image_u16 *out_image,
                                                struct shef_error *err);

/* The same for files that are already in memory. */
SHEF_MUST_CHECK enum shef_err shef_png_decode_u8(const uint8_t *bytes, size_t n_bytes,
                                                 struct shef_image_u8 *out_image,
                                                 struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_png_decode_u16(const uint8_t *bytes, size_t n_bytes,
                                                  struct shef_image_u16 *out_image,
                                                  struct shef_error *err);

/* Write a grey file of 8 or 16 bits or a colour file of 3 x 8 bits; see shef_file_replace_lazily()
 * for what a failure leaves behind. */
SHEF_MUST_CHECK enum shef_err shef_png_write_u8(const char *path, struct shef_image_u8 image,
                                                struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_png_write_u16(const char *path, struct shef_image_u16 image,
                                                 struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_png_write_rgb8(const char *path, struct shef_image_rgb8 image,
                                                  struct shef_error *err);

/* A colour file in memory; free() it. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_png_encode_rgb8(struct shef_image_rgb8 image,
                                                   uint8_t **out_bytes, size_t *out_n_bytes,
                                                   struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
